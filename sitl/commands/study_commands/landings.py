"""Landings in wind and gusts, and how they end; returns asked for on the way; hours in the air without a touch-down."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from typing import TYPE_CHECKING

from protocol.tools.option_values import finite_number
from sitl.commands.study_commands.seeded_options import (
    check_seeded,
    craft_of,
    print_progress,
    seeded_parser,
    write_json,
)
from sitl.errors import SitlError

if TYPE_CHECKING:
    from sitl.lab.studies.landings import Landing

MIN_UPRIGHT = 0.98  # share of the landings
MAX_SLOPE, MAX_GROUND = 30.0, 500.0  # [deg], [m]
HOVER, ASKED, AIR = "hover", "asked", "air"
DEFAULT_FLIGHTS = {HOVER: 100, ASKED: 500, AIR: 300}
DEFAULT_WINDS = {HOVER: 5.0, ASKED: 5.0, AIR: 12.0}  # [m/s]
DEFAULT_GUSTS = {HOVER: 0.5, ASKED: 1.0, AIR: 2.0}  # [m/s]
KINDS = (
    f"{HOVER}: landings from a hover; {ASKED}: RTL and LAND asked for anywhere on the way past home; "
    f"{AIR}: ten minutes of holds, legs and broken-off descents each, with no touch-down"
)


def parser(commands: Mapping[str, str]) -> argparse.ArgumentParser:
    """The command line of ``darko-sitl study landings``."""
    flights, winds, gusts = (
        "/".join(f"{value:g}" for value in by.values()) for by in (DEFAULT_FLIGHTS, DEFAULT_WINDS, DEFAULT_GUSTS)
    )
    options = seeded_parser("landings", commands["landings"], None, f"how many flights [{flights}]")
    options.add_argument("--kind", choices=(HOVER, ASKED, AIR), default=HOVER, help=f"{KINDS} [{HOVER}]")
    options.add_argument("--wind", type=finite_number, metavar="M/S", help=f"maximum steady wind [{winds}]")
    options.add_argument("--gusts", type=finite_number, metavar="RMS", help=f"gusts per axis, m/s rms [{gusts}]")
    options.add_argument("--slope", type=finite_number, default=0.0, metavar="DEG", help="slope of the ground [0]")
    options.add_argument("--ground", type=finite_number, default=0.0, metavar="M", help="its height above home [0]")
    return options


def run(args: argparse.Namespace) -> int:
    """Fly and print figures; exit code 1 if a flight ends as none of its kind may."""
    for name, defaults in (("flights", DEFAULT_FLIGHTS), ("wind", DEFAULT_WINDS), ("gusts", DEFAULT_GUSTS)):
        if getattr(args, name) is None:
            setattr(args, name, defaults[args.kind])
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "slope": MAX_SLOPE})
    _check_ground(args)
    from sitl.lab.studies import landings  # noqa: PLC0415 - --help must not load the compiler
    from sitl.lab.studies.ground_contact import asked_landings, false_contacts  # noqa: PLC0415
    from sitl.lab.studies.seeded_flights import fly_draws, seeds  # noqa: PLC0415

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
    from sitl.lab.studies.landings import MAX_BOUNCE, LandingEnd, count  # noqa: PLC0415

    steady = all(result.bounce <= MAX_BOUNCE for result in results)
    return steady and count(results, LandingEnd.UPRIGHT) >= MIN_UPRIGHT * len(results)
