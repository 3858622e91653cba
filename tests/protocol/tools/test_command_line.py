"""The command line runner: one module per command, expected errors in one line, exit codes."""

import argparse
import json
import math
import sys
from contextlib import suppress
from types import ModuleType

import pytest

from protocol.tools.command_line import (
    EXIT_BROKEN_PIPE,
    EXIT_ERROR,
    EXIT_INTERRUPTED,
    CommandParser,
    asks_for_json,
    failure_of,
    run_cli,
)

COMMANDS = {"fly": "fly somewhere", "land": "land at once"}


class ProgramError(Exception):
    """Base of the expected errors of a program."""


class LinkError(ProgramError):
    """An expected error with an exit code of its own."""

    exit_code = 3


@pytest.fixture
def program(monkeypatch):
    """A program with two commands; ``program.act`` is what ``fly`` does."""
    package = ModuleType("program")
    package.act = lambda _arguments: 0
    fly, land = ModuleType("program.commands.fly"), ModuleType("program.commands.land")

    def parser(commands):
        made = argparse.ArgumentParser(prog="program fly", description=commands["fly"])
        made.add_argument("--far", action="store_true")
        return made

    def fly_run(arguments):
        return package.act(arguments)

    fly.parser, fly.run = parser, fly_run
    land.parser, land.run = lambda _commands: argparse.ArgumentParser(), lambda _arguments: 7
    for module in (package, ModuleType("program.commands"), fly, land):
        monkeypatch.setitem(sys.modules, module.__name__, module)
    return package


def run(*arguments):
    return run_cli("program", "program", COMMANDS, ProgramError, arguments)


def test_the_first_command_is_run_if_none_is_named(program):
    program.act = lambda arguments: 5 if arguments.far else 4
    assert (run(), run("--far"), run("fly", "--far"), run("land")) == (4, 5, 5, 7)


@pytest.mark.parametrize("json_option", [[], ["--json"]])
def test_a_command_that_moved_says_where_it_is(capsys, json_option):
    arguments = ["hover", "--far", *json_option]
    assert run_cli("program", "program", COMMANDS, ProgramError, arguments, {"hover": "fly hover"}) == EXIT_ERROR
    printed = capsys.readouterr()
    assert printed.err == "program: 'hover' is now 'program fly hover'\n"
    assert [json.loads(line)["exit_code"] for line in printed.out.splitlines()] == [2] * len(json_option)


def test_the_version_is_that_of_the_distribution(capsys):
    assert run("--version") == 0
    assert capsys.readouterr().out.startswith("program 0.")


@pytest.mark.parametrize(("error", "code"), [(ProgramError("no wind"), EXIT_ERROR), (LinkError("no wind"), 3)])
def test_an_expected_error_is_one_line_and_an_exit_code(program, capsys, error, code):
    def fail(_arguments):
        raise error

    program.act = fail
    assert run("fly") == code
    assert capsys.readouterr().err == "program: no wind\n"


def test_an_interrupt_is_an_exit_code(program):
    def interrupt(_arguments):
        raise KeyboardInterrupt

    program.act = interrupt
    assert run() == EXIT_INTERRUPTED


def test_a_closed_reader_is_an_exit_code(program, monkeypatch, tmp_path):
    def write(_arguments):
        raise BrokenPipeError

    program.act = write
    with (tmp_path / "output").open("w") as output:
        monkeypatch.setattr(sys, "stdout", output)
        assert run() == EXIT_BROKEN_PIPE


def test_an_unexpected_error_is_raised(program):
    def fail(_arguments):
        raise RuntimeError("a bug")

    program.act = fail
    with pytest.raises(RuntimeError, match="a bug"):
        run()


def test_the_exit_codes_are_those_that_shells_and_argparse_use():
    assert (EXIT_ERROR, EXIT_INTERRUPTED, EXIT_BROKEN_PIPE) == (2, 128 + 2, 128 + 13)


def test_an_unknown_command_is_answered_with_those_that_there_are(program, capsys):
    assert run("fliy") == EXIT_ERROR
    assert capsys.readouterr().err == "program: there is no command 'fliy'. Did you mean fly? Commands: fly, land\n"


def told(capsys):
    """The one JSON object on stdout."""
    (line,) = capsys.readouterr().out.splitlines()
    return json.loads(line)


def test_every_command_takes_json_and_its_texts_are_a_list(program, capsys):
    program.act = lambda _arguments: print("one\ntwo") or 0
    assert run("fly", "--json") == 0
    assert told(capsys) == {"ok": True, "command": "fly", "exit_code": 0, "output": ["one", "two"]}
    program.act = lambda _arguments: 1
    assert run("fly", "--json") == 1
    assert told(capsys) == {"ok": False, "command": "fly", "exit_code": 1, "output": []}


def test_the_version_is_told_as_json(capsys):
    assert run("--version", "--json") == 0
    assert told(capsys)["version"].startswith("0.")


def test_what_is_known_of_a_failure_is_told(program, capsys):
    def fail(_arguments):
        error = LinkError("upload failed: Mission refused: item 4: param 2 is inf")
        error.details = {"said": ["x"], "seen": math.nan}
        raise error

    program.act = fail
    assert run("fly", "--json") == 3
    assert told(capsys) == {
        "ok": False, "command": "fly", "error": "upload failed: Mission refused: item 4: param 2 is inf",
        "exit_code": 3, "item": 4, "param": 2, "said": ["x"], "seen": None,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (
            "Mission refused: item 1: param2 is 500, not -1, -2 or a number from 0.1 to 22 m/s (speed)",
            {"item": 1, "param": 2, "limit": {"min": 0.1, "max": 22.0, "unit": "m/s"}},
        ),
        (
            "Fence refused: fence item 3: param1 is inf, not a number from -1e+06 to 100000 (radius)",
            {"item": 3, "param": 1, "limit": {"min": -1e6, "max": 1e5, "unit": ""}},
        ),
        ("x.plan: mission.items[4].params[0]: a list is not a number", {"item": 4}),
        ("last item reached: none", {}),
    ],
)
def test_item_parameter_and_range_are_read_from_the_words(words, told):
    plain = {"ok": False, "command": "c", "error": words, "exit_code": 4}
    assert failure_of(ValueError(words), "c", 4) == plain | told


@pytest.mark.parametrize(
    ("error", "code", "words"),
    [(KeyboardInterrupt, 130, "interrupted"), (RuntimeError("a bug"), 1, "internal error: RuntimeError: a bug")],
)
def test_an_interrupt_and_a_fault_are_told_too(program, capsys, error, code, words):
    def fail(_arguments):
        raise error

    program.act = fail
    with suppress(RuntimeError):
        assert run("fly", "--json") == code
    assert told(capsys) == {"ok": False, "command": "fly", "error": words, "exit_code": code}


def test_wrong_arguments_are_told_as_json_and_end_as_argparse_does(capsys):
    parser = CommandParser(prog="program fly")
    with pytest.raises(SystemExit) as end:
        parser.parse_args(["--fast"])
    assert end.value.code == EXIT_ERROR
    said = capsys.readouterr().err
    assert said.startswith("usage: program fly")
    assert "program fly: error: unrecognized arguments: --fast" in said


@pytest.mark.parametrize(
    ("arguments", "asked"),
    [
        (["--json"], True), (["x", "--js"], True), (["--j"], True), (["--jump"], False), ([], False),
        (["--", "--json"], False), (["json"], False),
    ],
)  # fmt: skip
def test_json_is_asked_for_as_argparse_reads_it(arguments, asked):
    assert asks_for_json(arguments) is asked
