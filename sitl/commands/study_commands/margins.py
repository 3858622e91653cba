"""Robustness of the laws to delay and noise of the estimate: flights from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from typing import TYPE_CHECKING

from protocol.tools.option_values import finite_number
from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    seeded_parser,
    write_json,
)

if TYPE_CHECKING:
    from sitl.lab.studies.margins import MarginDraw

SURVIVED_DELAY = 0.04  # from sensor to actuator, that everything converges with at the specified noise [s]


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study margins``."""
    options = seeded_parser("margins", commands["margins"], 3, "flights in each cell")
    options.add_argument(
        "--delay", type=finite_number, nargs="+", metavar="S", help="from sensor to actuator [0 to 0.08]"
    )
    options.add_argument("--noise", type=finite_number, nargs="+", metavar="X", help="factors on all noise [1 2 4 8]")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the map and print it; exit code 1 if a delay of 40 ms is not survived at the specified noise."""
    limits = {name: most for name, most in (("delay", 0.1), ("noise", 100.0)) if getattr(args, name) is not None}
    check_seeded(args, limits)
    from sitl.lab.studies import margins  # noqa: PLC0415 - --help must not load the compiler

    seeds = range(args.first, args.first + args.flights)
    draws = margins.grid(seeds, args.delay or margins.DELAYS, args.noise or margins.NOISE_FACTORS, args.controller)
    flown = margins.run(draws, craft_of(args), args.jobs, lambda done: print_progress(done, len(draws)))
    print("\n".join(margins.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() | {"draw": _plain(flight.draw)} for flight in flown])
    needed = [flight for flight in flown if flight.draw.delay <= SURVIVED_DELAY and flight.draw.noise <= 1.0]
    return 0 if all(flight.converged for flight in needed) else 1


def _plain(draw: MarginDraw) -> dict[str, object]:
    return draw._asdict() | {"manoeuvre": draw.manoeuvre.value}
