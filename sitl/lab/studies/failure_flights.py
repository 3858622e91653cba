"""Injected failures in every phase of a flight: what the vehicle notices, and where it goes, judged by the truth.

A flight is good that stays near its plan, or that warns, leaves forward flight and comes no farther away. What the
vehicle believes of its position tells nothing of that: it may believe it rightly and fly away.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Callable, Iterator, Sequence
from enum import StrEnum
from functools import partial
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from sitl import Aircraft, Configuration, Navigation, Regime, Settings, Simulation, SitlError, Start, WorldSettings
from sitl.control.reference import Point
from sitl.lab.studies.proportions import counted, percent_bounds
from sitl.lab.studies.seeded_flights import (
    DEFAULT_CRAFT,
    STUDY_WORLD,
    Craft,
    check_seeded,
    craft_of,
    fly_draws,
    ignore_progress,
    print_progress,
    waypoint,
    write_json,
)
from sitl.lab.studies.wrong_models import drawn_scale, perturbed
from sitl.sensors.instruments import HEALTHY
from sitl.simulation.actuator_faults import ACTUATOR_FAILURES
from sitl.simulation.situation import regime
from sitl.vehicle.aircraft import is_forward
from sitl.vehicle.injected_failures import ACTUATOR_UNITS, BATTERY_FAILURES, FAILURE_NAMES, INSTRUMENT_UNITS

FAILURE_HEIGHT = 40.0  # [m]
LEG_END_FAR, LEG_END_NEAR = (1000.0, 0.0, FAILURE_HEIGHT), (250.0, 0.0, FAILURE_HEIGHT)  # ends of legs, world NWU [m]
LEG_END = (500.0, 0.0, FAILURE_HEIGHT)  # likewise of the one that it begins with the failure
CORNERS = ((300.0, 0.0), (300.0, 150.0), (0.0, 150.0))  # of the mission, after its start [m]
TIME_BEFORE, CRUISE_TIME, FAILED_TIME = 5.0, 12.0, 60.0  # before the leg, on it, and with the failure [s]
OUTWARD_TIME, RETURN_TIME = 25.0, 14.0  # before a return, and on it [s]
FAILURE_SAMPLE_PERIODS = 50  # control periods between looks at the flight
ON_PLAN = 30.0  # no farther from its plan a flight goes on as it should [m]
MAX_CRASHED = 0.05  # share of the flights with one failure in one phase
LEFT_WITHIN = 60.0  # no farther a flight may end that was given up [m]

NO_UNIT = "nothing"  # fails: whether a healthy flight raises an alarm
FAILING_UNITS = {
    "gyroscope": mavlink.FAILURE_UNIT_SENSOR_GYRO,
    "accelerometer": mavlink.FAILURE_UNIT_SENSOR_ACCEL,
    "magnetometer": mavlink.FAILURE_UNIT_SENSOR_MAG,
    "barometer": mavlink.FAILURE_UNIT_SENSOR_BARO,
    "gnss": mavlink.FAILURE_UNIT_SENSOR_GPS,
    "mocap": mavlink.FAILURE_UNIT_SENSOR_VIO,
    "pitot": mavlink.FAILURE_UNIT_SENSOR_AIRSPEED,
    "motor": mavlink.FAILURE_UNIT_SYSTEM_MOTOR,
    "elevon": mavlink.FAILURE_UNIT_SYSTEM_SERVO,
    "battery": mavlink.FAILURE_UNIT_SYSTEM_BATTERY,
}
KNOWN_FAILURES = [name for name in FAILURE_NAMES if name != FAILURE_NAMES[HEALTHY]]
PAIRED = frozenset({"motor", "elevon"})  # of which one fails, the seed says which


class FailurePhase(StrEnum):
    """Phase of the flight in which a failure is injected."""

    HOVER = "hover"
    TRANSITION = "transition"
    CRUISE = "cruise"
    BACK = "back transition"
    RETURN = "return"


class FailureEnd(StrEnum):
    """End of a flight with a failure."""

    FLIES = "flies"
    LANDED = "landed"
    CUT = "motors off"
    CRASHED = "crashed"


class FailureConditions(NamedTuple):
    """Conditions of all flights."""

    wind: float = 5.0  # greatest steady wind, from any side [m/s]
    gusts: float = 0.5  # rms per axis [m/s]
    parameters: float = 0.0  # greatest relative error of the design model


USUAL_CONDITIONS = FailureConditions()


class FailureDraw(NamedTuple):
    """One flight to be flown."""

    unit: str  # of FAILING_UNITS, or NO_UNIT
    failure: int  # FAILURE_TYPE
    phase: FailurePhase
    seed: int


class FailedFlight(NamedTuple):
    """Result of one flight."""

    unit: str
    failure: str
    phase: FailurePhase
    seed: int
    end: FailureEnd
    noticed: float  # after so long; infinite if nothing was said [s]
    said: str  # first
    off: float  # farthest from its plan; level, once it has warned [m]
    astray: float  # farthest from where it believed itself [m]
    forward: bool  # whether it still flew forward at the end
    impact: float  # of a crash [m/s]
    time: float  # from the failure to its end [s]

    @property
    def away(self) -> bool:
        """Whether it left its plan without a word, went on in forward flight after it, or came too far from it."""
        if self.end is FailureEnd.CRASHED and not self.said:
            return True
        if self.off <= ON_PLAN:
            return False
        return not self.said or self.forward or self.off > LEFT_WITHIN


def fly_failure(
    draw: FailureDraw, craft: Craft = DEFAULT_CRAFT, conditions: FailureConditions = USUAL_CONDITIONS
) -> FailedFlight:
    """Fly one flight until it is on the ground, or for FAILED_TIME."""
    aircraft, plan = _begun(draw, craft, conditions)
    vehicle = aircraft.vehicle
    aircraft.autopilot.notices()
    instance = 1 + draw.seed % 2 if draw.unit in PAIRED else 0
    if draw.unit != NO_UNIT:
        aircraft.failures.inject(FAILING_UNITS[draw.unit], draw.failure, instance)
        vehicle.faults = vehicle.faults._replace(seed=draw.seed)  # an actuator at random goes another way by each
    began = vehicle.time
    noticed, said, off, astray = math.inf, "", 0.0, 0.0
    while vehicle.time - began < FAILED_TIME:
        aircraft.advance(FAILURE_SAMPLE_PERIODS)
        body = vehicle.truth.body
        warnings = [n.text for n in aircraft.autopilot.notices() if n.severity <= mavlink.MAV_SEVERITY_WARNING]
        if warnings and not said:
            noticed, said = vehicle.time - began, warnings[0]
        off = max(off, distance_from(plan, body.position, level=bool(said)))
        astray = max(astray, _error(vehicle))
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
        off=off,
        astray=astray,
        forward=is_forward(vehicle),
        impact=vehicle.crash.speed if vehicle.crash is not None else 0.0,
        time=vehicle.time - began,
    )


def distance_from(plan: Sequence[Point], p: Point, *, level: bool = False) -> float:
    """Distance of a point from a way through points, world NWU [m].

    Args:
        plan: The points, at least one.
        p: The point.
        level: Whether heights do not count.
    """
    axes = slice(0, 2 if level else 3)
    here, ends = np.array(p)[axes], [np.array(point)[axes] for point in plan]
    nearest = float(np.linalg.norm(here - ends[0]))
    for a, b in itertools.pairwise(ends):
        share = np.clip((here - a) @ (b - a) / max((b - a) @ (b - a), 1e-9), 0.0, 1.0)
        nearest = min(nearest, float(np.linalg.norm(here - a - share * (b - a))))
    return nearest


def _begun(draw: FailureDraw, craft: Craft, conditions: FailureConditions) -> tuple[Aircraft, list[Point]]:
    """A vehicle in the phase in which it will fail, and the way that it should fly from there."""
    random = np.random.default_rng(draw.seed)
    air = WorldSettings(
        float(random.uniform(0.0, conditions.wind)),
        float(random.uniform(-180.0, 180.0)),
        conditions.gusts,
        battery=1e6,
    )
    scale = drawn_scale(random, conditions.parameters)
    vehicle = craft.fly(draw.seed, Start(up=FAILURE_HEIGHT, airborne=True), perturbed(craft.model, scale))
    settings = Settings(leg_mode=int(LegMode.FORWARD))
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, air), airborne=True)
    _advance_until(aircraft, TIME_BEFORE)
    home = (0.0, 0.0, FAILURE_HEIGHT)
    if draw.phase is FailurePhase.HOVER:
        return aircraft, [home]
    if draw.phase is FailurePhase.RETURN:
        return aircraft, _send_home(aircraft, home)
    if draw.phase is FailurePhase.CRUISE:
        aircraft.autopilot.missions.load([waypoint(*corner, FAILURE_HEIGHT) for corner in CORNERS])
        aircraft.autopilot.missions.start()
        _advance_until(aircraft, CRUISE_TIME)
        return aircraft, [home, *((*corner, FAILURE_HEIGHT) for corner in CORNERS)]
    goal, awaited = (LEG_END, Regime.FRONT_TRANSITION)
    if draw.phase is FailurePhase.BACK:
        goal, awaited = (LEG_END_NEAR, Regime.BACK_TRANSITION)
    aircraft.autopilot.guided.go_to(goal)
    _advance_until(aircraft, 2.0 * OUTWARD_TIME, lambda: regime(vehicle) is awaited)
    return aircraft, [home, goal]


def _send_home(aircraft: Aircraft, home: Point) -> list[Point]:
    """Let it fly out, turn and return for a while; gives what is left of its way."""
    aircraft.autopilot.guided.go_to(LEG_END_FAR)
    _advance_until(aircraft, OUTWARD_TIME)
    aircraft.autopilot.guided.return_to_launch()
    _advance_until(aircraft, RETURN_TIME)
    return [aircraft.vehicle.truth.body.position, home, (0.0, 0.0, 0.0)]


def _advance_until(aircraft: Aircraft, seconds: float, reached: Callable[[], bool] = lambda: False) -> None:
    until = aircraft.vehicle.time + seconds
    while aircraft.vehicle.time < until and not reached():
        aircraft.advance(FAILURE_SAMPLE_PERIODS)


def _error(vehicle: Simulation) -> float:
    return math.dist(vehicle.truth.body.position, vehicle.estimate.position)


def _end_of(aircraft: Aircraft) -> FailureEnd:
    if aircraft.autopilot.terminated:
        return FailureEnd.CUT
    if aircraft.vehicle.crash is not None:
        return FailureEnd.CRASHED
    return FailureEnd.LANDED if aircraft.vehicle.law.regime is Regime.GROUND else FailureEnd.FLIES


def units_of(navigation: Navigation) -> list[str]:
    """The units that are aboard a vehicle that navigates so."""
    return [
        unit
        for unit, number in FAILING_UNITS.items()
        if number not in INSTRUMENT_UNITS or navigation in INSTRUMENT_UNITS[number].navigation
    ]


def draws(
    seeds: Sequence[int],
    units: Sequence[str],
    phases: Sequence[FailurePhase] = tuple(FailurePhase),
    failures: Sequence[str] = KNOWN_FAILURES,
) -> list[FailureDraw]:
    """Every failure of these names that the units can have, in every phase, by every seed."""
    return [
        FailureDraw(unit, failure, phase, seed)
        for unit in units
        for failure in failures_of(unit)
        if unit == NO_UNIT or FAILURE_NAMES[failure] in failures
        for phase in phases
        for seed in seeds
    ]


def failures_of(unit: str) -> Iterator[int]:
    """The failures that a unit can have."""
    if unit == NO_UNIT:
        return iter((HEALTHY,))
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
    conditions: FailureConditions = USUAL_CONDITIONS,
    jobs: int = 2,
    on_progress: Callable[[int], None] = ignore_progress,
) -> list[FailedFlight]:
    """Fly them; their order and results do not depend on the jobs.

    Raises:
        SitlError: There is nothing to fly.
    """
    return fly_draws(
        partial(fly_failure, craft=craft, conditions=conditions), flights, jobs, at_once=4, on_progress=on_progress
    )


def summary(flown: Sequence[FailedFlight]) -> list[str]:
    """A row of a Markdown table for each failure and phase; below it, which flew away."""
    lines = ["| Failure | in | ends | warned after | off its plan | astray | impact |", "|---|---|---|---|---|---|---|"]
    for unit, failure, phase in dict.fromkeys((f.unit, f.failure, f.phase) for f in flown):
        group = [f for f in flown if (f.unit, f.failure, f.phase) == (unit, failure, phase)]
        counts = {str(end): sum(f.end is end for f in group) for end in FailureEnd}
        counts["**away**"] = sum(f.away for f in group)
        ends = ", ".join(f"{n} {end} ({percent_bounds(n, len(group))})" for end, n in counts.items() if n)
        noticed, warned = [f.noticed for f in group if f.said], sum(bool(f.said) for f in group)
        after = f"{max(noticed):.1f} s{'' if warned == len(group) else f' ({warned})'}" if noticed else "-"
        impact = max(f.impact for f in group)
        lines.append(
            f"| {unit} {failure} | {phase} | {ends} | {after} | {max(f.off for f in group):.1f} m "
            f"| {max(f.astray for f in group):.1f} m | {f'{impact:.0f} m/s' if impact else '-'} |"
        )
    away = [f for f in flown if f.away]
    lines += ["", f"{counted(len(away), len(flown))} flew away"]
    lines += [f"crashes in more than 1 of 20: {cell}" for cell in crashing(flown)]
    lines += [
        f"away: {f.unit} {f.failure}, {f.phase}, seed {f.seed}: {f.off:.0f} m, {f.said or 'no word'}" for f in away
    ]
    return lines


def crashing(flown: Sequence[FailedFlight]) -> list[str]:
    """The failures and phases in which more crash with their motors on than may."""
    groups: dict[str, list[FailedFlight]] = {}
    for f in flown:
        groups.setdefault(f"{f.unit} {f.failure}, {f.phase}", []).append(f)
    counts = {name: sum(f.end is FailureEnd.CRASHED for f in group) for name, group in groups.items()}
    return [
        f"{name}: {counted(count, len(groups[name]))}"
        for name, count in counts.items()
        if count > MAX_CRASHED * len(groups[name])
    ]


def study_failures(args: argparse.Namespace) -> int:
    """Fly them and print how they ended; exit code 1 if one flew away, or a failure crashes in more than 1 of 20."""
    check_seeded(args, {"wind": 15.0, "gusts": 3.0, "parameters": 0.3})
    if args.nav == "truth":
        raise SitlError("--nav truth: a vehicle that sees the truth has no instruments to fail")

    craft = craft_of(args)
    units = units_of(craft.navigation)
    units = _chosen("units", args.units, [*units, NO_UNIT]) if args.units else units
    phases = _chosen("phases", args.phases, [str(phase) for phase in FailurePhase])
    failures = _chosen("failures", args.failures, KNOWN_FAILURES)
    seeds = range(args.first, args.first + args.flights)
    drawn = draws(seeds, units, [FailurePhase(phase) for phase in phases], failures)
    conditions = FailureConditions(args.wind, args.gusts, args.parameters)
    flown = run_failures(drawn, craft, conditions, args.jobs, on_progress=lambda done: print_progress(done, len(drawn)))
    print("\n".join(summary(flown)), flush=True)
    if args.json is not None:
        write_json(args.json, [{**flight._asdict(), "away": flight.away} for flight in flown])
    return 1 if crashing(flown) or any(flight.away for flight in flown) else 0


def _chosen(option: str, asked: Sequence[str], known: Sequence[str]) -> list[str]:
    """The chosen among the known names; all of them by default.

    Raises:
        SitlError: There is no such thing.
    """
    for name in asked:
        if name not in known:
            raise SitlError(f"--{option} {name}: there are {', '.join(known)}")
    return list(asked or known)
