"""Injected failures, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence

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
    options.add_argument("--failures", nargs="+", default=[], metavar="FAILURE", help="such as wrong, stuck [all]")
    options.add_argument("--phases", nargs="+", default=[], metavar="PHASE", help="such as hover, cruise [all]")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly them and print how they ended; 1 if one flew away."""
    check_seeded(args, {})
    if args.nav == "truth":
        raise SitlError("--nav truth: a vehicle that sees the truth has no instruments to fail")
    from sitl.studies import failure_flights as study  # noqa: PLC0415 - --help must not load the compiler

    craft = craft_of(args)
    units = _chosen("units", args.units, study.units_of(craft.navigation))
    phases = _chosen("phases", args.phases, [str(phase) for phase in study.FailurePhase])
    failures = _chosen("failures", args.failures, study.KNOWN_FAILURES)
    seeds = range(args.first, args.first + args.flights)
    draws = study.draws(seeds, units, [study.FailurePhase(phase) for phase in phases], failures)
    flown = study.run_failures(draws, craft, args.jobs, on_progress=lambda done: print_progress(done, len(draws)))
    print("\n".join(study.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{**flight._asdict(), "away": flight.away} for flight in flown])
    return 1 if any(flight.away for flight in flown) else 0


def _chosen(option: str, asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """What is asked for of what there is; all of it by default.

    Raises:
        SitlError: There is no such thing.
    """
    for name in asked:
        if name not in known:
            raise SitlError(f"--{option} {name}: there are {', '.join(known)}")
    return list(asked or known)
