"""Textbook hybrid systems, and the diagram of the vehicle's supervisor."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from protocol.tools.command_line import CommandParser
from sitl.errors import SitlError

SUPERVISOR = "supervisor"


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study hybrid``."""
    options = CommandParser(prog="darko-sitl study hybrid", description=commands["hybrid"] + ".")
    options.add_argument("name", nargs="?", help="which system; without a name they are listed")
    return options


def run(args: argparse.Namespace) -> int:
    """List the systems or run one and print its solution on hybrid time (t, j)."""
    if args.name == SUPERVISOR:
        from sitl.supervisor.table import diagram  # noqa: PLC0415 - --help must not load the compiler

        print(diagram())
        return 0
    from sitl.lab.reproduction.textbook.systems import systems  # noqa: PLC0415

    known = systems()
    if args.name is None:
        for name, system in known.items():
            print(f"{name:<16}{system.description}")
        print(f"{SUPERVISOR:<16}The vehicle's own table of jumps, as a Mermaid diagram")
        return 0
    if args.name not in known:
        raise SitlError(f"no system {args.name!r}: there are {', '.join((*known, SUPERVISOR))}")
    print(known[args.name].summary())
    return 0
