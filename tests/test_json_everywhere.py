"""Every command of both programs takes ``--json``, and answers every failure by one JSON object on stdout."""

import argparse
import json
from importlib import import_module

import pytest

from darko_gcs import __main__ as ground
from protocol.tools.command_line import CommandParser, add_json_option
from sitl import __main__ as vehicle
from tests.support.paths import DATA

FLIGHT = str(DATA / "square-flight.tlog")
GROUND_FAILURES = [  # arguments, exit code, words of the error
    ("connect --mission nofile.plan", 2, "nofile.plan: cannot be read"),
    ("--mission nofile.plan", 2, "nofile.plan: cannot be read"),
    ("fly --mission nofile.plan --headless", 2, "nofile.plan: cannot be read"),
    ("fly --headless", 2, "required: --mission"),
    ("watch --every 0.001", 2, "--every takes 0.01 to 3600 s"),
    ("cmd goto 1", 2, "goto takes 3 values, not 1"),
    ("cmd takeoff abc", 2, "takeoff: abc are not numbers"),
    ("cmd dance", 2, "invalid choice: 'dance'"),
    ("cmd arm --port 0 --timeout 0.2", 3, "no vehicle heard for 0.2 s"),
    ("cmd arm --all --port 0 --timeout 0.2", 3, "no vehicle heard for 0.2 s"),
    ("param load bad.parm", 2, "bad.parm:1: X = 'abc' is not a number"),
    ("param diff nofile", 2, "nofile: cannot be read"),
    ("param set X", 2, "param set takes 2 value"),
    ("mission upload nofile.plan", 2, "nofile.plan: cannot be read"),
    ("mission download back.json", 2, "back.json: the suffix of a plan is .plan, .waypoints, .txt"),
    ("mission upload", 2, "mission upload takes 1 file, not 0"),
    ("replay nofile.tlog", 2, "nofile.tlog: cannot be read"),
    ("signing --new-key nokey", 2, "--new-key: signing key"),
    ("bridge --signing-key nokey", 2, "signing key"),
    ("fail gps", 2, "required: failure"),
    ("fail gps off --signing-key nokey", 2, "signing key"),
    ("plan load noplan.xml", 2, "noplan.xml cannot be read"),
    ("plan status --signing-key nokey", 2, "signing key"),
    ("log info nofile.tlog", 2, "nofile.tlog: cannot be read"),
    ("log info bad.parm", 2, "bad.parm: not a telemetry log: it is a text file"),
    ("log report nofile.tlog", 2, "nofile.tlog: cannot be read"),
    (f"log plot {FLIGHT} ATTITUDE.rol", 2, "ATTITUDE has no field rol; it has time_boot_ms, roll"),
    (f"log plot {FLIGHT} ATITUDE.roll", 2, "did you mean ATTITUDE"),
    (f"log plot {FLIGHT} ATTITUDE.roll --vehicle 9", 2, "no vehicle 9 in this log; it has vehicle 1/1"),
    (f"log export {FLIGHT} x.csv", 2, "a table needs the fields"),
    (f"log play {FLIGHT} --to elsewhere", 3, "an address to play to"),
    (f"log play {FLIGHT} --vehicle 9", 2, "no vehicle 9"),
    ("log fetch --port 0 --host nowhere", 3, "nowhere"),
    ("dance", 2, "there is no command 'dance'"),
    ("log dance", 2, "invalid choice: 'dance'"),
]
VEHICLE_FAILURES = [
    ("run --airframe none.toml", 2, "none.toml"),
    ("airframe none", 2, "none"),
    ("plan noplan.xml", 2, "noplan.xml"),
    ("day noday.toml", 2, "noday.toml"),
    ("optimal leg", 2, "required: M"),
    ("optimal leg -5", 2, "-5 is negative"),
    ("study identify nofile.tlog", 2, "nofile.tlog"),
    ("study scenario dance", 2, "dance"),
    ("study dance", 2, "dance"),
    ("study", 2, "required: STUDY"),
    ("falls --flights 3", 2, "'falls' is now 'darko-sitl study falls'"),
    ("dance", 2, "there is no command 'dance'"),
]


def answer(main, arguments, capsys):
    """Exit code and the one JSON object on stdout."""
    capsys.readouterr()
    try:
        code = main(arguments)
    except SystemExit as end:
        code = end.code
    (line,) = capsys.readouterr().out.splitlines()
    return code, json.loads(line)


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.parm").write_text("X abc\n")


def leaves(program, package):
    """Every command and subcommand that can be typed, with its parser."""
    for name in program.COMMANDS:
        parser = import_module(f"{package}.commands.{name}").parser(program.COMMANDS)
        add_json_option(parser)
        yield from _leaves([name], parser)


def _leaves(words, parser):
    inner = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]
    if not inner:
        yield words, parser
    for name, each in (pair for action in inner for pair in action.choices.items()):
        yield from _leaves([*words, name], each)


LEAVES = [
    *((ground.main, *leaf) for leaf in leaves(ground, "darko_gcs")),
    *((vehicle.main, *leaf) for leaf in leaves(vehicle, "sitl")),
]


@pytest.mark.parametrize(
    ("main", "words", "parser"), LEAVES, ids=lambda value: " ".join(value) if isinstance(value, list) else ""
)
def test_every_command_takes_json_and_answers_wrong_arguments_by_it(main, words, parser, capsys):
    assert isinstance(parser, CommandParser)
    assert "--json" in parser.format_help()
    code, told = answer(main, [*words, "--json", "--no-such-option"], capsys)
    assert (code, told["ok"], told["exit_code"], told["command"]) == (2, False, 2, told["command"])
    assert told["command"].split()[0] == words[0] or words[0] in {"connect", "run"}
    assert told["error"]


def test_all_subcommands_are_among_them():
    named = {" ".join(words) for main, words, _ in LEAVES if main is ground.main}
    assert {"log info", "log report", "log plot", "log export", "log play", "log fetch", "plan move", "fly"} <= named


@pytest.mark.parametrize(("typed", "code", "words"), GROUND_FAILURES)
def test_a_failure_of_the_ground_station_is_one_json_object_with_its_words(typed, code, words, capsys):
    got, told = answer(ground.main, [*typed.split(), "--json"], capsys)
    assert (got, told["ok"], told["exit_code"]) == (code, False, code)
    assert words in told["error"]


@pytest.mark.parametrize(("typed", "code", "words"), VEHICLE_FAILURES)
def test_a_failure_of_the_vehicle_program_is_one_json_object_with_its_words(typed, code, words, capsys):
    got, told = answer(vehicle.main, [*typed.split(), "--json"], capsys)
    assert (got, told["ok"], told["exit_code"]) == (code, False, code)
    assert words in told["error"]


def test_a_command_without_figures_gives_its_texts(capsys):
    code, told = answer(vehicle.main, ["airframe", "--json"], capsys)
    assert (code, told["ok"], told["command"]) == (0, True, "airframe")
    assert any("collage" in line for line in told["output"])
