"""Injected failures, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    seeded_parser,
    write_json,
)
from sitl.errors import SitlError


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl failures``."""
    options = seeded_parser("failures", commands["failures"], 2, "flights with each failure in each phase")
    options.add_argument("--units", nargs="+", default=[], metavar="UNIT", help="such as gyroscope, motor [all]")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly them and print how they ended."""
    check_seeded(args, {})
    if args.nav != "sensors":
        raise SitlError(f"--nav {args.nav}: failures are flown on satellites, where all instruments are aboard")
    from sitl.studies import failure_flights as study  # noqa: PLC0415 - --help must not load the compiler

    for unit in args.units:
        if unit not in study.FAILING_UNITS:
            raise SitlError(f"--units {unit}: there are {', '.join(study.FAILING_UNITS)}")
    seeds = range(args.first, args.first + args.flights)
    draws = study.draws(seeds, args.units or list(study.FAILING_UNITS))
    flown = study.run_failures(
        draws, craft_of(args), args.jobs, on_progress=lambda done: print_progress(done, len(draws))
    )
    print("\n".join(study.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [flight._asdict() for flight in flown])
    return 0
