"""Runs the commands of a program: one module per command, imported only when it is needed."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from importlib import import_module
from importlib.metadata import version
from types import ModuleType

__all__ = ["EXIT_BROKEN_PIPE", "EXIT_ERROR", "EXIT_INTERRUPTED", "command_parser", "run_cli"]

EXIT_ERROR = 2  # of an expected error without an exit code of its own
EXIT_INTERRUPTED, EXIT_BROKEN_PIPE = 130, 141  # as shells report SIGINT and SIGPIPE


def command_parser(prog: str, commands: Mapping[str, str], epilog: str) -> argparse.ArgumentParser:
    """A command line that ends its help with examples.

    Args:
        prog: Program and command, with a space between.
        commands: Description of each command by its name.
        epilog: The examples, printed as they are.
    """
    return argparse.ArgumentParser(
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
    folders: Mapping[str, str] | None = None,
) -> int:
    """Run a command; returns the exit code.

    Each command is a module ``package.commands.NAME`` with ``parser(commands)`` and ``run(arguments)``, which returns
    the exit code. An expected error becomes one line on stderr.

    Args:
        package: Import name of the program's package.
        prog: The program's name.
        commands: Description of each command by its name; the first one is run if none is named.
        error: Base of the expected errors; an attribute ``exit_code`` replaces ``EXIT_ERROR``.
        argv: The arguments; None: those of the process.
        folders: By name, the folder in ``package.commands`` that has a command's module, if one has.
    """
    arguments = list(sys.argv[1:] if argv is None else argv)
    if arguments == ["--version"]:
        print(f"{prog} {version('darko')}")
        return 0
    if arguments and not arguments[0].startswith("-") and arguments[0] not in commands:
        print(f"{prog}: {_unknown(arguments[0], commands)}", file=sys.stderr)
        return EXIT_ERROR
    name = arguments.pop(0) if arguments and arguments[0] in commands else next(iter(commands))
    command = _command(package, name, (folders or {}).get(name))
    try:
        return int(command.run(command.parser(commands).parse_args(arguments)))
    except error as expected:
        print(f"{prog}: {expected}", file=sys.stderr)
        return int(getattr(expected, "exit_code", EXIT_ERROR))
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED
    except BrokenPipeError:  # the reader of our output, such as a pager or head, has closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_BROKEN_PIPE


def _unknown(name: str, commands: Mapping[str, str]) -> str:
    near = get_close_matches(name, commands, n=1)
    hint = f" Did you mean {near[0]}?" if near else ""
    return f"there is no command {name!r}.{hint} Commands: {', '.join(commands)}"


def _command(package: str, name: str, folder: str | None) -> ModuleType:
    return import_module(".".join(filter(None, (package, "commands", folder, name))))
