"""Holds in a wind wall's jet, from many seeds."""

from __future__ import annotations

import argparse

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.enclosure.arena_files import load_arena
from sitl.lab.studies.arena_flights import jet_holds
from sitl.lab.studies.arena_flights.containment import ContainmentConditions
from sitl.lab.studies.arena_flights.jet_holds_plot import save_jet_map
from sitl.tools.plotting import check_plot_path


def run(args: argparse.Namespace) -> int:
    """Fly the holds and print the map."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})
    if args.plot is not None:
        check_plot_path(args.plot)

    load_arena(args.arena)
    conditions = [
        ContainmentConditions(seed, wall, burst, args.turbulence)
        for wall in args.wall
        for burst in args.bursts
        for seed in range(args.first, args.first + args.flights)
    ]
    flown = jet_holds.run_jet_holds(
        conditions, args.arena, craft_of(args), args.jobs, lambda done: print_progress(done, len(conditions))
    )
    print("\n".join(jet_holds.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [hold._asdict() for hold in flown])
    if args.plot is not None:
        save_jet_map(flown, args.plot)
    return 0
