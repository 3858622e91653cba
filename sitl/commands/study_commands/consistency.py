"""Whether the navigation filter is as wrong as it says, over many seeds."""

from __future__ import annotations

import argparse

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.errors import SitlError
from sitl.lab.studies import consistency


def run(args: argparse.Namespace) -> int:
    """Fly and print NEES and NIS; exit code 1 if the filter is surer than it may be."""
    check_seeded(args, {"gusts": 10.0})

    craft = craft_of(args)
    if craft.navigation.value == "truth":
        raise SitlError("--nav truth: there is no filter to judge")
    of = 6 * args.flights
    flown = consistency.run(
        range(args.first, args.first + args.flights),
        craft,
        args.jobs,
        lambda done: print_progress(done, of),
        args.gusts,
    )
    print("\n".join(consistency.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{"draw": str(flight.draw), "nees": flight.nees[:, 0].tolist()} for flight in flown])
    groups = [
        [flight for flight in flown if flight.draw.phase is phase and flight.draw.wrong is wrong]
        for phase in consistency.Phase
        for wrong in (False, True)
    ]
    verdicts = [consistency.verdict(group, part) for group in groups for part in consistency.JUDGED]
    return 0 if all(v.mean <= v.high for v in verdicts) else 1
