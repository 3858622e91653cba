"""Textbook hybrid systems, and the diagram of the vehicle's supervisor."""

from __future__ import annotations

import argparse

from sitl.errors import SitlError
from sitl.lab.reproduction.textbook.systems import systems
from sitl.supervisor.table import diagram

SUPERVISOR = "supervisor"


def run(args: argparse.Namespace) -> int:
    """List the systems or run one and print its solution on hybrid time (t, j)."""
    if args.name == SUPERVISOR:
        print(diagram())
        return 0

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
