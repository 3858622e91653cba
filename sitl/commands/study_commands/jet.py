"""Holds in a wind wall's jet, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path

from protocol.tools.option_values import finite_number
from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    seeded_parser,
    write_json,
)
from sitl.tools.plotting import check_plot_path


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study jet``."""
    options = seeded_parser("jet", commands["jet"], 5, "holds in each wind with each gust")
    options.set_defaults(nav="mocap")
    options.add_argument("--arena", default="voliere", metavar="FILE", help="shipped arena or TOML file [voliere]")
    options.add_argument(
        "--wall", type=finite_number, nargs="+", default=[0.0, 2.0, 4.0, 6.0], metavar="M/S", help="winds [0 2 4 6]"
    )
    options.add_argument(
        "--bursts", type=finite_number, nargs="+", default=[0.0, 1.0, 2.0, 3.0], metavar="M/S", help="gusts [0 1 2 3]"
    )
    options.add_argument("--turbulence", type=finite_number, default=0.05, metavar="SHARE", help="intensity [0.05]")
    options.add_argument("--plot", type=Path, metavar="FILE", help="also draw the map")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly the holds and print the map."""
    check_seeded(args, {"wall": 30.0, "bursts": 30.0, "turbulence": 1.0})
    if args.plot is not None:
        check_plot_path(args.plot)
    from sitl.enclosure.arena_files import load_arena  # noqa: PLC0415 - --help must not load the compiler
    from sitl.lab.studies.arena_flights import jet_holds  # noqa: PLC0415
    from sitl.lab.studies.arena_flights.containment import ContainmentConditions  # noqa: PLC0415

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
        from sitl.lab.studies.arena_flights.jet_holds_plot import save_jet_map  # noqa: PLC0415

        save_jet_map(flown, args.plot)
    return 0
