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

from sitl.autopilot.legs import edge_on, leg_airspeeds, leg_reference
from sitl.autopilot.point_mass import Body, LinearHover, alignment, fly_hover, fly_wing, held
from sitl.control.reference import Point, hover_at
from sitl.design.forward import sight_gains
from sitl.design.lqr import hover_gains
from sitl.design.zero_moment import zero_moment_gains
from sitl.laws.path import LEG, Path
from sitl.model.airframe import Airframe
from sitl.vehicle import STOP_SPEED, Tuning
from sitl.watch import DWELL, SETTLED_SHARE, WINDY

ACCEPTANCE = 0.5  # a leg ends this near its point [m]
LEAST_PROGRESS = 2.0  # over the ground, less is no way to fly [m/s]
HIGH = 100.0  # of a leg whose height is not known [m]
STEEPEST_CLIMB, STEEPEST_DESCENT = 1.0, 0.35  # slope of a leg on the wing
LEAST_HEIGHT = 3.0  # both ends of a leg on the wing are at least so high [m]
LATE, UNASKED, UNABLE = 1e9, 1e12, 1e15  # what being late, not as asked, or not possible counts for [J]


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
    if math.hypot(leg.tail_wind, leg.cross_wind) > WINDY:
        target = -start
        path = Path(LEG, target, target, 0.0, STOP_SPEED, True, 0.0, 0.0)
        heading = -leg.turn
        return Prediction(*fly_wing(wind, path, body, DWELL, learnt, heading, heading, ACCEPTANCE, True, True, True))
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
    return Prediction(*fly_wing(np.array(wind), path, body, waiting, learnt, 0.0, stand, ACCEPTANCE, begin, end, False))


def _as_flown(leg: Leg, airspeed: float, wind: Point, *, end: bool) -> tuple[Path, float]:
    """The path that the autopilot makes of a leg, in the leg's frame, and the heading it is left to hover at."""
    height = leg.height if math.isfinite(leg.height) else HIGH
    start, stop = (0.0, 0.0, height + max(-leg.climb, 0.0)), (leg.distance, 0.0, height + max(leg.climb, 0.0))
    if end:
        airspeed = leg_airspeeds([start, stop], airspeed, wind)[0]
    route = leg_reference(start, stop, hover_at(stop, 0.0, 0.0), airspeed, stop=end).route
    level, low = (0.0, 0.0) if route is None else (route.level, route.low)
    origin, target = np.zeros(3), np.array((leg.distance, 0.0, leg.climb))
    return Path(LEG, origin, target, 0.0, airspeed, end, level, low), edge_on(0.0, wind)


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
    following = dict.fromkeys(_State, 0.0)  # least cost of what follows, by the state before it
    choice: list[dict[_State, _State]] = []
    for i in reversed(range(len(legs))):
        best: dict[_State, tuple[float, _State]] = {}
        for before in _State:
            after = _State.BEGUN if before is _State.HOVER else _State.THROUGH
            upright = _hover_cost(i, legs, abilities, hover[i], barred[i], asked[i], before) + following[_State.HOVER]
            wing = _wing_cost(i, legs, abilities, barred[i], asked[i], before) + following[after]
            best[before] = (wing, after) if wing < upright else (upright, _State.HOVER)
        following = {before: cost for before, (cost, _) in best.items()}
        choice.insert(0, {before: after for before, (_, after) in best.items()})
    states = [_State.THROUGH if flying else _State.HOVER]
    for chosen in choice:
        states.append(chosen[states[-1]])
    ways = [state is not _State.HOVER for state in states]
    return [_decision(i, legs, abilities, hover[i], barred[i], asked[i], ways) for i in range(len(legs))]


class _State(IntEnum):
    """How a leg was flown: what the next one begins with."""

    HOVER = 0
    BEGUN = 1  # on the wing, from the hover
    THROUGH = 2  # on the wing all along


def _barred(leg: Leg, abilities: Abilities, least_leg: float) -> Why:
    why = forbidden(leg, abilities)
    if why is Why.NONE and leg.distance < least_leg:
        return Why.TOO_SHORT
    return why


@lru_cache(maxsize=4096)
def _forward(leg: Leg, abilities: Abilities, *, begin: bool, end: bool) -> Prediction:
    return predict_forward(leg, abilities, begin=begin, end=end)


def _wing_cost(i: int, legs: Sequence[Leg], abilities: Abilities, barred: Why, asked: Way, before: _State) -> float:
    """Cost of leg i on the wing, with the transition that begins it; that to the hover only if it is the last."""
    if barred is not Why.NONE or asked is Way.HOVER:
        return math.inf
    taken = _forward(legs[i], abilities, begin=before is _State.HOVER, end=i + 1 == len(legs))
    return min(taken.energy, UNABLE) + (LATE if _is_late(taken, abilities) else 0.0)


def _hover_cost(
    i: int, legs: Sequence[Leg], abilities: Abilities, hover: Prediction, barred: Why, asked: Way, before: _State
) -> float:
    """Cost of leg i upright, with the stop that ends the leg before it if that was flown on the wing."""
    cost = min(hover.energy, UNABLE) + (LATE if _is_late(hover, abilities) else 0.0)
    if before is not _State.HOVER:
        cost += _stop(legs[max(i - 1, 0)], abilities, begin=before is _State.BEGUN)
    return cost + (UNASKED if asked is Way.FORWARD and barred is Why.NONE else 0.0)


def _stop(leg: Leg, abilities: Abilities, *, begin: bool) -> float:
    """What ending a leg in the hover costs over flying on; it may make the leg late."""
    whole, without = (_forward(leg, abilities, begin=begin, end=end) for end in (True, False))
    if math.isinf(whole.energy):
        return UNABLE
    late = _is_late(whole, abilities) and not _is_late(without, abilities)
    return whole.energy - without.energy + (LATE if late else 0.0)


def _is_late(taken: Prediction, abilities: Abilities) -> bool:
    return 0.0 < abilities.deadline < taken.time


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
