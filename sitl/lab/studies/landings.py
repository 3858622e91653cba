"""Landings of the whole vehicle in wind and gusts: how it ends, and how long it bounces."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from sitl import Aircraft, Configuration, Regime, Settings, Start, Vector, WorldSettings
from sitl.autopilot.arming import MAX_STANDING_TILT
from sitl.lab.studies.craft import Craft
from sitl.lab.studies.mission_flight import SAMPLE_PERIODS, STUDY_WORLD
from sitl.lab.studies.seeded_flights import fly_draws, seeds
from sitl.model.ground import is_touching

LANDING_HEIGHT = 8.0  # where the landing begins [m]
HOLD_BEFORE = 3000  # control periods before it: the wind is known then
STAND_AFTER = 1500  # control periods after it, in which it may still fall over
MAX_LANDING_TIME = 90.0  # [s]
MAX_BOUNCE = 3.0  # [s]
LANDINGS_PER_TASK = 4  # handed to a worker process at once


class LandingEnd(StrEnum):
    """End of a landing."""

    UPRIGHT = "upright"
    TIPPED = "tipped over"
    CRASHED = "crashed"
    LATE = "late"


class Landing(NamedTuple):
    """Result of one landing."""

    seed: int
    wind: float  # steady [m/s]
    heading: float  # of the belly, from where the wind comes [rad]
    end: LandingEnd
    bounce: float  # from the first touch to rest [s]
    sink: float  # at the first touch [m/s]
    slide: float  # level speed then [m/s]
    away: float  # from where the landing began [m]
    time: float  # [s]


def fly(seed: int, craft: Craft, wind: float, gusts: float, slope: float = 0.0, ground: float = 0.0) -> Landing:
    """Fly one landing.

    Args:
        seed: Of wind, heading, where the ground rises, gusts and sensors.
        craft: What is flown.
        wind: Greatest steady wind [m/s].
        gusts: Rms per axis [m/s].
        slope: Of the ground [deg].
        ground: Its height above home, at home [m].
    """
    random = np.random.default_rng(seed)
    speed, wind_from, heading = (
        float(random.uniform(*limits)) for limits in ((0.0, wind), (-180.0, 180.0), (-math.pi, math.pi))
    )
    start = Start(up=LANDING_HEIGHT + ground, heading=heading, airborne=True)
    vehicle = craft.fly(seed, start)
    world = on_drawn_ground(WorldSettings(speed, wind_from, gusts, battery=1e6), seed, slope, ground)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, world), airborne=True)
    aircraft.advance(HOLD_BEFORE)
    here, began = vehicle.truth.body.position, vehicle.time
    aircraft.autopilot.guided.land()
    touched, motion = math.inf, Vector(0.0, 0.0, 0.0)
    while vehicle.law.regime is not Regime.GROUND and vehicle.time - began < MAX_LANDING_TIME:
        before = vehicle.truth.body.velocity
        aircraft.advance(SAMPLE_PERIODS)
        touches = is_touching(vehicle.truth, vehicle.surroundings.ground, vehicle.airframe)
        if touches and math.isinf(touched):
            touched, motion = vehicle.time, before
    down = vehicle.time
    aircraft.advance(STAND_AFTER)
    return Landing(
        seed=seed,
        wind=speed,
        heading=math.remainder(heading + math.radians(wind_from), math.tau),
        end=_end(aircraft),
        bounce=max(down - touched, 0.0),
        sink=-motion.z,
        slide=math.hypot(motion.x, motion.y),
        away=math.dist(vehicle.truth.body.position[:2], here[:2]),
        time=down - began,
    )


def _end(aircraft: Aircraft) -> LandingEnd:
    view = aircraft.view()
    if view.crash is not None:
        return LandingEnd.CRASHED
    if not view.landed:
        return LandingEnd.LATE
    return LandingEnd.TIPPED if view.tilt > MAX_STANDING_TILT else LandingEnd.UPRIGHT


def on_drawn_ground(world: WorldSettings, seed: int, slope: float, height: float) -> WorldSettings:
    """A world with its ground at a slope [deg] and a height at home [m]; where it rises is drawn by the seed."""
    rises_to = float(np.random.default_rng((seed, 33)).uniform(-180.0, 180.0))
    return world._replace(ground_height=height, ground_slope=slope, ground_rises_to=rises_to)


def run(
    flights: int,
    first: int,
    craft: Craft,
    wind: float,
    gusts: float,
    jobs: int = 1,
    *,
    slope: float = 0.0,
    ground: float = 0.0,
) -> list[Landing]:
    """Fly seeds ``first`` to ``first + flights - 1``; their order and results do not depend on the jobs.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    landing = partial(fly, craft=craft, wind=wind, gusts=gusts, slope=slope, ground=ground)
    return fly_draws(landing, seeds(flights, first), jobs, LANDINGS_PER_TASK)


def count(results: Sequence[Landing], end: LandingEnd) -> int:
    """Number of landings that ended so."""
    return sum(result.end is end for result in results)


def summary(results: Sequence[Landing]) -> list[str]:
    """Ends of the landings, and each that did not end upright or bounced for long, as lines of text."""
    ends = ", ".join(f"{count(results, end)} {end}" for end in LandingEnd)
    lines = [
        f"{len(results)} landings from {LANDING_HEIGHT:g} m, seeds {results[0].seed} to {results[-1].seed}: {ends}"
    ]
    lines.append(f"{'':<32}{'median':>9}{'p95':>9}{'max':>9}")
    for name, field in (
        ("first touch to rest [s]", "bounce"),
        ("sink at the touch [m/s]", "sink"),
        ("level speed at the touch [m/s]", "slide"),
        ("from where it began [m]", "away"),
        ("time [s]", "time"),
    ):
        values = [getattr(result, field) for result in results]
        lines.append(f"{name:<32}" + "".join(f"{np.quantile(values, share):9.2f}" for share in (0.5, 0.95, 1.0)))
    return lines + [
        f"{r.end}: seed {r.seed}: wind {r.wind:.1f} m/s, belly {math.degrees(r.heading):.0f} deg from it, touched at "
        f"{r.sink:.2f} m/s down and {r.slide:.2f} m/s level, {r.bounce:.1f} s to rest"
        for r in results
        if r.end is not LandingEnd.UPRIGHT or r.bounce > MAX_BOUNCE
    ]
