"""Hover or fly? The time and energy a leg takes either way, and the choice between them.

This is the report's question: to reach a point, is it better to stay upright or to tip over? Both ways are flown
beforehand by a point mass (:mod:`sitl.autopilot.point_mass`) under the laws' own guidance: upright at the speed that
the governor leaves in the wind; on the wing through alignment, acceleration, cruise, the climbing stop and what is
left to settle. Energy is that of the propeller shafts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sitl.autopilot.guidance import Setpoint, Vector
from sitl.autopilot.point_mass import Body, LinearHover, alignment, fly_hover, fly_wing, held
from sitl.design.forward import sight_gains
from sitl.design.lqr import hover_gains
from sitl.design.zero_moment import zero_moment_gains
from sitl.kernels.parameters import Airframe
from sitl.laws.path import LEG, Path
from sitl.vehicle import Tuning
from sitl.watch import DWELL, SETTLED_SHARE

ACCEPTANCE = 0.5  # a leg ends this near its point [m]
LEAST_PROGRESS = 2.0  # over the ground, less is no way to fly [m/s]
HIGH = 100.0  # of a leg whose height is not known [m]
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


def predict_hover(leg: Leg, abilities: Abilities) -> Prediction:
    """The leg flown upright, the heading kept as it is."""
    start = np.array((-leg.distance, 0.0, -leg.climb))
    wind = np.array((leg.tail_wind, leg.cross_wind, 0.0))
    body, speed = _body(abilities.airframe), abilities.hover_speed
    learnt = held(wind, -leg.turn, abilities.airframe)
    return Prediction(*fly_hover(start, np.zeros(3), wind, -leg.turn, learnt, speed, body, ACCEPTANCE, True))


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
    if ahead <= 0.0 or math.sqrt(ahead) + leg.tail_wind < LEAST_PROGRESS:
        return IMPOSSIBLE
    body, wind = _body(abilities.airframe), (leg.tail_wind, leg.cross_wind, 0.0)
    path, stand = _as_flown(leg, abilities.airspeed, wind, end=end)
    crab = math.atan2(-leg.cross_wind, math.sqrt(max(path.airspeed**2 - leg.cross_wind**2, 0.0)))
    waiting = DWELL + alignment(leg.turn + crab, body.turn)
    learnt = held(np.array(wind), -leg.turn, abilities.airframe)
    return Prediction(*fly_wing(np.array(wind), path, body, waiting, learnt, stand, ACCEPTANCE, begin, end))


def _as_flown(leg: Leg, airspeed: float, wind: Vector, *, end: bool) -> tuple[Path, float]:
    """The path that the autopilot makes of a leg, in the leg's frame, and the heading it is left to hover at."""
    from sitl.autopilot import legs  # noqa: PLC0415 - legs takes its limits from here

    height = leg.height if math.isfinite(leg.height) else HIGH
    start, stop = (0.0, 0.0, height + max(-leg.climb, 0.0)), (leg.distance, 0.0, height + max(leg.climb, 0.0))
    if end:
        airspeed = legs.leg_airspeeds([start, stop], airspeed, wind)[0]
    route = legs.leg_setpoint(start, stop, Setpoint(stop, 0.0, 0.0), airspeed, stop=end).route
    level, low = (0.0, 0.0) if route is None else (route.level, route.low)
    origin, target = np.zeros(3), np.array((leg.distance, 0.0, leg.climb))
    return Path(LEG, origin, target, 0.0, airspeed, end, level, low), legs.edge_on(0.0, wind)


@lru_cache(maxsize=8)
def _body(a: Airframe) -> Body:
    """An airframe under its laws as a point mass: the attitude is in equilibrium."""
    linear, zero_moment, sight, tuning = hover_gains(a), zero_moment_gains(a), sight_gains(), Tuning()
    K, K_i = linear.K, linear.K_i
    pitch = 2.0 * math.sqrt(2.0) * a.g / K[2, 7]  # level acceleration of an attitude the elevons hold
    heave = 2.0 * (1.0 - a.S_ratio * a.C_d0) / a.m
    return Body(
        airframe=a,
        guidance=sight.guidance,
        governor=zero_moment.governor,
        linear=LinearHover(
            k_p=float(pitch * K[2, 0]),
            k_v=float(pitch * K[2, 3]),
            k_z=float(heave * K[0, 2]),
            k_vz=float(heave * K[0, 5]),
            k_i=float(pitch * K_i[2, 0]),
            k_iz=float(heave * K_i[0, 2]),
            lead=linear.lead,
            integral_limit=linear.integral_limit,
            reach=linear.reach,
            S=linear.S,
            v_enter=tuning.v_enter,
            v_leave=tuning.v_leave,
            settled=SETTLED_SHARE * tuning.v_enter,
        ),
        lag=float(1.0 / sight.rate[1]),  # the rest is fed forward
        hover_lag=2.0 * zero_moment.zeta / zero_moment.lam,
        k_delta=zero_moment.k_delta,
        lam=zero_moment.lam,
        turn=zero_moment.k_q,
        blend_from=sight.blend_from,
        blend_to=sight.blend_to,
    )


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
