"""A scenario is data: how the vehicle starts, what it is asked when, and what the figures are.

The runner flies the same vehicle as the live process, tick for tick; only nobody waits for the clock.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.airframe import load
from sitl.control.reference import Point, Reference, along, at, hover_at, leg
from sitl.errors import SitlError
from sitl.model.airframe import Airframe, Array
from sitl.simulation.recording import JumpRecord, Recording
from sitl.simulation.simulation import DivergedError, Simulation, Start, Tuning

ALOFT = 100.0  # the report has no ground: its origin is flown this high above ours [m]
RATE = 50.0  # recorded samples a second


class Ask(NamedTuple):
    """A change at a time: a new target, upright or on the wing, or another wind."""

    time: float  # [s]
    target: Point | None = None  # world NWU [m]
    wind: Point | None = None  # velocity of the air, world NWU [m/s]
    airspeed: float | None = None  # of a leg on the wing from the target before; None: upright [m/s]


class Figure(NamedTuple):
    """One number a scenario reports, with what the report or the design expects of it."""

    name: str
    value: float
    unit: str
    expected: str
    holds: bool


@dataclass(frozen=True)
class Track:
    """What was recorded, one row per sample."""

    time: Array  # (n,)
    p: Array  # (n, 3) world NWU [m]
    v: Array  # (n, 3) world NWU [m/s]
    q: Array  # (n, 4)
    actuator: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    lyapunov: Array  # (n,)
    law: Array  # (n,)
    target: Array  # (n, 3)
    energy: Array  # (n,) [J]
    guide: Array  # (n, 5) q_d and f [N] of the zero-moment law, stale while another law flies
    jumps: tuple[JumpRecord, ...]
    wall: float  # how long the run took [s]
    diverged: str = ""  # why the flight ended early, empty if it did not


@dataclass(frozen=True)
class Scenario:
    """One experiment."""

    name: str
    title: str
    claim: str  # what the report says of it
    start: Start
    asks: tuple[Ask, ...]
    duration: float  # [s]
    figures: Callable[[Track], list[Figure]]
    law: Law = Law.HOVER_ZERO_MOMENT  # in force at the start
    airframe: str = "nominal"
    speed: float = 3.0  # horizontal speed limit [m/s]
    tuning: Tuning = field(default_factory=Tuning)


def fly(
    scenario: Scenario, *, seed: int = 1, airframe: str | Airframe | None = None, keep_diverged: bool = False
) -> Track:
    """Fly a scenario as fast as possible.

    Args:
        scenario: What to fly.
        seed: Of the gusts.
        airframe: Parameter set, TOML file, or the parameters themselves; the scenario's own set by default.
        keep_diverged: Whether a diverged flight is a track that ends early instead of an error.

    Raises:
        SitlError: If the vehicle leaves the numbers (a diverged flight) or the airframe is unknown.
    """
    parameters = airframe if isinstance(airframe, Airframe) else load(airframe or scenario.airframe).parameters
    start = scenario.start._replace(up=scenario.start.up + ALOFT, airborne=True)
    vehicle = Simulation(parameters, seed=seed, start=start, tuning=scenario.tuning)
    vehicle.begin_flight(scenario.law)
    vehicle.warm_up()
    began = time.perf_counter()
    parts: list[Recording] = []
    reference, fault = hover_at((0.0, 0.0, ALOFT), scenario.start.heading, scenario.speed), ""
    asks = sorted(scenario.asks)
    while vehicle.time < scenario.duration - 1e-9 and not fault:
        while asks and asks[0].time <= vehicle.time + 1e-9:
            ask = asks.pop(0)
            if ask.target is not None:
                reference = next_reference(reference, ask.target, ask.airspeed)
            if ask.wind is not None:
                vehicle.set_wind(ask.wind)
        vehicle.reference = reference
        until = min(asks[0].time if asks else math.inf, scenario.duration)
        try:
            parts.append(vehicle.record(whole_samples(until - vehicle.time), RATE))
        except DivergedError as error:
            if not keep_diverged or error.recording is None:
                raise
            parts.append(error.recording)
            fault = str(error)
    return joined(parts, tuple(vehicle.jumps), time.perf_counter() - began, fault)


def whole_samples(seconds: float) -> float:
    """A time rounded up to whole samples [s]."""
    return math.ceil(round(seconds * RATE, 6)) / RATE


def next_reference(last: Reference, target: Point, airspeed: float | None) -> Reference:
    """The reference of a target, with the leg that leads there if an airspeed is given."""
    end = (target[0], target[1], target[2] + ALOFT)
    if airspeed is None:
        return at(last, end)
    return along(last, leg(last.position, end, airspeed), last.heading)


def joined(parts: list[Recording], jumps: tuple[JumpRecord, ...], wall: float, diverged: str = "") -> Track:
    """Recordings, one after the other, as one track about the report's origin.

    Raises:
        SitlError: If nothing was flown.
    """
    if not parts:
        raise SitlError("the scenario has no duration: nothing was flown")

    def whole(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    lowered = np.array((0.0, 0.0, ALOFT))
    return Track(
        time=whole("time"),
        p=whole("position") - lowered,
        v=whole("velocity"),
        q=whole("attitude"),
        actuator=whole("actuators"),
        lyapunov=whole("v_hover"),
        law=whole("law"),
        target=whole("reference") - lowered,
        energy=whole("energy"),
        guide=whole("guide"),
        jumps=jumps,
        wall=wall,
        diverged=diverged,
    )
