"""Injected failures, in hover, front transition and cruise, on sensors: what the vehicle notices, and how it ends."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from sitl import Regime, Simulation, Start
from sitl.autopilot.settings import Settings
from sitl.sensors.instruments import HEALTHY
from sitl.simulation.actuator_faults import ACTUATOR_FAILURES
from sitl.simulation.situation import regime
from sitl.studies.craft import DEFAULT_CRAFT, Craft
from sitl.studies.mission_flight import STUDY_WORLD
from sitl.studies.seeded_flights import fly_draws, ignore_progress
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.injected_failures import ACTUATOR_UNITS, BATTERY_FAILURES, FAILURE_NAMES, INSTRUMENT_UNITS
from sitl.vehicle.parameters import Configuration, WorldSettings

FAILURE_HEIGHT = 40.0  # [m]
GOAL = (1000.0, 0.0, FAILURE_HEIGHT)  # of the leg, world NWU [m]
TIME_BEFORE, CRUISE_TIME, FAILED_TIME = 5.0, 12.0, 60.0  # before the leg, on it, and with the failure [s]
LOOK_PERIODS = 50  # control periods between looks at the flight
MAX_WIND, FAILURE_GUSTS = 5.0, 0.5  # [m/s]

FAILING_UNITS = {
    "gyroscope": mavlink.FAILURE_UNIT_SENSOR_GYRO,
    "accelerometer": mavlink.FAILURE_UNIT_SENSOR_ACCEL,
    "magnetometer": mavlink.FAILURE_UNIT_SENSOR_MAG,
    "barometer": mavlink.FAILURE_UNIT_SENSOR_BARO,
    "gnss": mavlink.FAILURE_UNIT_SENSOR_GPS,
    "pitot": mavlink.FAILURE_UNIT_SENSOR_AIRSPEED,
    "motor": mavlink.FAILURE_UNIT_SYSTEM_MOTOR,
    "elevon": mavlink.FAILURE_UNIT_SYSTEM_SERVO,
    "battery": mavlink.FAILURE_UNIT_SYSTEM_BATTERY,
}
PAIRED = frozenset({"motor", "elevon"})  # of which one fails, the seed says which


class FailurePhase(StrEnum):
    """When it fails."""

    HOVER = "hover"
    TRANSITION = "transition"
    CRUISE = "cruise"


class FailureEnd(StrEnum):
    """How a flight with a failure ends."""

    FLIES = "flies"
    LANDED = "landed"
    CUT = "motors off"
    CRASHED = "crashed"


class FailureDraw(NamedTuple):
    """One flight to be flown."""

    unit: str  # of FAILING_UNITS
    failure: int  # FAILURE_TYPE
    phase: FailurePhase
    seed: int


class FailedFlight(NamedTuple):
    """How one flight went."""

    unit: str
    failure: str
    phase: FailurePhase
    seed: int
    end: FailureEnd
    noticed: float  # after so long; infinite if nothing was said [s]
    said: str  # first
    away: float  # farthest from where it hovered; 0 in other phases [m]
    astray: float  # farthest from where it believed itself [m]
    impact: float  # of a crash [m/s]
    time: float  # from the failure to its end [s]


def fly_failure(draw: FailureDraw, craft: Craft = DEFAULT_CRAFT) -> FailedFlight:
    """Fly one flight until it is on the ground, or for FAILED_TIME."""
    aircraft = _begun(draw, craft)
    vehicle = aircraft.vehicle
    aircraft.autopilot.notices()
    instance = 1 + draw.seed % 2 if draw.unit in PAIRED else 0
    aircraft.failures.inject(FAILING_UNITS[draw.unit], draw.failure, instance)
    began, here = vehicle.time, vehicle.truth.body.position
    noticed, said, away, astray = math.inf, "", 0.0, 0.0
    while vehicle.time - began < FAILED_TIME:
        aircraft.advance(LOOK_PERIODS)
        body = vehicle.truth.body
        away, astray = max(away, math.dist(body.position, here)), max(astray, _error(vehicle))
        texts = [notice.text for notice in aircraft.autopilot.notices()]
        if texts and not said:
            noticed, said = vehicle.time - began, texts[0]
        is_down = vehicle.law.regime is Regime.GROUND and body.position.z < 1.0 and math.hypot(*body.velocity) < 0.1
        if vehicle.crash is not None or is_down:
            break
    return FailedFlight(
        unit=draw.unit,
        failure=FAILURE_NAMES[draw.failure],
        phase=draw.phase,
        seed=draw.seed,
        end=_end_of(aircraft),
        noticed=noticed,
        said=said,
        away=away if draw.phase is FailurePhase.HOVER else 0.0,
        astray=astray,
        impact=vehicle.crash.speed if vehicle.crash is not None else 0.0,
        time=vehicle.time - began,
    )


def _begun(draw: FailureDraw, craft: Craft) -> Aircraft:
    """A vehicle in the phase in which it will fail."""
    random = np.random.default_rng(draw.seed)
    air = WorldSettings(
        float(random.uniform(0.0, MAX_WIND)), float(random.uniform(-180.0, 180.0)), FAILURE_GUSTS, battery=1e6
    )
    vehicle = craft.fly(draw.seed, Start(up=FAILURE_HEIGHT, airborne=True))
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(Settings(), vehicle.tuning, air), airborne=True)
    _advance_until(aircraft, TIME_BEFORE)
    if draw.phase is FailurePhase.HOVER:
        return aircraft
    aircraft.autopilot.guided.go_to(GOAL)
    in_transition = draw.phase is FailurePhase.TRANSITION
    _advance_until(aircraft, CRUISE_TIME, lambda: in_transition and regime(vehicle) is Regime.FRONT_TRANSITION)
    return aircraft


def _advance_until(aircraft: Aircraft, seconds: float, reached: Callable[[], bool] = lambda: False) -> None:
    until = aircraft.vehicle.time + seconds
    while aircraft.vehicle.time < until and not reached():
        aircraft.advance(LOOK_PERIODS)


def _error(vehicle: Simulation) -> float:
    return math.dist(vehicle.truth.body.position, vehicle.estimate.position)


def _end_of(aircraft: Aircraft) -> FailureEnd:
    if aircraft.autopilot.terminated:
        return FailureEnd.CUT
    if aircraft.vehicle.crash is not None:
        return FailureEnd.CRASHED
    return FailureEnd.LANDED if aircraft.vehicle.law.regime is Regime.GROUND else FailureEnd.FLIES


def draws(seeds: Sequence[int], units: Sequence[str]) -> list[FailureDraw]:
    """Every failure that the units can have, in every phase, by every seed."""
    return [
        FailureDraw(unit, failure, phase, seed)
        for unit in units
        for failure in failures_of(unit)
        for phase in FailurePhase
        for seed in seeds
    ]


def failures_of(unit: str) -> Iterator[int]:
    """The failures that a unit can have."""
    number = FAILING_UNITS[unit]
    known = BATTERY_FAILURES
    if number in INSTRUMENT_UNITS:
        known = INSTRUMENT_UNITS[number].failures
    elif number in ACTUATOR_UNITS:
        known = ACTUATOR_FAILURES
    return iter(sorted(known - {HEALTHY}))


def run_failures(
    flights: Sequence[FailureDraw],
    craft: Craft = DEFAULT_CRAFT,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
) -> list[FailedFlight]:
    """Fly them; their order and results do not depend on the jobs.

    Raises:
        SitlError: There is nothing to fly.
    """
    return fly_draws(partial(fly_failure, craft=craft), flights, jobs, at_once=4, on_progress=on_progress)


def summary(flown: Sequence[FailedFlight]) -> list[str]:
    """A row of a Markdown table for each failure and phase."""
    lines = ["| Failure | in | ends | noticed after | away | astray | impact |", "|---|---|---|---|---|---|---|"]
    for unit, failure, phase in dict.fromkeys((f.unit, f.failure, f.phase) for f in flown):
        group = [f for f in flown if (f.unit, f.failure, f.phase) == (unit, failure, phase)]
        counts = {end: sum(f.end is end for f in group) for end in FailureEnd}
        ends = ", ".join(f"{number} {end}" for end, number in counts.items() if number)
        noticed = max(f.noticed for f in group)
        impact = max(f.impact for f in group)
        lines.append(
            f"| {unit} {failure} | {phase} | {ends} | {f'{noticed:.1f} s' if math.isfinite(noticed) else '-'} "
            f"| {f'{max(f.away for f in group):.1f} m' if phase is FailurePhase.HOVER else ''} "
            f"| {max(f.astray for f in group):.1f} m | {f'{impact:.0f} m/s' if impact else '-'} |"
        )
    return lines
