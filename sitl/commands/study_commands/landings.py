"""Landings in wind and gusts, and how they end; returns asked for on the way; hours in the air without a touch-down."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial

from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    write_json,
)
from sitl.commands.study_options import AIR, ASKED, DEFAULT_FLIGHTS, DEFAULT_GUSTS, DEFAULT_WINDS
from sitl.errors import SitlError
from sitl.lab.studies import landings
from sitl.lab.studies.ground_contact import asked_landings, false_contacts
from sitl.lab.studies.landings import MAX_BOUNCE, Landing, LandingEnd, count
from sitl.lab.studies.seeded_flights import fly_draws, seeds

MIN_UPRIGHT = 0.98  # share of the landings
MAX_SLOPE, MAX_GROUND = 30.0, 500.0  # [deg], [m]


def run(args: argparse.Namespace) -> int:
    """Fly and print figures; exit code 1 if a flight ends as none of its kind may."""
    for name, defaults in (("flights", DEFAULT_FLIGHTS), ("wind", DEFAULT_WINDS), ("gusts", DEFAULT_GUSTS)):
        if getattr(args, name) is None:
            setattr(args, name, defaults[args.kind])
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "slope": MAX_SLOPE})
    _check_ground(args)

    craft, progress = craft_of(args), partial(print_progress, of=args.flights)
    ground = {"slope": args.slope, "ground": args.ground}
    air = {"craft": craft, "wind": args.wind, "gusts": args.gusts}
    drawn = seeds(args.flights, args.first)
    if args.kind == ASKED:
        fly = partial(asked_landings.fly, **air, **ground)
        asked = fly_draws(fly, drawn, args.jobs, asked_landings.ASKED_PER_TASK, progress)
        lines, good = asked_landings.summary(asked), asked_landings.passed(asked)
        written = [{**result._asdict(), "good": result.is_good} for result in asked]
    elif args.kind == AIR:
        flown = fly_draws(partial(false_contacts.fly, **air), drawn, args.jobs, on_progress=progress)
        lines, good = false_contacts.summary(flown), false_contacts.passed(flown)
        written = [result._asdict() for result in flown]
    else:
        results = landings.run(args.flights, args.first, craft, args.wind, args.gusts, args.jobs, **ground)
        lines, good = landings.summary(results), passed(results)
        written = [landing._asdict() for landing in results]
    print("\n".join(lines), flush=True)
    if args.json is not None:
        write_json(args.json, written)
    return 0 if good else 1


def _check_ground(args: argparse.Namespace) -> None:
    """Refuse ground that no flight of the kind has."""
    if args.kind == AIR and (args.slope or args.ground):
        raise SitlError(f"--slope and --ground: flights of --kind {AIR} do not come to the ground")
    if abs(args.ground) > MAX_GROUND:
        raise SitlError(f"--ground {args.ground:g} is not within -{MAX_GROUND:g} and {MAX_GROUND:g} m")


def passed(results: Sequence[Landing]) -> bool:
    """Whether enough landings end upright and none bounces for long."""
    steady = all(result.bounce <= MAX_BOUNCE for result in results)
    return steady and count(results, LandingEnd.UPRIGHT) >= MIN_UPRIGHT * len(results)
