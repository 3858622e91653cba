"""Holds of a point in wind and gusts, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
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
    from sitl.lab.studies.holds import FlownHold

MIN_NEAR = 0.95  # of the time of all holds in a wind


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study holds``."""
    options = seeded_parser("holds", commands["holds"], 20, "holds in each wind")
    options.add_argument(
        "--wind", type=finite_number, nargs="+", default=[3.0, 5.0, 8.0], metavar="M/S", help="winds [3 5 8]"
    )
    options.add_argument("--gusts", type=finite_number, default=1.0, metavar="RMS", help="gusts per axis, m/s rms [1]")
    options.add_argument(
        "--parameters", type=finite_number, default=0.0, metavar="SHARE", help="error of the design model [0]"
    )
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the holds and print how far off they were; exit code 1 if one is farther off than it may be."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})
    from sitl.lab.studies import holds  # noqa: PLC0415 - --help must not load the compiler

    seeds = range(args.first, args.first + args.flights)
    conditions = [holds.HoldConditions(s, wind, args.gusts, args.parameters) for wind in args.wind for s in seeds]
    flown = holds.run_holds(
        conditions, craft_of(args), args.jobs, on_progress=lambda done: print_progress(done, len(conditions))
    )
    print("\n".join(holds.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [hold._asdict() for hold in flown])
    return 0 if passed(flown) else 1


def passed(flown: Sequence[FlownHold]) -> bool:
    """Whether no hold ended, and those of each wind were near for most of the time."""
    winds = {hold.wind for hold in flown}
    shares = [[hold.near for hold in flown if hold.wind == wind] for wind in winds]
    return not any(hold.fault for hold in flown) and all(sum(near) >= MIN_NEAR * len(near) for near in shares)
