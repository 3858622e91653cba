"""Landings in wind and gusts: the campaigns of two kinds, and hours in which no contact may be felt."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from sitl import (
    Aircraft,
    Configuration,
    DivergedError,
    Law,
    Reason,
    Settings,
    SitlError,
    Start,
    WorldSettings,
)
from sitl.lab.studies.seeded_flights import (
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    print_progress,
    seeds,
    write_json,
)
from sitl.lab.studies.spec_studies import GREATEST_WIND, GUST_OPTION, WINDS_OPTION, fly_study
from sitl.lab.study_options import AIR, ASKED, DEFAULT_FLIGHTS, DEFAULT_GUSTS, DEFAULT_WINDS, HOVER, LANDING_HEIGHT

# Holds, legs and descents broken off, for hours in wind and gusts: whether the air is ever taken for the ground.

MIN_LANDING_HEIGHT = 0.5  # where a landing may begin [m]
LONG_FLIGHT_TIME = 600.0  # one flight, unless it ends before [s]
ORDER_TIME = 30.0  # between two orders [s]
DESCENT_TIME = 8.0  # a descent is broken off after so long [s]
LOWEST_SENT, HIGHEST_SENT = 25.0, 80.0  # where it is sent [m]
FARTHEST = 150.0  # from home, in north and in west [m]
AIR_SAMPLE_TIME, AIR_SAMPLE_PERIODS = 1.0, 500


class LongFlight(NamedTuple):
    """Result of one long flight."""

    seed: int
    wind: float  # [m/s]
    gusts: float  # rms per axis [m/s]
    flown: float  # [s]
    lowest: float  # [m]
    false_contact: str  # where a touch-down was seen in the air; empty if none was
    crashed: bool  # hit the ground without one


def fly_in_air(seed: int, craft: Craft, wind: float, gusts: float) -> LongFlight:
    """Fly one: every half minute it holds, goes elsewhere, or begins a landing that is broken off.

    Args:
        seed: Of orders, wind, gusts and sensors.
        craft: What is flown.
        wind: Greatest steady wind [m/s].
        gusts: Greatest gusts, rms per axis [m/s].
    """
    random = np.random.default_rng((seed, 32))
    speed, wind_from, rms = float(random.uniform(0.0, wind)), float(random.uniform(-180.0, 180.0)), gusts
    rms *= float(random.uniform(0.0, 1.0))
    vehicle = craft.fly(seed, Start(up=0.5 * (LOWEST_SENT + HIGHEST_SENT), airborne=True))
    air = WorldSettings(speed, wind_from, rms, battery=1e9)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)
    lowest, since, descends = math.inf, 0.0, False
    try:
        while vehicle.time < LONG_FLIGHT_TIME and vehicle.law is not Law.LANDED and vehicle.crash is None:
            if descends and since >= DESCENT_TIME:
                aircraft.autopilot.guided.hold()
                descends = False
            if since >= ORDER_TIME:
                since, descends = 0.0, _order(aircraft, random)
            aircraft.advance(AIR_SAMPLE_PERIODS)
            since += AIR_SAMPLE_TIME
            lowest = min(lowest, vehicle.truth.body.position.z)
    except DivergedError:
        return LongFlight(seed, speed, rms, vehicle.time, lowest, "", crashed=True)
    return LongFlight(seed, speed, rms, vehicle.time, lowest, _false_contact(aircraft), vehicle.crash is not None)


def _order(aircraft: Aircraft, random: np.random.Generator) -> bool:
    """Give the next order; tells whether it is a descent."""
    guided, kind = aircraft.autopilot.guided, float(random.uniform())
    north, west = (float(x) for x in random.uniform(-FARTHEST, FARTHEST, 2))
    height = float(random.uniform(LOWEST_SENT, HIGHEST_SENT))
    if kind < 0.25 and aircraft.view().p[2] > LOWEST_SENT:
        guided.land()
        return True
    if kind < 0.5:
        guided.hold()
    else:
        guided.go_to((north, west, height))
    return False


def _false_contact(aircraft: Aircraft) -> str:
    """Law, time and height of the first touch-down seen in the air; empty if none was."""
    vehicle = aircraft.vehicle
    for jump in vehicle.jumps:
        if jump.reason is Reason.TOUCHDOWN:
            return f"{jump.source.name} after {jump.time:.0f} s, {vehicle.truth.body.position.z:.0f} m up"
    return ""


def air_passed(results: Sequence[LongFlight]) -> bool:
    """Whether the air was never taken for the ground."""
    return not any(result.false_contact for result in results)


def air_summary(results: Sequence[LongFlight]) -> list[str]:
    """Hours flown and false touch-downs by wind, and each flight that ended before its time, as lines of text."""
    hours = sum(result.flown for result in results) / 3600.0
    false = sum(bool(result.false_contact) for result in results)
    lines = [
        f"{len(results)} flights, seeds {results[0].seed} to {results[-1].seed}: "
        f"{hours:.1f} h in the air, {false} false touch-downs"
    ]
    for least in range(0, 12, 4):
        group = [r for r in results if least <= r.wind < least + 4 or (least == 8 and r.wind >= 12)]
        if group:
            ends = sum(bool(r.false_contact) for r in group), sum(r.crashed for r in group)
            lines.append(
                f"wind from {least} m/s on: {sum(r.flown for r in group) / 3600.0:.1f} h, {ends[0]} false touch-downs, "
                f"{ends[1]} crashed"
            )
    return lines + [
        f"seed {r.seed}: wind {r.wind:.1f} m/s, gusts {r.gusts:.1f} m/s: "
        + (f"touch-down in {r.false_contact}" if r.false_contact else f"crashed after {r.flown:.0f} s")
        for r in results
        if r.false_contact or r.crashed
    ]


MAX_SLOPE, MAX_GROUND = 30.0, 500.0  # [deg], [m]


def study_landings(args: argparse.Namespace) -> int:
    """Fly and print figures; exit code 1 if a flight ends as none of its kind may."""
    for name, defaults in (("flights", DEFAULT_FLIGHTS), ("wind", DEFAULT_WINDS), ("gusts", DEFAULT_GUSTS)):
        if getattr(args, name) is None:
            setattr(args, name, defaults[args.kind])
    check_seeded(args, {"wind": 30.0, "gusts": 10.0, "slope": MAX_SLOPE})
    _check_ground(args)
    if args.kind == AIR:
        return _study_air(args)
    if args.kind == ASKED:
        asked = (GUST_OPTION._replace(place="derived.gusts"), WINDS_OPTION._replace(place="derived.greatest_wind"))
        return fly_study(args, "returns", asked, {"derived.slope": args.slope, "derived.ground_height": args.ground})
    changes = {
        "parameters.SIM_GND_SLOPE": args.slope,
        "parameters.SIM_GND_ALT": args.ground,
        "start.up": args.height + args.ground,
    }
    return fly_study(args, "landings", (GREATEST_WIND, GUST_OPTION), changes)


def _study_air(args: argparse.Namespace) -> int:
    flight = partial(fly_in_air, craft=craft_of(args), wind=args.wind, gusts=args.gusts)
    progress = partial(print_progress, of=args.flights)
    flown = fly_draws(flight, seeds(args.flights, args.first), args.jobs, on_progress=progress)
    print("\n".join(air_summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [result._asdict() for result in flown])
    return 0 if air_passed(flown) else 1


def _check_ground(args: argparse.Namespace) -> None:
    """Refuse ground that no flight of the kind has."""
    if args.kind == AIR and (args.slope or args.ground):
        raise SitlError(f"--slope and --ground: flights of --kind {AIR} do not come to the ground")
    if args.kind != HOVER and args.height != LANDING_HEIGHT:
        raise SitlError(f"--height: only landings of --kind {HOVER} begin at a height of one's choice")
    if not MIN_LANDING_HEIGHT <= args.height <= MAX_GROUND:
        raise SitlError(f"--height {args.height:g} is not within {MIN_LANDING_HEIGHT:g} and {MAX_GROUND:g} m")
    if abs(args.ground) > MAX_GROUND:
        raise SitlError(f"--ground {args.ground:g} is not within -{MAX_GROUND:g} and {MAX_GROUND:g} m")
