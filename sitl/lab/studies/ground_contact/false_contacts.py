"""Holds, legs and descents broken off, for hours in wind and gusts: whether the air is ever taken for the ground."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from sitl import Aircraft, Configuration, DivergedError, Law, Reason, Settings, Start, WorldSettings
from sitl.lab.studies.craft import Craft
from sitl.lab.studies.mission_flight import STUDY_WORLD

LONG_FLIGHT_TIME = 600.0  # one flight, unless it ends before [s]
ORDER_TIME = 30.0  # between two orders [s]
DESCENT_TIME = 8.0  # a descent is broken off after so long [s]
LOWEST_SENT, HIGHEST_SENT = 25.0, 80.0  # where it is sent [m]
FARTHEST = 150.0  # from home, in north and in west [m]
AIR_LOOK_TIME, AIR_LOOK_PERIODS = 1.0, 500


class LongFlight(NamedTuple):
    """Result of one long flight."""

    seed: int
    wind: float  # [m/s]
    gusts: float  # rms per axis [m/s]
    flown: float  # [s]
    lowest: float  # [m]
    false_contact: str  # where a touch-down was seen in the air; empty if none was
    crashed: bool  # hit the ground without one


def fly(seed: int, craft: Craft, wind: float, gusts: float) -> LongFlight:
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
            aircraft.advance(AIR_LOOK_PERIODS)
            since += AIR_LOOK_TIME
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


def passed(results: Sequence[LongFlight]) -> bool:
    """Whether the air was never taken for the ground."""
    return not any(result.false_contact for result in results)


def summary(results: Sequence[LongFlight]) -> list[str]:
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
