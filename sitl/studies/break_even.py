"""Hover or fly: the break-even distance, predicted and flown.

It is where the energy of a leg upright and its energy in forward flight are the same: shorter legs are hovered, longer
ones flown. It is predicted by :mod:`sitl.prediction.predictor`, and flown by :mod:`sitl.studies.break_even_flights`.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from protocol.dialect.vocabulary import DecisionReason, Way
from sitl.model.airframe import Array
from sitl.prediction.predictor import Abilities, Leg, predict_forward, predict_hover
from sitl.studies.break_even_flights import MAX_DISTANCE, MIN_DISTANCE, barred, fly_leg

DISTANCES = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 24)
NARROW = np.geomspace(MIN_DISTANCE, MAX_DISTANCE, 400)
CLIMBS = (-30.0, -10.0, 0.0, 10.0, 30.0)
WINDS = (-4.0, -3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0)
TURNS = (0.0, 0.5 * math.pi)  # from the heading before a leg to the leg's [rad]
TOLERANCE = 0.25  # of a break-even distance that is sought [m]


class Cell(NamedTuple):
    """The break-even distance of legs of one kind."""

    climb: float  # [m]
    tail_wind: float  # [m/s]
    cross_wind: float  # [m/s]
    turn: float  # at their beginning [rad]
    distance: float  # from which on forward flight costs less [m]; infinite: not within 300 m
    barred: DecisionReason  # why forward flight is no choice for shorter legs, where that is what decides; else NONE


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
    while high - low > TOLERANCE:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if saving(middle) > 0.0 else (middle, high)
    return cell._replace(distance=0.5 * (low + high), barred=DecisionReason.NONE)


def table(able: Abilities) -> list[Cell]:
    """The predicted break-even of every climb in every wind along the leg, begun ahead and turned away."""
    return [predicted(able, climb, tail, turn=turn) for turn in TURNS for tail in WINDS for climb in CLIMBS]
