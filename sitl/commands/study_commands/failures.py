"""Injected failures, from many seeds."""

from __future__ import annotations

import argparse
from collections.abc import Sequence

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.errors import SitlError
from sitl.lab.studies import failure_flights as study


def run(args: argparse.Namespace) -> int:
    """Fly them and print how they ended; 1 if one flew away."""
    check_seeded(args, {"wind": 15.0, "gusts": 3.0, "parameters": 0.3})
    if args.nav == "truth":
        raise SitlError("--nav truth: a vehicle that sees the truth has no instruments to fail")

    craft = craft_of(args)
    units = study.units_of(craft.navigation)
    units = _chosen("units", args.units, [*units, study.NO_UNIT]) if args.units else units
    phases = _chosen("phases", args.phases, [str(phase) for phase in study.FailurePhase])
    failures = _chosen("failures", args.failures, study.KNOWN_FAILURES)
    seeds = range(args.first, args.first + args.flights)
    draws = study.draws(seeds, units, [study.FailurePhase(phase) for phase in phases], failures)
    conditions = study.FailureConditions(args.wind, args.gusts, args.parameters)
    flown = study.run_failures(
        draws, craft, conditions, args.jobs, on_progress=lambda done: print_progress(done, len(draws))
    )
    print("\n".join(study.summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{**flight._asdict(), "away": flight.away} for flight in flown])
    return 1 if any(flight.away for flight in flown) else 0


def _chosen(option: str, asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """The chosen among the known names; all of them by default.

    Raises:
        SitlError: There is no such thing.
    """
    for name in asked:
        if name not in known:
            raise SitlError(f"--{option} {name}: there are {', '.join(known)}")
    return list(asked or known)
