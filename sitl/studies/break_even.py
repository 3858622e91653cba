"""Hover or fly, flown: legs from hover to hover, what the prediction of them is worth, and the break-even distance.

The break-even distance of a leg is where its energy upright and its energy on the wing are the same: shorter legs are
hovered, longer ones flown. It is predicted by :mod:`sitl.prediction.predictor`, and flown by the whole vehicle under
its own autopilot, whose leg has ended when the end is within its acceptance and the vehicle upright.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
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
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.simulation.simulation import PERIOD, DivergedError, Simulation, Start
from sitl.simulation.tuning import Tuning
from sitl.supervisor.guards import WORTH_DISTANCE

ORIGIN = Geodetic(43.5648, 1.4811, 150.0)
HEIGHT = 45.0  # of the beginning of a leg [m]
CALMING = 8.0  # hovered in the wind before it [s]
SAMPLE = 10  # control ticks
TOO_LONG = 240.0  # of a leg [s]
MISSION_TIME = 900.0  # of a mission, at most [s]
SHORTEST, LONGEST = WORTH_DISTANCE + 0.1, 300.0  # the supervisor does not tip over for less [m]
DISTANCES = np.geomspace(SHORTEST, LONGEST, 24)
NARROW = np.geomspace(SHORTEST, LONGEST, 400)
CLIMBS = (-30.0, -10.0, 0.0, 10.0, 30.0)
WINDS = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
TURNS = (0.0, 0.5 * math.pi)  # from the heading before a leg to the leg's [rad]
CLOSE = 0.25  # how finely a break-even distance is sought [m]


class Flown(NamedTuple):
    """One leg as it was flown, and as the vehicle predicted it when it began."""

    leg: Leg
    way: Way
    time: float  # until its end is reached, upright [s]; infinite if it is not
    energy: float  # until then, at the shafts [J]
    predicted: Prediction  # by what the vehicle knows: its own estimate of the wind
    tipped: bool  # whether it was on the wing at all
    sunk: float  # below its lower end at most [m]
    risen: float  # above its higher end at most [m]


class Journey(NamedTuple):
    """A mission as it was flown."""

    complete: bool
    time: float  # [s]
    energy: float  # at the shafts [J]
    decisions: list[tuple[int, Decision]]  # leg by leg, with the mission item the leg ends at
    energy_by_law: dict[Law, float]  # [J]


class Cell(NamedTuple):
    """The break-even distance of legs of one kind."""

    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # [m/s]
    turn: float  # at their beginning [rad]
    distance: float  # from which on the wing costs less [m]; infinite: not within 300 m
    barred: DecisionReason  # why the wing is no choice for shorter legs, where that is what decides; else NONE


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
        way: Upright, or on the wing wherever the supervisor tips over.
        airspeed: Of the cruise on the wing [m/s].
        airframe: Parameter set.

    Raises:
        SitlError: If the parameter set is unknown or the leg ends below the ground.
    """
    if HEIGHT + leg.climb < 1.0:
        raise SitlError(f"a climb of {leg.climb:g} m from {HEIGHT:g} m ends below the ground")
    craft = _hovering(leg, Settings(way=int(way), airspeed=airspeed, least_leg=0.0), airframe)
    vehicle, autopilot = craft.vehicle, craft.autopilot
    autopilot.load_mission([_waypoint(leg.distance, 0.0, HEIGHT + leg.climb)])
    autopilot.start_mission()
    time, energy = vehicle.time, vehicle.energy
    heights, tipped, arrived = [HEIGHT], False, False
    try:
        while not arrived and vehicle.time - time < TOO_LONG:
            craft.advance(SAMPLE)
            tipped |= is_forward(vehicle.law)
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
        tipped,
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


def fly_mission(items: Sequence[MissionItem], way: Way, least_leg: float = 25.0, airframe: str = "nominal") -> Journey:
    """Fly a mission from the ground to the ground, in calm.

    Args:
        items: The mission.
        way: NONE leaves every leg to the decision; the others ask for one way wherever it is possible.
        least_leg: DRK_FWD_LEG, shorter legs are hovered [m].
        airframe: Parameter set.
    """
    vehicle = Simulation(load(airframe).parameters)
    bindings = Bindings(Settings(way=int(way), least_leg=least_leg), vehicle.tuning, Surroundings(battery=1e9))
    craft = Craft(vehicle, World(LocalFrame(ORIGIN), ARENAS["open"]), bindings)
    autopilot = craft.autopilot
    autopilot.load_mission(items)
    autopilot.arm(force=True)
    autopilot.start_mission()
    decisions: list[tuple[int, Decision]] = []
    while not (autopilot.mission is None or autopilot.mission.finished) and vehicle.time < MISSION_TIME:
        craft.advance(SAMPLE)
        decisions += autopilot.decisions()
    complete = autopilot.mission is not None and autopilot.mission.finished
    return Journey(complete, vehicle.time, vehicle.energy, decisions, dict(vehicle.energy_by_law))


def draw(legs: int, able: Abilities, seed: int = 1, *, forward: bool) -> list[tuple[Leg, float]]:
    """Legs of all kinds with the airspeeds to fly them at: those that may be flown on the wing, or any.

    Distances of 10 to 300 m, climbs of -30 to 30 m, winds of up to 4 m/s along and across, airspeeds of 10 to 18 m/s;
    a third is in calm, half is level, and a third begins turned away.
    """
    random = np.random.default_rng(seed)
    drawn: list[tuple[Leg, float]] = []
    while len(drawn) < legs:
        tail, cross = random.uniform(-4.0, 4.0, 2) * (random.random() > 1.0 / 3.0)
        climb = random.uniform(-30.0, 30.0) * (random.random() > 0.5)
        turn = random.uniform(-math.pi, math.pi) * (random.random() < 1.0 / 3.0)
        distance = math.exp(random.uniform(math.log(10.0), math.log(LONGEST)))
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
    """Why a leg cannot be flown on the wing whatever it costs, or NONE; DRK_FWD_LEG does not count."""
    why = forbidden(leg, able)
    return DecisionReason.TOO_SHORT if why is DecisionReason.NONE and leg.distance < SHORTEST else why


Saving = Callable[[float], float]  # of the wing against the hover, over the distance [J]


def predicted(able: Abilities, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0) -> Cell:
    """The break-even distance as the decision sees it.

    Args:
        able: What the vehicle can do.
        climb: Altitude gained on every leg [m].
        tail: Wind along the legs [m/s].
        cross: Wind across them [m/s].
        turn: From the heading before the leg to the leg's [rad].
    """

    def saving(distance: float) -> float:
        leg = Leg(distance, climb, tail, cross, turn)
        return predict_hover(leg, able).energy - predict_forward(leg, able).energy

    return _seek(saving, able, Cell(climb, tail, cross, turn, math.inf, DecisionReason.ENERGY), DISTANCES)


def flown(
    able: Abilities, airframe: str, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0
) -> Cell:
    """The break-even distance in flight, sought about the predicted one; arguments as for :func:`predicted`."""

    def saving(distance: float) -> float:
        leg = Leg(distance, climb, tail, cross, turn)
        hover, wing = (fly_leg(leg, way, able.airspeed, airframe).energy for way in (Way.HOVER, Way.FORWARD))
        return hover - wing

    expected = predicted(able, climb, tail, cross, turn)
    about = 40.0 if math.isinf(expected.distance) else expected.distance
    return _seek(saving, able, expected._replace(distance=math.inf), about * np.array((0.6, 0.8, 1.0, 1.25, 1.6)))


def _seek(saving: Saving, able: Abilities, cell: Cell, distances: Array) -> Cell:
    """Where the last change from loss to gain is among the distances allowed, then by bisection."""
    fine = [float(d) for d in NARROW if barred(Leg(float(d), cell.climb), able) is DecisionReason.NONE]
    if not fine:
        return cell._replace(distance=math.inf, barred=DecisionReason.TOO_STEEP)
    least = fine[0]
    tried = sorted({least, *(float(d) for d in distances if d > least)})
    gains = [saving(d) > 0.0 for d in tried]
    if not gains[-1]:
        return cell._replace(distance=math.inf, barred=DecisionReason.ENERGY)
    losses = [i for i, gain in enumerate(gains) if not gain]
    if not losses:
        shorter = barred(Leg(0.98 * least, cell.climb), able)
        return cell._replace(distance=least, barred=shorter)
    low, high = tried[losses[-1]], tried[losses[-1] + 1]
    while high - low > CLOSE:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if saving(middle) > 0.0 else (middle, high)
    return cell._replace(distance=0.5 * (low + high), barred=DecisionReason.NONE)


def table(able: Abilities) -> list[Cell]:
    """The predicted break-even of every climb in every wind along the leg, begun ahead and turned away."""
    return [predicted(able, climb, tail, turn=turn) for turn in TURNS for tail in WINDS for climb in CLIMBS]
