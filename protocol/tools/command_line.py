"""Runs the commands of a program, one module each, imported only when needed; with ``--json`` the result is JSON.

``{"ok": true, ...}``, or ``{"ok": false, "command": ..., "error": ..., "exit_code": ...}`` with what else is known of
the failure: the vehicle's words, the item, what was waited for.
"""

from __future__ import annotations

import argparse
import io
import json
import math
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stdout
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import version
from typing import Any, NoReturn


def json_values(value: Any) -> Any:  # noqa: ANN401 - whatever JSON can hold
    """The value with null for NaN and infinity, which JSON does not have, at any depth; tuples become lists."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {key: json_values(inner) for key, inner in value.items()}
    return [json_values(inner) for inner in value] if isinstance(value, list | tuple) else value


OPTION = "--json"
_ITEM = re.compile(r"\bitem (\d+)\b|\bitems\[(\d+)\]")
_PARAMETER = re.compile(r"\bparam(?:eter)? ?([1-7])\b")
_RANGE = re.compile(r"\bfrom (-?[\d.]+(?:e[-+]?\d+)?) to (-?[\d.]+(?:e[-+]?\d+)?)(?: ([^\s()]+))?(?: \(|$)")


def asks_for_json(arguments: list[str]) -> bool:
    """Whether ``--json``, or what argparse takes for it, is among the arguments."""
    before = arguments[: arguments.index("--")] if "--" in arguments else arguments
    return any(text.startswith("--j") and OPTION.startswith(text.partition("=")[0]) for text in before)


def print_json(result: Mapping[str, Any], indent: int | None = None) -> None:
    """Print a result on stdout; what JSON does not have is null."""
    print(json.dumps(json_values(dict(result)), indent=indent), flush=True)


def failure_of(error: BaseException, command: str, code: int) -> dict[str, Any]:
    """A failed command's result.

    Args:
        error: What happened; its attribute ``details``, if it has one, tells more by name.
        command: What was asked for.
        code: The exit code.
    """
    text = str(error) or type(error).__name__
    told: dict[str, Any] = {"ok": False, "command": command, "error": text, "exit_code": code}
    if item := _ITEM.search(text):
        told |= {"item": int(item[1] or item[2]), **_about_item(text, item.end())}
    return told | dict(getattr(error, "details", {}))


def _about_item(text: str, begin: int) -> dict[str, Any]:
    """The number of an item's parameter, and its range, that the words behind the item's number name."""
    told: dict[str, Any] = {}
    if parameter := _PARAMETER.search(text, begin):
        told["param"] = int(parameter[1])
    if found := _RANGE.search(text, begin):
        told["limit"] = {"min": float(found[1]), "max": float(found[2]), "unit": found[3] or ""}
    return told


class PrintedLines(io.TextIOBase):
    """Takes what is printed: to stderr, where people read it, and as lines."""

    def __init__(self) -> None:
        self._text: list[str] = []

    def write(self, text: str) -> int:
        """Take a text."""
        self._text.append(text)
        return sys.stderr.write(text)

    def flush(self) -> None:
        """Show what was taken."""
        sys.stderr.flush()

    @property
    def lines(self) -> list[str]:
        """Lines printed so far."""
        return "".join(self._text).splitlines()


@contextmanager
def printed_lines() -> Iterator[PrintedLines]:
    """Keep texts of a command that has no JSON of its own off stdout."""
    taken = PrintedLines()
    with redirect_stdout(taken):
        yield taken


EXIT_ERROR = 2  # of an expected error without an exit code of its own
EXIT_FAULT = 1  # of an unexpected one, as Python ends with
TEXTS_AS_JSON = "texts_as_json"  # where the option of commands is that have no JSON of their own
EXIT_INTERRUPTED, EXIT_BROKEN_PIPE = 130, 141  # as shells report SIGINT and SIGPIPE


class UsageError(SystemExit):
    """Arguments that a command does not take. Ends the process as argparse does, and knows what was wrong."""

    def __init__(self, prog: str, message: str) -> None:
        super().__init__(EXIT_ERROR)
        self.prog, self.message = prog, message

    def __str__(self) -> str:
        return self.message


class CommandParser(argparse.ArgumentParser):
    """A parser of arguments whose errors say what was wrong also to ``run_cli``, which tells programs.

    Options may stand anywhere, also between a positional argument and a list of them.
    """

    _is_mixing = False  # within its own second pass

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> Any:  # noqa: ANN401 - as it is typed there
        """Arguments and those that are not known, as of every parser.

        Raises:
            UsageError: If they are wrong.
        """
        positionals = [action for action in self._actions if not action.option_strings]
        has_list = any(action.nargs == "*" for action in positionals)
        if self._is_mixing or not has_list or any(action.nargs == argparse.PARSER for action in positionals):
            return super().parse_known_args(args, namespace)
        self._is_mixing = True
        try:
            return self.parse_known_intermixed_args(args, namespace)
        finally:
            self._is_mixing = False

    def error(self, message: str) -> NoReturn:
        """Print usage and error on stderr, as every parser does.

        Raises:
            UsageError: Always.
        """
        self.print_usage(sys.stderr)
        print(f"{self.prog}: error: {message}", file=sys.stderr)
        raise UsageError(self.prog, message)


def command_parser(prog: str, commands: Mapping[str, str], epilog: str) -> argparse.ArgumentParser:
    """A command line that ends its help with examples.

    Args:
        prog: Program and command, with a space between.
        commands: Description of each command by its name.
        epilog: The examples, printed as they are.
    """
    return CommandParser(
        prog=prog,
        description=commands[prog.rsplit(maxsplit=1)[-1]] + ".",
        epilog=epilog,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )


def run_cli(
    package: str,
    prog: str,
    commands: Mapping[str, str],
    error: type[Exception],
    argv: Sequence[str] | None = None,
    moved: Mapping[str, str] | None = None,
) -> int:
    """Run a command; returns the exit code.

    Each command is a module ``package.commands.NAME`` with ``parser(commands)`` and ``run(arguments)``, which returns
    the exit code. An expected error becomes one line on stderr, and with ``--json``, which every command takes, one
    JSON object on stdout.

    Args:
        package: Import name of the program's package.
        prog: The program's name.
        commands: Description of each command by its name; the first one is run if none is named.
        error: Base of the expected errors; an attribute ``exit_code`` replaces ``EXIT_ERROR``.
        argv: The arguments; None: those of the process.
        moved: By former name, the words that a command is called by now.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if "--version" in arguments and set(arguments) <= {"--version", "--json"}:
        if "--json" in arguments:
            print_json({"ok": True, "program": prog, "version": version("darko")})
        else:
            print(f"{prog} {version('darko')}")
        return 0
    told = _Failures(prog, is_json=asks_for_json(arguments))
    if arguments and not arguments[0].startswith("-") and arguments[0] not in commands:
        now = (moved or {}).get(arguments[0])
        text = f"{arguments[0]!r} is now '{prog} {now}'" if now else _unknown(arguments[0], commands)
        return told.report(error(text), arguments[0], EXIT_ERROR)
    name = arguments.pop(0) if arguments and arguments[0] in commands else next(iter(commands))
    words = name
    try:
        command = import_module(f"{package}.commands.{name}")
        parser = command.parser(commands)
        add_json_option(parser)
        parsed = parser.parse_args(arguments)
        words = _words(name, parsed)
        is_plain = getattr(parsed, TEXTS_AS_JSON, False)
        return _run_as_json(command.run, parsed, words) if is_plain else int(command.run(parsed))
    except UsageError as wrong:
        told.report_fault(wrong, wrong.prog.partition(" ")[2] or words, EXIT_ERROR)
        raise
    except error as expected:
        return told.report(expected, words, int(getattr(expected, "exit_code", EXIT_ERROR)))
    except KeyboardInterrupt as interrupt:
        return told.report(interrupt, words, EXIT_INTERRUPTED)
    except BrokenPipeError:  # the reader of our output, such as a pager or head, has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE
    except Exception as unexpected:
        told.report_fault(unexpected, words)
        raise


class _Failures:
    """Tells of a failure: one line on stderr, and if a program asks, one JSON object on stdout."""

    def __init__(self, prog: str, *, is_json: bool) -> None:
        self._prog, self._is_json = prog, is_json

    def report(self, error: BaseException, command: str, code: int) -> int:
        """Print an expected failure of a command; gives its exit code."""
        if not isinstance(error, KeyboardInterrupt):
            print(f"{self._prog}: {error}", file=sys.stderr)
        return self.report_fault(error, command, code)

    def report_fault(self, error: BaseException, command: str, code: int = EXIT_FAULT) -> int:
        """Print any failure as JSON alone; gives its exit code."""
        if self._is_json:
            told = failure_of(error, command, code)
            if isinstance(error, KeyboardInterrupt):
                told["error"] = "interrupted"
            elif code == EXIT_FAULT:
                told["error"] = f"internal error: {type(error).__name__}: {error}"
            print_json(told)
        return code


def add_json_option(parser: argparse.ArgumentParser) -> None:
    """Give ``--json`` to a parser, or to those of its subcommands, which have none of their own."""
    inner = [action for action in parser._actions if isinstance(action, argparse._SubParsersAction)]  # noqa: SLF001
    for each in {id(each): each for action in inner for each in action.choices.values()}.values():
        add_json_option(each)
    if not inner and not any("--json" in action.option_strings for action in parser._actions):  # noqa: SLF001
        parser.add_argument(
            "--json", dest=TEXTS_AS_JSON, action="store_true", help="print the result, or the failure, as JSON"
        )


def _run_as_json(run: Callable[[argparse.Namespace], int], parsed: argparse.Namespace, words: str) -> int:
    """Run a command that prints texts, which become a list in its JSON."""
    with printed_lines() as printed:
        code = int(run(parsed))
    print_json({"ok": code == 0, "command": words, "exit_code": code, "output": printed.lines})
    return code


def _words(name: str, parsed: argparse.Namespace) -> str:
    """The command as the user knows it, with its subcommand."""
    inner = (getattr(parsed, key, None) for key in ("subcommand", "action", "act"))
    return " ".join([name, *(word for word in inner if isinstance(word, str))])


def _unknown(name: str, commands: Mapping[str, str]) -> str:
    near = get_close_matches(name, commands, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    return f"there is no command {name!r}.{hint} Commands: {', '.join(commands)}"
