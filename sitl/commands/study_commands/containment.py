"""Flights under a net, from many seeds."""

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
    from sitl.lab.studies.arena_flights.containment import FlownContainment


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study containment``."""
    options = seeded_parser("containment", commands["containment"], 20, "flights in each wind")
    options.set_defaults(nav="mocap")
    options.add_argument("--arena", default="voliere", metavar="FILE", help="shipped arena or TOML file [voliere]")
    options.add_argument(
        "--wall", type=finite_number, nargs="+", default=[0.0, 2.0, 4.0], metavar="M/S", help="winds [0 2 4]"
    )
    options.add_argument(
        "--bursts", type=finite_number, nargs="+", default=[0.0, 2.0], metavar="M/S", help="1-cos gusts [0 2]"
    )
    options.add_argument("--turbulence", type=finite_number, default=0.05, metavar="SHARE", help="intensity [0.05]")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly and print; exit code 1 if a point outside was accepted, or the net was touched in calm."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})
    from sitl.enclosure.arena_files import load_arena  # noqa: PLC0415 - --help must not load the compiler
    from sitl.lab.studies.arena_flights import containment  # noqa: PLC0415

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
