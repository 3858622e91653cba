"""Falls of the whole vehicle: under its autopilot, holding over home, thrown into any attitude; calm or in wind."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from sitl import Aircraft, Body, Configuration, Regime, Settings, Start, Vector, WorldSettings
from sitl.lab.studies.campaign import UNCERTAIN, perturbed
from sitl.lab.studies.craft import Craft
from sitl.lab.studies.falls.falls import Throw, thrown
from sitl.lab.studies.mission_flight import PERIODS_PER_LOOK, STUDY_WORLD
from sitl.lab.studies.seeded_flights import fly_draws, seeds

THROW_HEIGHT = 120.0  # [m]
HOLD_PERIODS = 2000  # control periods before the throw: the wind is known then
SINKS = (5.0, 20.0)  # least and greatest [m/s]
FALL_WIND, FALL_GUSTS = 5.0, 1.0  # steady, and rms per axis [m/s]
FALL_SPREAD = 0.1  # greatest relative error of the airframe's constants in wind
CALM_RADIUS, WINDY_RADIUS = 1.0, 5.0  # nearer than this to where it held is home [m]
HOME_SPEED = 2.0  # [m/s]
HOME_LOOKS = 50  # so long [looks]
MAX_RETURN_TIME = 120.0  # [s]
FALLS_PER_TASK = 8  # handed to a worker process at once


class FallEnd(StrEnum):
    """End of a fall."""

    CRASHED = "crashed"
    HOME = "home"
    LATE = "late"


class AircraftFall(NamedTuple):
    """Result of one fall."""

    seed: int
    velocity: Vector  # it was thrown at, world NWU [m/s]
    end: FallEnd
    lost: float  # height [m]
    time: float  # until the end [s]
    away: float  # from where it held, in the end [m]
    jumps: tuple[str, ...]


def drawn_velocity(random: np.random.Generator) -> Vector:
    """Downwards at any of the sink rates; one in eight 12 m/s level and 8 m/s down, one in eight 18 m/s level."""
    azimuth, kind, sink = random.uniform(0.0, math.tau), int(random.integers(8)), random.uniform(*SINKS)
    c, s = math.cos(azimuth), math.sin(azimuth)
    if kind == 0:
        return Vector(12.0 * c, 12.0 * s, -8.0)
    if kind == 1:
        return Vector(18.0 * c, 18.0 * s, 0.0)
    return Vector(0.0, 0.0, -float(sink))


def fly(seed: int, craft: Craft, *, windy: bool) -> AircraftFall:
    """Fly one draw.

    Args:
        seed: Of everything.
        craft: What falls; in wind it differs from its design model.
        windy: In wind and gusts, the constants of the vehicle off by up to FALL_SPREAD.
    """
    random = np.random.default_rng(seed)
    throw, velocity = thrown(random), drawn_velocity(random)
    aircraft = _hovering(seed, craft, random, windy=windy)
    aircraft.advance(HOLD_PERIODS)
    return _followed(aircraft, seed, throw, velocity, WINDY_RADIUS if windy else CALM_RADIUS)


def _hovering(seed: int, craft: Craft, random: np.random.Generator, *, windy: bool) -> Aircraft:
    airframe, air = craft.model, WorldSettings(battery=1e6)
    if windy:
        scale = {name: 1.0 + FALL_SPREAD * float(random.uniform(-1.0, 1.0)) for name in UNCERTAIN}
        airframe = perturbed(airframe, scale)
        air = WorldSettings(FALL_WIND, float(random.uniform(-180.0, 180.0)), FALL_GUSTS, battery=1e6)
    vehicle = craft.fly(seed, Start(up=THROW_HEIGHT, airborne=True), airframe)
    return Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)


def _followed(aircraft: Aircraft, seed: int, throw: Throw, velocity: Vector, radius: float) -> AircraftFall:
    vehicle = aircraft.vehicle
    here, began, before = vehicle.truth.body.position, vehicle.time, len(vehicle.jumps)
    vehicle.place(Body(here, velocity, throw.attitude, throw.rates))
    lowest, settled, end = here.z, 0, FallEnd.LATE
    while end is FallEnd.LATE and vehicle.time - began < MAX_RETURN_TIME:
        aircraft.advance(PERIODS_PER_LOOK)
        body = vehicle.truth.body
        lowest = min(lowest, body.position.z)
        near = math.dist(body.position, (0.0, 0.0, THROW_HEIGHT)) < radius and math.hypot(*body.velocity) < HOME_SPEED
        settled = settled + 1 if near else 0
        if vehicle.law.regime is Regime.GROUND:
            end = FallEnd.CRASHED
        elif settled >= HOME_LOOKS:
            end = FallEnd.HOME
    return AircraftFall(
        seed=seed,
        velocity=velocity,
        end=end,
        lost=here.z - lowest,
        time=vehicle.time - began,
        away=math.dist(vehicle.truth.body.position, (0.0, 0.0, THROW_HEIGHT)),
        jumps=tuple(jump.name for jump in vehicle.jumps[before:]),
    )


def run(flights: int, first: int, craft: Craft, *, windy: bool, jobs: int = 1) -> list[AircraftFall]:
    """Fly seeds ``first`` to ``first + flights - 1``; their order and results do not depend on the jobs.

    Raises:
        SitlError: If there is nothing to fly, or no such seed.
    """
    return fly_draws(partial(fly, craft=craft, windy=windy), seeds(flights, first), jobs, FALLS_PER_TASK)


def count(results: Sequence[AircraftFall], end: FallEnd) -> int:
    """Number of falls that ended so."""
    return sum(result.end is end for result in results)


def summary(results: Sequence[AircraftFall]) -> list[str]:
    """Ends of the falls, and each that did not end at home, as lines of text."""
    lost, time = ([getattr(result, name) for result in results] for name in ("lost", "time"))
    figures = [" / ".join(f"{np.quantile(values, share):.1f}" for share in (0.5, 0.95, 1.0)) for values in (lost, time)]
    lines = [
        f"{len(results)} falls from {THROW_HEIGHT:g} m, seeds {results[0].seed} to {results[-1].seed}: "
        f"{count(results, FallEnd.CRASHED)} crashed, {count(results, FallEnd.HOME)} home within {MAX_RETURN_TIME:g} s",
        f"height lost, median / 95 % / worst: {figures[0]} m; until home: {figures[1]} s",
    ]
    return lines + [
        f"{r.end}: seed {r.seed}: thrown at ({r.velocity.x:.1f}, {r.velocity.y:.1f}, {r.velocity.z:.1f}) m/s, "
        f"{r.lost:.0f} m lost, {r.away:.0f} m away after {r.time:.0f} s ({', '.join(r.jumps)})"
        for r in results
        if r.end is not FallEnd.HOME
    ]
