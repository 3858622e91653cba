"""A scenario is data: how the vehicle starts, what it is asked when, and what the figures are.

The runner flies the same vehicle as the live process, tick for tick; only nobody waits for the clock.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from sitl.airframe import load
from sitl.autopilot.guidance import Route, Setpoint, Vector
from sitl.errors import SitlError
from sitl.hybrid.supervisor import JumpRecord, Law
from sitl.model.airframe import Airframe, Array
from sitl.laws import hover_zero_moment
from sitl.laws.path import LEG
from sitl.memory_layout import LAW
from sitl.vehicle import TICK, DivergedError, Start, Tuning, Vehicle

ALOFT = 100.0  # the report has no ground: its origin is flown this high above ours [m]
SAMPLE = 10  # control ticks between recorded samples: 20 ms


class Ask(NamedTuple):
    """A change at a time: a new target, upright or on the wing, or another wind."""

    time: float  # [s]
    target: Vector | None = None  # world NWU [m]
    wind: Vector | None = None  # velocity of the air, world NWU [m/s]
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
    vehicle = Vehicle(parameters, seed=seed, start=start, tuning=scenario.tuning)
    vehicle.warm_up()
    vehicle.begin_flight(scenario.law)
    recorder = Recorder()
    began = time.perf_counter()
    asks = sorted(scenario.asks)
    setpoint = Setpoint((0.0, 0.0, ALOFT), scenario.start.heading, scenario.speed)
    for step in range(round(scenario.duration / TICK / SAMPLE)):
        while asks and asks[0].time <= step * SAMPLE * TICK + 1e-9:
            ask = asks.pop(0)
            if ask.target is not None:
                setpoint = next_setpoint(setpoint, ask.target, ask.airspeed)
            if ask.wind is not None:
                vehicle.set_wind(ask.wind)
        vehicle.set_target(setpoint)
        recorder.sample(vehicle)
        try:
            vehicle.advance(SAMPLE)
        except DivergedError as error:
            if not keep_diverged:
                raise
            return recorder.track(tuple(vehicle.jumps), time.perf_counter() - began, str(error))
    return recorder.track(tuple(vehicle.jumps), time.perf_counter() - began)


def next_setpoint(last: Setpoint, target: Vector, airspeed: float | None) -> Setpoint:
    """The set-point of a target, and the leg that leads there on the wing if an airspeed is given."""
    end = (target[0], target[1], target[2] + ALOFT)
    route = None if airspeed is None else Route(LEG, last.p, end, airspeed)
    return last._replace(p=end, route=route)


class Recorder:
    """Collects the samples of a flight."""

    def __init__(self) -> None:
        self._rows: list[Array] = []

    def sample(self, vehicle: Vehicle) -> None:
        """Keep the vehicle as it is now."""
        target = vehicle.setpoint.p
        guide = vehicle.memory[LAW : LAW + hover_zero_moment.SIZE]
        tail = (vehicle.lyapunov, float(vehicle.law), *target, vehicle.energy, *guide)
        row = np.concatenate(((vehicle.time,), vehicle.plant[:17], tail))
        row[3] -= ALOFT
        row[22] -= ALOFT
        self._rows.append(row)

    def track(self, jumps: tuple[JumpRecord, ...], wall: float, diverged: str = "") -> Track:
        """All samples as one record.

        Raises:
            SitlError: If nothing was flown.
        """
        if not self._rows:
            raise SitlError("the scenario has no duration: nothing was flown")
        rows = np.array(self._rows)
        return Track(
            time=rows[:, 0], p=rows[:, 1:4], v=rows[:, 4:7], q=rows[:, 7:11], actuator=rows[:, 14:18],
            lyapunov=rows[:, 18], law=rows[:, 19], target=rows[:, 20:23], energy=rows[:, 23],
            guide=rows[:, 24:29], jumps=jumps, wall=wall, diverged=diverged,
        )  # fmt: skip
