"""Holds of a point in wind and gusts, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.lab.studies import holds
from sitl.lab.studies.holds import FlownHold

MIN_NEAR = 0.95  # of the time of all holds in a wind


def run(args: argparse.Namespace) -> int:
    """Fly the holds and print how far off they were; exit code 1 if one is farther off than it may be."""
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "parameters": 0.5})

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
