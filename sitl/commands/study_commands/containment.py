"""Flights under a net, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.enclosure.arena_files import load_arena
from sitl.lab.studies.arena_flights import containment
from sitl.lab.studies.arena_flights.containment import FlownContainment


def run(args: argparse.Namespace) -> int:
    """Fly and print; exit code 1 if a point outside was accepted, or the net was touched in calm."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})

    load_arena(args.arena)
    seeds = range(args.first, args.first + args.flights)
    winds = [(wall, burst) for wall in args.wall for burst in args.bursts if wall > 0.0 or burst == args.bursts[0]]
    conditions = [
        containment.ContainmentConditions(seed, wall, burst if wall > 0.0 else 0.0, args.turbulence)
        for wall, burst in winds
        for seed in seeds
    ]
    flown = containment.run_containment(
        conditions, args.arena, craft_of(args), args.jobs, lambda done: print_progress(done, len(conditions))
    )
    print("\n".join(containment.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() for flight in flown])
    return 0 if stayed_inside(flown) else 1


def stayed_inside(flown: Sequence[FlownContainment]) -> bool:
    """Whether no point outside was accepted, and every flight in calm flew on."""
    calm = [flight for flight in flown if flight.wall == 0.0]
    return not any(flight.accepted_outside for flight in flown) and all(flight.end == "flew on" for flight in calm)
