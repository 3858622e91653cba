"""A scenario is data: how the vehicle starts, which targets and winds come when, and which numbers are expected.

Flown as fast as possible here and live in :mod:`sitl.lab.scenarios.live_scenario`: the same flight, sample for sample.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from sitl import (
    Airframe,
    Array,
    DivergedError,
    JumpRecord,
    Law,
    Recording,
    Reference,
    Simulation,
    SitlError,
    Start,
    Tuning,
    Vector,
    along,
    at,
    hover_at,
    leg,
    load_airframe,
)
from sitl.control.reference import Point
from sitl.enclosure.arena_files import WindWall
from sitl.simulation.tuning import REPORT_GAIN

ORIGIN_HEIGHT = 100.0  # the report has no ground: its origin is flown this high above ours [m]
RATE = 50.0  # recorded samples a second


class ScenarioEvent(NamedTuple):
    """A change at a time: a new target, or another wind."""

    time: float  # [s]
    target: Point | None = None  # world NWU, relative to the report's origin [m]
    wind: Point | None = None  # velocity of the air, world NWU [m/s]
    airspeed: float | None = None  # of a leg flown forward from the target before; None: hovered [m/s]


class Finding(NamedTuple):
    """One number found in a flight, with the expectation of the report or the design."""

    name: str
    value: float
    unit: str
    expected: str  # in words; empty if nothing is expected
    holds: bool  # whether the value is as expected


@dataclass(frozen=True)
class Track:
    """A recorded flight, one row per sample; positions relative to the report's origin."""

    time: Array  # (n,)
    p: Array  # (n, 3) world NWU [m]
    v: Array  # (n, 3) world NWU [m/s]
    q: Array  # (n, 4)
    actuator: Array  # (n, 4) w1, w2 [rad/s], d1, d2 [rad]
    v_hover: Array  # (n,)
    law: Array  # (n,)
    target: Array  # (n, 3)
    energy: Array  # (n,) [J]
    pointing: Array  # (n, 5) q_d and f [N] of the zero-moment law, out of date while another law flies
    jumps: tuple[JumpRecord, ...]
    wall_time: float  # how long the run took [s]
    diverged: str = ""  # why the flight ended early, empty if it did not

    @property
    def crashed(self) -> bool:
        """Whether it hit the ground too fast."""
        return any(jump.target is Law.CRASHED for jump in self.jumps)


# What the report flies: Q = R = I, and both forward laws.
AS_REPORTED = Tuning(design=REPORT_GAIN, v_enter=20.0, v_leave=50.0, forward_linear=1)


@dataclass(frozen=True)
class Scenario:
    """One experiment."""

    name: str
    title: str
    claim: str  # of the report about it
    start: Start  # relative to the report's origin
    events: tuple[ScenarioEvent, ...]
    duration: float  # [s]
    findings: Callable[[Track], list[Finding]]
    law: Law = Law.HOVER_ZERO_MOMENT  # in force at the start
    airframe: str = "nominal"
    speed: float = 3.0  # horizontal speed limit [m/s]
    tuning: Tuning = AS_REPORTED
    wall: WindWall | None = None  # relative to the report's origin

    def start_in_air(self) -> Start:
        """The start above our ground."""
        return self.start._replace(up=self.start.up + ORIGIN_HEIGHT, airborne=True)

    def put_wall(self, vehicle: Simulation) -> None:
        """Have the scenario's wind wall blow, if it has one."""
        if self.wall is not None:
            outlet = self.wall.outlet
            raised = Vector(outlet.centre.x, outlet.centre.y, outlet.centre.z + ORIGIN_HEIGHT)
            vehicle.surroundings.put_wall(self.wall._replace(outlet=outlet._replace(centre=raised)))

    def first_reference(self) -> Reference:
        """A hover at the origin, in force until the first target."""
        return hover_at((0.0, 0.0, ORIGIN_HEIGHT), self.start.heading, self.speed)


def fly(
    scenario: Scenario, *, seed: int = 1, airframe: str | Airframe | None = None, keep_diverged: bool = False
) -> Track:
    """Fly a scenario as fast as possible.

    Args:
        scenario: What to fly.
        seed: Of the gusts.
        airframe: Parameter set, TOML file, or the parameters themselves; by default the scenario's own set.
        keep_diverged: Whether to return the track of a diverged flight, which ends early, instead of raising.

    Raises:
        DivergedError: If the state of the vehicle stops being finite.
        SitlError: If the airframe is unknown or the scenario has no duration.
    """
    parameters = airframe if isinstance(airframe, Airframe) else load_airframe(airframe or scenario.airframe).parameters
    vehicle = Simulation(parameters, seed=seed, start=scenario.start_in_air(), tuning=scenario.tuning)
    vehicle.begin_flight(scenario.law)
    scenario.put_wall(vehicle)
    vehicle.warm_up()
    began = time.perf_counter()
    parts: list[Recording] = []
    reference, fault = scenario.first_reference(), ""
    events = sorted(scenario.events)
    while vehicle.time < scenario.duration - 1e-9 and not fault:
        while events and events[0].time <= vehicle.time + 1e-9:
            event = events.pop(0)
            if event.target is not None:
                reference = next_reference(reference, event.target, event.airspeed)
            if event.wind is not None:
                vehicle.set_wind(event.wind)
        vehicle.reference = reference
        until = min(events[0].time if events else math.inf, scenario.duration)
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
    """The reference of a new target.

    Args:
        last: The reference before.
        target: World NWU, relative to the report's origin [m].
        airspeed: Of a leg that is flown forward from the last target [m/s]; None: hover there.
    """
    end = (target[0], target[1], target[2] + ORIGIN_HEIGHT)
    if airspeed is None:
        return at(last, end)
    return along(last, leg(last.position, end, airspeed), last.heading)


def joined(parts: list[Recording], jumps: tuple[JumpRecord, ...], wall_time: float, diverged: str = "") -> Track:
    """Consecutive recordings as one track relative to the report's origin.

    Args:
        parts: The recordings in order.
        jumps: Of the whole flight.
        wall_time: How long the run took [s].
        diverged: Why it ended early; empty if it did not.

    Raises:
        SitlError: If there is no recording.
    """
    if not parts:
        raise SitlError("the scenario has no duration: nothing was flown")

    def whole(name: str) -> Array:
        return np.concatenate([getattr(part, name) for part in parts])

    origin = np.array((0.0, 0.0, ORIGIN_HEIGHT))
    return Track(
        time=whole("time"),
        p=whole("position") - origin,
        v=whole("velocity"),
        q=whole("attitude"),
        actuator=whole("actuators"),
        v_hover=whole("v_hover"),
        law=whole("law"),
        target=whole("reference") - origin,
        energy=whole("energy"),
        pointing=whole("pointing"),
        jumps=jumps,
        wall_time=wall_time,
        diverged=diverged,
    )


def as_text(scenario: Scenario, track: Track, findings: list[Finding]) -> str:
    """A flight's findings with their verdicts, its jumps, and how fast it ran."""
    lines = [f"{scenario.name}: {scenario.title}", f"  {scenario.claim}"]
    for finding in findings:
        verdict = "" if not finding.expected else f"   [{'ok' if finding.holds else 'MISSED'}: {finding.expected}]"
        lines.append(f"  {finding.name:<32}{finding.value:10.3f} {finding.unit:<6}{verdict}")
    lines += [
        f"  jump {jump.number} at {jump.time:.2f} s: {jump.source.name} -> {jump.target.name} ({jump.name})"
        for jump in track.jumps
    ]
    lines += ["  CRASHED"] if track.crashed else []
    speed = scenario.duration / track.wall_time
    lines.append(f"  {scenario.duration:.0f} s flown in {track.wall_time:.2f} s: {speed:.0f}x real time")
    return "\n".join(lines)
