"""Hover or fly: the break-even distance, predicted and flown.

It is the distance at which a leg costs the same energy in the hover and in forward flight: shorter legs are hovered,
longer ones flown. It is predicted by :mod:`sitl.prediction.predictor`, and flown by
:mod:`sitl.lab.studies.break_even.break_even_flights`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import DecisionReason, Way
from sitl import Array
from sitl.lab.studies.break_even.break_even_flights import MAX_DISTANCE, MIN_DISTANCE, fly_leg, why_not_forward
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover

TRIED_DISTANCES = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 24)
FINE_DISTANCES = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 400)
LEG_CLIMBS = (-30.0, -10.0, 0.0, 10.0, 30.0)
LEG_WINDS = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
LEG_TURNS = (0.0, 0.5 * math.pi)  # from the heading before a leg to the leg's [rad]
DISTANCE_TOLERANCE = 0.25  # of a break-even distance [m]


class BreakEven(NamedTuple):
    """The break-even distance of legs of one kind."""

    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # [m/s]
    turn: float  # at their beginning [rad]
    distance: float  # from which on forward flight costs less [m]; infinite: not within 300 m
    barred: DecisionReason  # why shorter legs cannot be flown forward, if that sets the distance; else NONE


Saving = Callable[[float], float]  # energy of the hover less that of forward flight, over the distance [J]


def predicted(able: Abilities, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0) -> BreakEven:
    """The break-even distance by the prediction that the vehicle itself decides with.

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

    sought = BreakEven(climb, tail, cross, turn, math.inf, DecisionReason.ENERGY)
    return _search(saving, able, sought, TRIED_DISTANCES)


def flown(
    able: Abilities, airframe: str, climb: float, tail: float = 0.0, cross: float = 0.0, turn: float = 0.0
) -> BreakEven:
    """The break-even distance in flight, searched near the predicted one; arguments as for :func:`predicted`."""

    def saving(distance: float) -> float:
        leg = Leg(distance, climb, tail, cross, turn)
        hover, forward = (fly_leg(leg, way, able.airspeed, airframe).energy for way in (Way.HOVER, Way.FORWARD))
        return hover - forward

    expected = predicted(able, climb, tail, cross, turn)
    about = 40.0 if math.isinf(expected.distance) else expected.distance
    return _search(saving, able, expected._replace(distance=math.inf), about * np.array((0.6, 0.8, 1.0, 1.25, 1.6)))


def _search(saving: Saving, able: Abilities, sought: BreakEven, distances: Array) -> BreakEven:
    """The last change from loss to gain among the distances that may be flown, refined by bisection.

    By bisection, because a flight that never arrives costs infinite energy: methods that interpolate cannot use that.
    """
    allowed = [
        float(d) for d in FINE_DISTANCES if why_not_forward(Leg(float(d), sought.climb), able) is DecisionReason.NONE
    ]
    if not allowed:
        return sought._replace(distance=math.inf, barred=DecisionReason.TOO_STEEP)
    shortest = allowed[0]
    tried = sorted({shortest, *(float(d) for d in distances if d > shortest)})
    gains = [saving(d) > 0.0 for d in tried]
    if not gains[-1]:
        return sought._replace(distance=math.inf, barred=DecisionReason.ENERGY)
    losses = [i for i, gain in enumerate(gains) if not gain]
    if not losses:
        reason = why_not_forward(Leg(0.98 * shortest, sought.climb), able)
        return sought._replace(distance=shortest, barred=reason)
    low, high = tried[losses[-1]], tried[losses[-1] + 1]
    while high - low > DISTANCE_TOLERANCE:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if saving(middle) > 0.0 else (middle, high)
    return sought._replace(distance=0.5 * (low + high), barred=DecisionReason.NONE)


def table(able: Abilities) -> list[BreakEven]:
    """Predicted break-evens for every climb and tail wind, for legs straight ahead and after a quarter turn."""
    return [predicted(able, climb, tail, turn=turn) for turn in LEG_TURNS for tail in LEG_WINDS for climb in LEG_CLIMBS]
