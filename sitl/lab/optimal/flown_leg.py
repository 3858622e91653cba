"""The same leg as the vehicle flies it: each controller, upright and forward, slower and faster."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import LegMode
from sitl import (
    PERIOD,
    Aircraft,
    Array,
    Body,
    Configuration,
    DivergedError,
    Settings,
    Simulation,
    Start,
    Tuning,
    WorldSettings,
)
from sitl import load_airframe as load
from sitl.control.indi_guidance import FASTEST_HOVER
from sitl.defaults import BRISK, CONTROLLER_NAMES, GENTLE
from sitl.lab.optimal.question import CRUISE_END, Question
from sitl.lab.studies.seeded_flights import SAMPLE_PERIODS, STUDY_WORLD, Craft, waypoint
from sitl.simulation.tuning import CONTROLLERS, uses_indi

ARRIVED_WITHIN, ARRIVED_SPEED = 0.5, 0.5  # of the end, over ground: it has arrived [m], [m/s]
HOVERED_FIRST = 8.0  # hovered before a leg [s]
GIVEN_UP = 240.0  # [s]
CRUISES_WITHIN, CRUISES_SPEED = 1.0, 1.0  # of its line and height, of its airspeed: it is in the cruise [m], [m/s]
RUN_UP, RUN_OUT = 200.0, 300.0  # flown before a leg that begins in a cruise, and beyond one that ends in one [m]
END_STRETCH = 10.0  # the first and the last part of a leg, a third of short ones [m]


class WayToFly(NamedTuple):
    """A leg mode with its speed and INDI's pace."""

    mode: LegMode  # NONE: as the vehicle chooses
    speed: float  # over ground upright, through the air otherwise [m/s]
    pace: int = GENTLE

    @property
    def words(self) -> str:
        """For a table."""
        mode = {LegMode.HOVER: "upright", LegMode.FORWARD: "forward"}.get(self.mode, "as chosen,")
        return f"{mode} {self.speed:g} m/s{', brisk' if self.pace == BRISK else ''}"


WAYS = (
    WayToFly(LegMode.HOVER, 3.0),
    WayToFly(LegMode.HOVER, 6.0),
    WayToFly(LegMode.FORWARD, 15.0),
    WayToFly(LegMode.FORWARD, 22.0),
)
BRISK_WAYS = tuple(way._replace(pace=BRISK) for way in WAYS[1:])


class LegFlight(NamedTuple):
    """A flight of a leg; times and energies count from when it was asked for."""

    controller: str
    way: WayToFly
    time: float  # until it has arrived [s]; infinite if it never does
    energy: float  # until then [J]; infinite likewise
    times: Array  # of the samples until then, (k,) [s]
    plant: Array  # states of the plant, (k, 17)
    drawn: Array  # energy, (k,) [J]


class LegPart(NamedTuple):
    """Time and energy of a part of a leg."""

    time: float  # [s]
    energy: float  # [J]


def ways_to_fly(question: Question, *, briskly: bool) -> tuple[WayToFly, ...]:
    """The ways in which a leg is tried; one that begins or ends in a cruise is flown at the cruise's airspeed."""
    ways = (*WAYS, *(BRISK_WAYS if briskly else ()))
    if CRUISE_END not in {question.start, question.end}:
        return ways
    paces = (GENTLE, BRISK) if briskly else (GENTLE,)
    return tuple(WayToFly(LegMode.FORWARD, question.airspeed, pace) for pace in paces)


def fly_way(question: Question, controller: str, way: WayToFly) -> LegFlight:
    """Fly the leg as a mission of one waypoint, on the truth, from a hover that has settled in the wind or a cruise.

    Args:
        question: The leg.
        controller: Of :data:`sitl.simulation.tuning.CONTROLLERS`.
        way: Upright or forward.

    Raises:
        SitlError: There is no such airframe.
    """
    craft = Craft(question.airframe, controller=controller, pace=way.pace)
    vehicle = Simulation(load(question.airframe).parameters, start=leg_start(question), tuning=craft.tuning)
    return until_there(set_out(question, vehicle, way), question, controller, way)


def leg_start(question: Question) -> Start:
    """The hover from which a leg is flown: where it begins, or so far before that it begins in a cruise."""
    north, west, up = question.place
    north -= RUN_UP if question.start == CRUISE_END else 0.0
    return Start(north=north, west=west, up=up, airborne=True, heading=-question.turn)


def leg_end(question: Question) -> Array:
    """The point where a leg ends, world NWU [m]."""
    north, west, up = question.place
    return np.array((north + question.distance, west, up + question.climb))


def set_out(question: Question, vehicle: Simulation, way: WayToFly, gusts: float = 0.0) -> Aircraft:
    """The aircraft as it begins the leg, after a hover that has settled, or in a cruise.

    Args:
        question: The leg, with its wind.
        vehicle: At :func:`leg_start`.
        way: Upright, forward, or as the vehicle chooses.
        gusts: Rms per axis [m/s].
    """
    settings = Settings(leg_mode=int(way.mode))
    if way.mode is not LegMode.NONE:
        settings = settings._replace(min_leg=0.0)
    upright = way.mode is LegMode.HOVER
    settings = settings._replace(hover_speed=way.speed) if upright else settings._replace(airspeed=way.speed)
    if way.pace == BRISK:  # what may not be flown forward is hovered as fast as that goes
        settings = settings._replace(hover_speed=FASTEST_HOVER)
    azimuth = math.degrees(math.atan2(question.cross_wind, -question.tail_wind))
    wind = math.hypot(question.tail_wind, question.cross_wind)
    air = WorldSettings(wind, azimuth, gusts, battery=1e9)
    aircraft = Aircraft(vehicle, STUDY_WORLD, Configuration(settings, vehicle.tuning, air), airborne=True)
    aircraft.advance(round(HOVERED_FIRST / PERIOD))
    end, missions = waypoint(*leg_end(question)), aircraft.autopilot.missions
    far = waypoint(*(leg_end(question) + np.array((RUN_OUT, 0.0, 0.0))))
    missions.load([far if CRUISE_END in {question.start, question.end} else end])
    missions.start()
    if question.start == CRUISE_END:
        _run_up(aircraft, question.place[0])
        missions.revise([far if question.end == CRUISE_END else end])
    return aircraft


def _run_up(aircraft: Aircraft, north: float) -> None:
    """Fly until the vehicle is so far north [m], or lost."""
    vehicle = aircraft.vehicle
    began = vehicle.time
    while vehicle.truth.body.position.x < north and vehicle.time - began < GIVEN_UP and vehicle.crash is None:
        aircraft.advance(SAMPLE_PERIODS)


def has_arrived(question: Question, body: Body) -> bool:
    """Whether a leg is done: it stands at its end, or passes it in the cruise."""
    end, p, v = leg_end(question), np.array(body.position), np.array(body.velocity)
    if question.end != CRUISE_END:
        return bool(np.linalg.norm(p - end) <= ARRIVED_WITHIN and np.linalg.norm(v) <= ARRIVED_SPEED)
    off = float(np.linalg.norm((p - end)[1:]))
    faster = float(np.linalg.norm(v - np.array(question.wind))) - question.airspeed
    return bool(p[0] >= end[0] and off <= CRUISES_WITHIN and abs(faster) <= CRUISES_SPEED)


def is_missed(question: Question, body: Body) -> bool:
    """Whether a leg that ends in a cruise has passed its end otherwise, for good."""
    return question.end == CRUISE_END and body.position.x > leg_end(question)[0] + CRUISES_WITHIN


def until_there(aircraft: Aircraft, question: Question, controller: str, way: WayToFly) -> LegFlight:
    """Fly a leg that was begun until it has arrived."""
    vehicle, rows = aircraft.vehicle, []
    began, spent, arrived = vehicle.time, vehicle.energy, False
    try:
        while not arrived and vehicle.time - began < GIVEN_UP and vehicle.crash is None:
            body, actuators, _ = vehicle.truth
            rows.append((vehicle.time - began, vehicle.energy - spent, *sum(body, ()), *actuators))
            arrived = has_arrived(question, body)
            if is_missed(question, body) and not arrived:
                break
            if not arrived:
                aircraft.advance(SAMPLE_PERIODS)
    except DivergedError:
        arrived = False
    table = np.array(rows)
    time, energy = (float(table[-1, 0]), float(table[-1, 1])) if arrived else (math.inf, math.inf)
    return LegFlight(controller, way, time, energy, table[:, 0], table[:, 2:], table[:, 1])


def fly_ways(question: Question, controllers: Iterable[str] = CONTROLLER_NAMES) -> list[LegFlight]:
    """The leg by each controller in each way; arguments as for :func:`fly_way`."""
    return [
        fly_way(question, controller, way)
        for controller in controllers
        for way in ways_to_fly(question, briskly=uses_indi(Tuning(controller=CONTROLLERS[controller])))
    ]


def stretches(times: Array, north: Array, drawn: Array, length: float) -> tuple[LegPart, LegPart, LegPart]:
    """Time and energy of the first metres of a leg, of what is between, and of the last metres.

    Args:
        times: Of samples, (k,) [s].
        north: Way along the leg at them, from its start, (k,) [m].
        drawn: Energy until then, (k,) [J].
        length: Of the leg [m].
    """
    edge = min(END_STRETCH, length / 3.0)
    marks = [int(np.argmax(north >= edge)), int(np.argmax(north >= length - edge)), len(times) - 1]
    parts, before = [], 0
    for mark in marks:
        parts.append(LegPart(float(times[mark] - times[before]), float(drawn[mark] - drawn[before])))
        before = mark
    return parts[0], parts[1], parts[2]
