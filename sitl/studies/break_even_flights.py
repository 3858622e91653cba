"""Legs flown from hover to hover by the whole vehicle under its own autopilot, and what their prediction is worth.

A leg has ended when the vehicle is within its acceptance of the end, and upright.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Law, Way
from protocol.frames import Geodetic, LocalFrame
from protocol.plans.mission import MissionItem
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft, is_forward
from sitl.design.forward import can_fly_forward
from sitl.errors import SitlError
from sitl.model.airframe import Array
from sitl.parameters import Bindings, Surroundings
from sitl.prediction.mode_choice import Decision, forbidden
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Abilities, Leg
from sitl.simulation.simulation import PERIOD, DivergedError, Simulation, Start
from sitl.simulation.tuning import Tuning
from sitl.supervisor.guards import WORTH_DISTANCE

ORIGIN = Geodetic(43.5648, 1.4811, 150.0)
HEIGHT = 45.0  # of the beginning of a leg [m]
CALMING = 8.0  # hovered in the wind before it [s]
SAMPLE = 10  # control periods
MAX_TIME = 240.0  # of a leg [s]
MAX_MISSION_TIME = 900.0  # [s]
MIN_DISTANCE, MAX_DISTANCE = WORTH_DISTANCE + 0.1, 300.0  # of a leg; for less there is no front transition [m]


class Flown(NamedTuple):
    """One leg as it was flown, and as the vehicle predicted it when it began."""

    leg: Leg
    way: Way
    time: float  # until its end is reached, upright [s]; infinite if it is not
    energy: float  # until then, at the shafts [J]
    predicted: Prediction  # by what the vehicle knows: its own estimate of the wind
    flew_forward: bool  # whether it flew forward at all
    sunk: float  # below its lower end at most [m]
    risen: float  # above its higher end at most [m]


class Journey(NamedTuple):
    """A mission as it was flown."""

    complete: bool
    time: float  # [s]
    energy: float  # at the shafts [J]
    decisions: list[tuple[int, Decision]]  # leg by leg, with the mission item the leg ends at
    energy_by_law: dict[Law, float]  # [J]


class Error(NamedTuple):
    """Relative errors of the predictions of many legs."""

    legs: int
    lost: int  # flown legs that never arrived, left out
    time: tuple[float, float, float]  # median and 90th percentile of the size, mean
    energy: tuple[float, float, float]


def abilities(airframe: str = "nominal", airspeed: float = 15.0) -> Abilities:
    """What a vehicle with its parameters as they are delivered can do.

    Raises:
        SitlError: If the parameter set is unknown or cannot fly forward, or the airspeed is no cruise.
    """
    parameters = load(airframe).parameters
    if not can_fly_forward(parameters):
        raise SitlError(f"airframe {airframe} has no trim between hover and wing: every leg is hovered")
    if not 7.0 <= airspeed <= 22.0:
        raise SitlError(f"airspeed {airspeed:g} m/s is not within 7 and 22")
    return Abilities(parameters, Tuning(), True, Settings().hover_speed, airspeed)


def fly_leg(leg: Leg, way: Way, airspeed: float = 15.0, airframe: str = "nominal") -> Flown:
    """Fly one leg from hover to hover: the whole vehicle, autopilot included.

    Args:
        leg: To fly.
        way: Upright, or forward wherever the supervisor makes the transition.
        airspeed: Of the cruise in forward flight [m/s].
        airframe: Parameter set.

    Raises:
        SitlError: If the parameter set is unknown or the leg ends below the ground.
    """
    if HEIGHT + leg.climb < 1.0:
        raise SitlError(f"a climb of {leg.climb:g} m from {HEIGHT:g} m ends below the ground")
    craft = _hovering(leg, Settings(way=int(way), airspeed=airspeed, min_leg=0.0), airframe)
    vehicle, autopilot = craft.vehicle, craft.autopilot
    autopilot.load_mission([_waypoint(leg.distance, 0.0, HEIGHT + leg.climb)])
    autopilot.start_mission()
    time, energy = vehicle.time, vehicle.energy
    heights, flew_forward, arrived = [HEIGHT], False, False
    try:
        while not arrived and vehicle.time - time < MAX_TIME:
            craft.advance(SAMPLE)
            flew_forward |= is_forward(vehicle.law)
            heights.append(vehicle.truth.body.position.z)
            arrived = autopilot.mission is not None and autopilot.mission.finished
    except DivergedError:
        arrived = False
    decision = autopilot.decisions()[0][1]
    return Flown(
        leg,
        way,
        vehicle.time - time if arrived else math.inf,
        vehicle.energy - energy if arrived else math.inf,
        decision.hover if way is Way.HOVER else decision.forward,
        flew_forward,
        HEIGHT + min(leg.climb, 0.0) - min(heights),
        max(heights) - HEIGHT - max(leg.climb, 0.0),
    )


def _hovering(leg: Leg, settings: Settings, airframe: str) -> Craft:
    """A craft that hovers in the wind where a leg to the north begins, turned away from it."""
    vehicle = Simulation(load(airframe).parameters, start=Start(up=HEIGHT, airborne=True, heading=-leg.turn))
    speed = math.hypot(leg.tail_wind, leg.cross_wind)
    azimuth = math.degrees(math.atan2(leg.cross_wind, -leg.tail_wind))
    bindings = Bindings(settings, vehicle.tuning, Surroundings(speed, azimuth, battery=1e9))
    craft = Craft(vehicle, World(LocalFrame(ORIGIN), ARENAS["open"]), bindings, airborne=True)
    craft.advance(round(CALMING / PERIOD))
    return craft


def _waypoint(north: float, west: float, up: float) -> MissionItem:
    place = round(north * 1e4), round(-west * 1e4), -up
    return MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_FRAME_LOCAL_NED, (0.0, 0.0, 0.0, math.nan), *place)


def fly_mission(items: Sequence[MissionItem], way: Way, min_leg: float = 25.0, airframe: str = "nominal") -> Journey:
    """Fly a mission from the ground to the ground, in calm.

    Args:
        items: The mission.
        way: NONE leaves every leg to the decision; the others ask for one way wherever it is possible.
        min_leg: DRK_FWD_LEG, shorter legs are hovered [m].
        airframe: Parameter set.
    """
    vehicle = Simulation(load(airframe).parameters)
    bindings = Bindings(Settings(way=int(way), min_leg=min_leg), vehicle.tuning, Surroundings(battery=1e9))
    craft = Craft(vehicle, World(LocalFrame(ORIGIN), ARENAS["open"]), bindings)
    autopilot = craft.autopilot
    autopilot.load_mission(items)
    autopilot.arm(force=True)
    autopilot.start_mission()
    decisions: list[tuple[int, Decision]] = []
    while not (autopilot.mission is None or autopilot.mission.finished) and vehicle.time < MAX_MISSION_TIME:
        craft.advance(SAMPLE)
        decisions += autopilot.decisions()
    complete = autopilot.mission is not None and autopilot.mission.finished
    return Journey(complete, vehicle.time, vehicle.energy, decisions, dict(vehicle.energy_by_law))


def draw(legs: int, able: Abilities, seed: int = 1, *, forward: bool) -> list[tuple[Leg, float]]:
    """Legs of all kinds with the airspeeds to fly them at: those that may be flown forward, or any.

    Distances of 10 to 300 m, climbs of -30 to 30 m, winds of up to 4 m/s along and across, airspeeds of 10 to 18 m/s;
    a third is in calm, half is level, and a third begins turned away.
    """
    random = np.random.default_rng(seed)
    drawn: list[tuple[Leg, float]] = []
    while len(drawn) < legs:
        tail, cross = random.uniform(-4.0, 4.0, 2) * (random.random() > 1.0 / 3.0)
        climb = random.uniform(-30.0, 30.0) * (random.random() > 0.5)
        turn = random.uniform(-math.pi, math.pi) * (random.random() < 1.0 / 3.0)
        distance = math.exp(random.uniform(math.log(10.0), math.log(MAX_DISTANCE)))
        leg = Leg(distance, float(climb), float(tail), float(cross), float(turn), HEIGHT + min(float(climb), 0.0))
        airspeed = float(random.uniform(10.0, 18.0))
        if not forward or barred(leg, able) is DecisionReason.NONE:
            drawn.append((leg, airspeed))
    return drawn


def fly_all(legs: Sequence[tuple[Leg, float]], way: Way, airframe: str = "nominal") -> list[Flown]:
    """Fly legs, each at its airspeed, all of them one way."""
    return [fly_leg(leg, way, airspeed, airframe) for leg, airspeed in legs]


def error(flights: Sequence[Flown]) -> Error:
    """Errors of the predictions of flown legs; those that never arrived are counted apart."""
    arrived = [one for one in flights if math.isfinite(one.energy) and math.isfinite(one.predicted.energy)]
    if not arrived:
        raise SitlError("none of the legs arrived")
    time = np.array([one.predicted.time / one.time - 1.0 for one in arrived])
    energy = np.array([one.predicted.energy / one.energy - 1.0 for one in arrived])
    return Error(len(arrived), len(flights) - len(arrived), _sizes(time), _sizes(energy))


def _sizes(relative: Array) -> tuple[float, float, float]:
    size = np.abs(relative)
    return float(np.median(size)), float(np.quantile(size, 0.9)), float(relative.mean())


def barred(leg: Leg, able: Abilities) -> DecisionReason:
    """Why a leg cannot be flown forward whatever it costs, or NONE; DRK_FWD_LEG does not count."""
    why = forbidden(leg, able)
    return DecisionReason.TOO_SHORT if why is DecisionReason.NONE and leg.distance < MIN_DISTANCE else why
