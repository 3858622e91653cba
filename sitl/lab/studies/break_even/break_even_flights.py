"""Legs flown from hover to hover by the whole vehicle under its own autopilot, and errors of their predictions.

A leg has ended when the vehicle hovers within the acceptance radius of its end.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.limits import MAX_AIRSPEED, MIN_AIRSPEED
from protocol.plans.mission_item import MissionItem
from sitl import (
    PERIOD,
    Aircraft,
    Array,
    Configuration,
    DivergedError,
    Law,
    Settings,
    Simulation,
    SitlError,
    Start,
    Tuning,
    WorldSettings,
    load_airframe,
)
from sitl.defaults import AIRFRAME
from sitl.design.gains import can_fly_forward
from sitl.lab.studies.mission_flight import (
    SAMPLE_PERIODS,
    STUDY_WORLD,
    has_finished_mission,
    waypoint,
)
from sitl.prediction.mode_choice import Decision, forbidden
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Abilities, Leg
from sitl.supervisor.guards import MIN_TRANSITION_LEG
from sitl.vehicle.aircraft import is_forward

LEG_HEIGHT = 45.0  # of the beginning of a leg [m]
HOVER_TIME = 8.0  # hovered in the wind before a leg [s]
MAX_LEG_TIME = 240.0  # [s]
MAX_JOURNEY_TIME = 900.0  # of a mission [s]
MIN_DISTANCE, MAX_DISTANCE = MIN_TRANSITION_LEG + 0.1, 300.0  # of a leg; shorter ones have no front transition [m]
AIRSPEED_RANGE = (MIN_AIRSPEED, MAX_AIRSPEED)  # of a cruise [m/s]


class FlownLeg(NamedTuple):
    """One leg as it was flown, and as the vehicle predicted it when it began."""

    leg: Leg
    leg_mode: LegMode
    time: float  # until it hovers at the end [s]; infinite if it never does
    energy: float  # until then, at the shafts [J]; infinite if it never does
    predicted: Prediction  # from the vehicle's own estimate of the wind
    flew_forward: bool  # at any time
    sunk: float  # below its lower end at most [m]
    risen: float  # above its higher end at most [m]


class FlownMission(NamedTuple):
    """A mission as it was flown."""

    complete: bool
    time: float  # [s]
    energy: float  # at the shafts [J]
    decisions: list[tuple[int, Decision]]  # leg by leg, with the mission item the leg ends at
    energy_by_law: dict[Law, float]  # [J]


class ErrorSizes(NamedTuple):
    """Relative errors of many predictions."""

    median: float  # of the absolute value
    p90: float  # 90th percentile of the absolute value
    mean: float  # signed


class PredictionError(NamedTuple):
    """Relative errors of the predictions of many legs."""

    legs: int
    lost: int  # flown legs that never arrived, left out
    time: ErrorSizes
    energy: ErrorSizes


def abilities(airframe: str = AIRFRAME, airspeed: float = 15.0) -> Abilities:
    """Abilities of a vehicle with default parameters.

    Args:
        airframe: Parameter set.
        airspeed: Of the cruise [m/s].

    Raises:
        SitlError: If the parameter set is unknown or cannot fly forward, or the airspeed is out of range.
    """
    parameters = load_airframe(airframe).parameters
    if not can_fly_forward(parameters):
        raise SitlError(f"airframe {airframe} has no trim between hover and cruise: every leg is hovered")
    slowest, fastest = AIRSPEED_RANGE
    if not slowest <= airspeed <= fastest:
        raise SitlError(f"airspeed {airspeed:g} m/s is not within {slowest:g} and {fastest:g}")
    return Abilities(parameters, Tuning(), True, Settings().hover_speed, airspeed)


def fly_leg(leg: Leg, leg_mode: LegMode, airspeed: float = 15.0, airframe: str = AIRFRAME) -> FlownLeg:
    """Fly one leg from hover to hover with the whole vehicle, autopilot included.

    Args:
        leg: To fly.
        leg_mode: In the hover, or forward wherever the supervisor makes the transition.
        airspeed: Of the cruise in forward flight [m/s].
        airframe: Parameter set.

    Raises:
        SitlError: If the parameter set is unknown or the leg ends below the ground.
    """
    if LEG_HEIGHT + leg.climb < 1.0:
        raise SitlError(f"a climb of {leg.climb:g} m from {LEG_HEIGHT:g} m ends below the ground")
    aircraft = _hovering(leg, Settings(leg_mode=int(leg_mode), airspeed=airspeed, min_leg=0.0), airframe)
    vehicle, autopilot = aircraft.vehicle, aircraft.autopilot
    autopilot.missions.load([waypoint(leg.distance, 0.0, LEG_HEIGHT + leg.climb)])
    autopilot.missions.start()
    time, energy = vehicle.time, vehicle.energy
    heights, flew_forward, arrived = [LEG_HEIGHT], False, False
    try:
        while not arrived and vehicle.time - time < MAX_LEG_TIME:
            aircraft.advance(SAMPLE_PERIODS)
            flew_forward |= is_forward(vehicle)
            heights.append(vehicle.truth.body.position.z)
            arrived = has_finished_mission(aircraft)
    except DivergedError:
        arrived = False
    decision = autopilot.decisions()[0][1]
    return FlownLeg(
        leg=leg,
        leg_mode=leg_mode,
        time=vehicle.time - time if arrived else math.inf,
        energy=vehicle.energy - energy if arrived else math.inf,
        predicted=decision.hover if leg_mode is LegMode.HOVER else decision.forward,
        flew_forward=flew_forward,
        sunk=LEG_HEIGHT + min(leg.climb, 0.0) - min(heights),
        risen=max(heights) - LEG_HEIGHT - max(leg.climb, 0.0),
    )


def _hovering(leg: Leg, settings: Settings, airframe: str) -> Aircraft:
    """An aircraft that hovers in the wind where a leg to the north begins, turned away from it."""
    vehicle = Simulation(
        load_airframe(airframe).parameters, start=Start(up=LEG_HEIGHT, airborne=True, heading=-leg.turn)
    )
    speed = math.hypot(leg.tail_wind, leg.cross_wind)
    azimuth = math.degrees(math.atan2(leg.cross_wind, -leg.tail_wind))
    configuration = Configuration(settings, vehicle.tuning, WorldSettings(speed, azimuth, battery=1e9))
    aircraft = Aircraft(vehicle, STUDY_WORLD, configuration, airborne=True)
    aircraft.advance(round(HOVER_TIME / PERIOD))
    return aircraft


def fly_mission(
    items: Sequence[MissionItem], leg_mode: LegMode, min_leg: float = 25.0, airframe: str = AIRFRAME
) -> FlownMission:
    """Fly a mission from the ground to the ground, in calm.

    Args:
        items: The mission.
        leg_mode: NONE leaves every leg to the decision; the others ask for one way wherever it is possible.
        min_leg: DRK_FWD_LEG, shorter legs are hovered [m].
        airframe: Parameter set.
    """
    vehicle = Simulation(load_airframe(airframe).parameters)
    settings = Settings(leg_mode=int(leg_mode), min_leg=min_leg)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, WorldSettings(battery=1e9)))
    autopilot = aircraft.autopilot
    autopilot.missions.load(items)
    autopilot.arming.arm(force=True)
    autopilot.missions.start()
    decisions: list[tuple[int, Decision]] = []
    while not (autopilot.mission is None or autopilot.mission.finished) and vehicle.time < MAX_JOURNEY_TIME:
        aircraft.advance(SAMPLE_PERIODS)
        decisions += autopilot.decisions()
    return FlownMission(
        complete=has_finished_mission(aircraft),
        time=vehicle.time,
        energy=vehicle.energy,
        decisions=decisions,
        energy_by_law=dict(vehicle.energy_by_law),
    )


def draw(legs: int, able: Abilities, seed: int = 1, *, forward: bool) -> list[tuple[Leg, float]]:
    """Random legs of all kinds, each with an airspeed.

    Distances of 10 to 300 m, climbs of -30 to 30 m, winds of up to 4 m/s along and across, airspeeds of 10 to 18 m/s;
    a third is in calm, half is level, and a third begins turned away.

    Args:
        legs: How many.
        able: What the vehicle can do.
        seed: Of the draw.
        forward: Whether to draw only legs that may be flown forward.
    """
    random = np.random.default_rng(seed)
    drawn: list[tuple[Leg, float]] = []
    while len(drawn) < legs:
        tail, cross = random.uniform(-4.0, 4.0, 2) * (random.random() > 1.0 / 3.0)
        climb = random.uniform(-30.0, 30.0) * (random.random() > 0.5)
        turn = random.uniform(-math.pi, math.pi) * (random.random() < 1.0 / 3.0)
        distance = math.exp(random.uniform(math.log(10.0), math.log(MAX_DISTANCE)))
        leg = Leg(distance, float(climb), float(tail), float(cross), float(turn), LEG_HEIGHT + min(float(climb), 0.0))
        airspeed = float(random.uniform(10.0, 18.0))
        if not forward or why_not_forward(leg, able) is DecisionReason.NONE:
            drawn.append((leg, airspeed))
    return drawn


def fly_all(legs: Sequence[tuple[Leg, float]], leg_mode: LegMode, airframe: str = AIRFRAME) -> list[FlownLeg]:
    """Fly legs, each at its airspeed, all of them one way."""
    return [fly_leg(leg, leg_mode, airspeed, airframe) for leg, airspeed in legs]


def prediction_error(flights: Sequence[FlownLeg]) -> PredictionError:
    """Errors of the predictions of flown legs; those that never arrived are only counted.

    Raises:
        SitlError: If no leg arrived.
    """
    arrived = [one for one in flights if math.isfinite(one.energy) and math.isfinite(one.predicted.energy)]
    if not arrived:
        raise SitlError("no leg arrived")
    time = np.array([one.predicted.time / one.time - 1.0 for one in arrived])
    energy = np.array([one.predicted.energy / one.energy - 1.0 for one in arrived])
    return PredictionError(len(arrived), len(flights) - len(arrived), _sizes(time), _sizes(energy))


def _sizes(relative: Array) -> ErrorSizes:
    size = np.abs(relative)
    return ErrorSizes(float(np.median(size)), float(np.quantile(size, 0.9)), float(relative.mean()))


def why_not_forward(leg: Leg, able: Abilities) -> DecisionReason:
    """The reason why a leg cannot be flown forward whatever it costs, or NONE; DRK_FWD_LEG does not count."""
    why = forbidden(leg, able)
    return DecisionReason.TOO_SHORT if why is DecisionReason.NONE and leg.distance < MIN_DISTANCE else why
