"""Hover or fly? The time and energy a leg takes either way, and the choice between them.

This is the report's question: to reach a point, is it better to stay upright or to tip over? Both ways are predicted in
quasi-steady flight on the airframe's own trims: the hover at the speed its velocity governor leaves in the wind; the
wing through alignment, acceleration, cruise, the climbing stop and the descent that follows it. Energy is that of the
propeller shafts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sitl.design.forward import sight_gains
from sitl.design.trim import balance
from sitl.kernels.parameters import Airframe, Array

POINTS = 60  # of every integral over speed
ACCEPTANCE = 0.5  # a leg ends this near its point [m]
K_PD = 1.5  # of the zero-moment law: force per m/s [N s/m]
CLIMB, DESCENT = 2.5, 2.0  # vertical speeds of the hover's governor [m/s]
START = 0.8  # the hover takes this long to get going [s]
ALIGN = 0.5  # dwell time of the alignment [s]
TURN_RATE = 0.8  # of the alignment, on average [rad/s]
SETTLE = 1.5  # from upright at the end to at rest within acceptance [s]
SINK = 1.8  # after the climbing stop [m/s]
STEEPEST_CLIMB, STEEPEST_DESCENT = 1.0, 0.35  # slope of a leg on the wing
LEAST_HEIGHT = 3.0  # both ends of a leg on the wing are at least so high [m]
SLOWEST, FASTEST = 7.0, 22.0  # airspeeds of the cruise [m/s]


class Way(IntEnum):
    """DARKO_WAY."""

    NONE = 0
    HOVER = 1
    FORWARD = 2


class Why(IntEnum):
    """DARKO_DECISION_REASON."""

    NONE = 0
    ENERGY = 1
    DEADLINE = 2
    COMMAND = 3
    TOO_SHORT = 4
    TOO_STEEP = 5
    NO_TRIM = 6
    TOO_LOW = 7
    WIND = 8


class Leg(NamedTuple):
    """One straight leg in a steady wind."""

    distance: float  # horizontal [m]
    climb: float  # altitude gained [m]
    tail_wind: float = 0.0  # [m/s]
    cross_wind: float = 0.0  # [m/s]
    turn: float = 0.0  # from the present heading to the leg's [rad]
    height: float = math.inf  # of its lower end above the ground [m]


class Prediction(NamedTuple):
    """What one way of flying a leg takes; infinite where it cannot be flown so."""

    time: float  # [s]
    energy: float  # at the shafts [J]


IMPOSSIBLE = Prediction(math.inf, math.inf)


class Decision(NamedTuple):
    """The choice for one leg, with both predictions."""

    leg: Leg
    hover: Prediction
    forward: Prediction
    way: Way
    why: Why


class Abilities(NamedTuple):
    """What the vehicle can do, as the prediction needs it."""

    airframe: Airframe
    can_fly_forward: bool
    hover_speed: float  # [m/s]
    airspeed: float  # of the cruise [m/s]
    deadline: float = 0.0  # of a leg [s]; 0: none


def power(a: Airframe, airspeed: Array, accel: Array, climb: Array) -> Array:
    """Shaft power of quasi-steady flight, in the common shape [W].

    Args:
        a: The airframe.
        airspeed: [m/s].
        accel: Along the path [m/s2].
        climb: Angle of the path above the horizon [rad].
    """
    _, _, _, omega, _ = balance(a, airspeed, accel, climb)
    return np.asarray(2.0 * a.k_m * np.clip(omega, a.omega_min, a.omega_max) ** 3)


def predict_hover(leg: Leg, abilities: Abilities) -> Prediction:
    """The leg flown upright."""
    speed = _hover_speed(abilities, leg.tail_wind, leg.cross_wind)
    if speed < 0.1 and leg.distance > ACCEPTANCE:
        return IMPOSSIBLE
    level = _governed_time(leg.distance, speed)
    rise = _governed_time(abs(leg.climb), CLIMB if leg.climb > 0.0 else DESCENT)
    time = START + max(level, rise)
    moving = math.hypot(speed - leg.tail_wind, leg.cross_wind)
    still = math.hypot(leg.tail_wind, leg.cross_wind)
    watts = power(abilities.airframe, np.array([moving, still]), np.zeros(2), np.zeros(2))
    return Prediction(time, float(watts[0] * level + watts[1] * (time - level)))


def _governed_time(distance: float, speed: float) -> float:
    """Time over a distance down to the acceptance, under the velocity governor [s]."""
    if distance <= ACCEPTANCE:
        return 0.0
    e = np.geomspace(ACCEPTANCE, distance, POINTS)
    return float(np.trapezoid((1.0 + (e / speed) ** 4) ** 0.25 / e, e))


def _hover_speed(abilities: Abilities, tail: float, cross: float) -> float:
    """Ground speed that the governor's force leaves against the air's resistance [m/s]."""
    a = abilities.airframe
    v = np.linspace(0.0, abilities.hover_speed + 2.0, 200)
    airspeed = np.hypot(v - tail, cross)
    theta, _, _, _, _ = balance(a, airspeed, np.zeros_like(v), np.zeros_like(v))
    drag = a.m * a.g / np.tan(theta) * (v - tail) / np.maximum(airspeed, 1e-9)
    spare = K_PD * (abilities.hover_speed - v) - drag
    if spare[0] <= 0.0:
        return 0.0
    held = int(np.argmax(spare < 0.0)) or len(v) - 1
    return float(min(v[held], abilities.hover_speed + 1.0))


def predict_forward(leg: Leg, abilities: Abilities, *, begin: bool = True, end: bool = True) -> Prediction:
    """The leg flown on the wing.

    Args:
        leg: The leg.
        abilities: What the vehicle can do.
        begin: Whether it begins in the hover (else already on the wing).
        end: Whether it ends in the hover.
    """
    # Across a wind a share of the airspeed is needed to stay on the leg.
    ahead = abilities.airspeed**2 - leg.cross_wind**2
    cruise = math.sqrt(ahead) + leg.tail_wind if ahead > 0.0 else 0.0
    if cruise < 2.0:
        return IMPOSSIBLE
    slope = math.atan2(leg.climb, max(leg.distance, 1.0))
    low, high = 0.0, cruise
    peak = high
    if _ends(leg, abilities, peak, cruise, slope, begin=begin, end=end)[1] > leg.distance:
        for _ in range(20):  # too short to reach the cruise: accelerate to less
            peak = 0.5 * (low + high)
            room = _ends(leg, abilities, peak, cruise, slope, begin=begin, end=end)[1] <= leg.distance
            low, high = (peak, high) if room else (low, peak)
    time, used, energy = _ends(leg, abilities, peak, cruise, slope, begin=begin, end=end)
    airspeed = math.hypot(peak - leg.tail_wind, leg.cross_wind)
    watts = float(power(abilities.airframe, np.array([airspeed]), np.zeros(1), np.array([slope]))[0])
    rest = max(leg.distance - used, 0.0) / peak
    return Prediction(time + rest, energy + watts * rest)


def _ends(
    leg: Leg, abilities: Abilities, peak: float, cruise: float, slope: float, *, begin: bool, end: bool
) -> tuple[float, float, float]:
    """Time, distance and energy of what is not cruise."""
    time = distance = energy = 0.0
    a, gains = abilities.airframe, sight_gains().guidance
    still = math.hypot(leg.tail_wind, leg.cross_wind)
    hovering = float(power(a, np.array([still]), np.zeros(1), np.zeros(1))[0])
    v = np.linspace(0.0, peak, POINTS)
    airspeed = np.hypot(v - leg.tail_wind, leg.cross_wind)
    if begin:
        rate = np.maximum(np.minimum(gains.gain, gains.k_v * (cruise - v)), 0.3)
        waiting = ALIGN + abs(leg.turn) / TURN_RATE + 0.3
        watts = power(a, airspeed, rate, np.full(POINTS, slope))
        time += waiting + float(np.trapezoid(1.0 / rate, v))
        distance += float(np.trapezoid(v / rate, v))
        energy += hovering * waiting + float(np.trapezoid(watts / rate, v))
    if end:
        rate = np.minimum(np.interp(airspeed, gains.brake_air, gains.brake_rate), np.maximum(gains.near * v, 0.4))
        rise = np.interp(airspeed, gains.brake_air, gains.brake_climb)
        watts = power(a, airspeed, -rate, np.arctan2(rise, np.maximum(v, 0.5)))
        sinking = max(float(np.trapezoid(rise / rate, v)) - 1.0, 0.0) / SINK
        time += float(np.trapezoid(1.0 / rate, v)) + sinking + SETTLE
        distance += float(np.trapezoid(v / rate, v))
        energy += float(np.trapezoid(watts / rate, v)) + hovering * (sinking + SETTLE)
    return time, distance, energy


def forbidden(leg: Leg, abilities: Abilities) -> Why:
    """Why a leg cannot be flown on the wing, or NONE."""
    if not abilities.can_fly_forward:
        return Why.NO_TRIM
    if leg.height < LEAST_HEIGHT:
        return Why.TOO_LOW
    slope = leg.climb / max(leg.distance, 1e-6)
    if slope > STEEPEST_CLIMB or slope < -STEEPEST_DESCENT:
        return Why.TOO_STEEP
    return Why.NONE


def decide(leg: Leg, abilities: Abilities, least_leg: float, asked: Way = Way.NONE) -> Decision:
    """Choose the way of flying one leg from hover to hover.

    Args:
        leg: The leg.
        abilities: What the vehicle can do.
        least_leg: Shorter legs are never flown on the wing [m].
        asked: The way somebody asked for; followed unless it is impossible.
    """
    return plan([leg], abilities, least_leg, [asked])[0]


def plan(
    legs: Sequence[Leg], abilities: Abilities, least_leg: float, asked: Sequence[Way], *, flying: bool = False
) -> list[Decision]:
    """Choose the ways of consecutive legs without a stop between them: those flown in a row share their transitions.

    Dynamic programming over the two ways; exact for the predictions made.

    Args:
        legs: The legs.
        abilities: What the vehicle can do.
        least_leg: Shorter legs are never begun on the wing [m].
        asked: The way somebody asked for, leg by leg.
        flying: Whether the vehicle is on the wing already.
    """
    hover = [predict_hover(leg, abilities) for leg in legs]
    barred = [_barred(leg, abilities, least_leg) for leg in legs]
    count = len(legs)
    following: dict[bool, float] = {False: 0.0, True: 0.0}  # by whether the leg before was flown forward
    choice: list[dict[bool, bool]] = [{} for _ in legs]
    for i in reversed(range(count)):
        best: dict[bool, float] = {}
        for before in (False, True):
            options = {
                forward: _cost(i, legs, abilities, hover[i], barred[i], asked[i], forward=forward, flying=before)
                + following[forward]
                for forward in (False, True)
            }
            choice[i][before] = options[True] < options[False]
            best[before] = options[choice[i][before]]
        following = best
    ways, begun = [], flying
    for i in range(count):
        flying = choice[i][flying]
        ways.append(flying)
    return [_decision(i, legs, abilities, hover[i], barred[i], asked[i], [begun, *ways]) for i in range(count)]


def _barred(leg: Leg, abilities: Abilities, least_leg: float) -> Why:
    why = forbidden(leg, abilities)
    if why is Why.NONE and leg.distance < least_leg:
        return Why.TOO_SHORT
    return why


@lru_cache(maxsize=4096)
def _forward(leg: Leg, abilities: Abilities, *, begin: bool, end: bool) -> Prediction:
    return predict_forward(leg, abilities, begin=begin, end=end)


def _cost(
    i: int,
    legs: Sequence[Leg],
    abilities: Abilities,
    hover: Prediction,
    barred: Why,
    asked: Way,
    *,
    forward: bool,
    flying: bool,
) -> float:
    """Energy of leg i one way, with the transition that begins it; a hover leg after a forward one pays its stop."""
    if forward:
        if barred is not Why.NONE or asked is Way.HOVER:
            return math.inf
        last = i + 1 == len(legs)
        taken = _forward(legs[i], abilities, begin=not flying, end=last)
    else:
        stop = 0.0
        if flying:
            braked = legs[max(i - 1, 0)]
            whole, without = (_forward(braked, abilities, begin=False, end=end).energy for end in (True, False))
            stop = whole - without
        taken = hover._replace(energy=hover.energy + stop)
        if asked is Way.FORWARD and barred is Why.NONE:
            return 1e12 + taken.energy  # only if nothing else is possible
    late = 1e9 if abilities.deadline > 0.0 and taken.time > abilities.deadline else 0.0
    return min(taken.energy, 1e15) + late


def _decision(
    i: int,
    legs: Sequence[Leg],
    abilities: Abilities,
    hover: Prediction,
    barred: Why,
    asked: Way,
    ways: Sequence[bool],  # what was before the first leg, then each leg's
) -> Decision:
    forward = IMPOSSIBLE
    if barred in {Why.NONE, Why.TOO_SHORT} and abilities.can_fly_forward:
        end = i + 1 == len(legs) or not ways[i + 2]
        forward = _forward(legs[i], abilities, begin=not ways[i], end=end)
    way = Way.FORWARD if ways[i + 1] else Way.HOVER
    return Decision(legs[i], hover, forward, way, _why(way, hover, forward, barred, asked, abilities.deadline))


def _why(way: Way, hover: Prediction, forward: Prediction, barred: Why, asked: Way, deadline: float) -> Why:
    if way is Way.HOVER and barred is not Why.NONE:
        return barred
    if asked is way:
        return Why.COMMAND
    mine, other = (hover, forward) if way is Way.HOVER else (forward, hover)
    if math.isinf(other.time):
        return Why.WIND
    if mine.energy > other.energy and deadline > 0.0:
        return Why.DEADLINE
    return Why.ENERGY
