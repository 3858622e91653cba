"""Textbook hybrid systems."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from sitl.errors import SitlError

SUPERVISOR = "supervisor"


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl hybrid``."""
    made = argparse.ArgumentParser(prog="darko-sitl hybrid", description=commands["hybrid"] + ".")
    made.add_argument("name", nargs="?", help="which one; without a name they are listed")
    return made


def run(args: argparse.Namespace) -> int:
    """List the systems or run one and print its solution on hybrid time (t, j)."""
    if args.name == SUPERVISOR:
        from sitl.supervisor.table import diagram  # noqa: PLC0415 - --help must stay quick

        print(diagram())
        return 0
    from sitl.hybrid.textbook import systems  # noqa: PLC0415

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
