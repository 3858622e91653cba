"""Rows of legs flown forward without a stop: how fast each is flown, and where the turns at its ends begin."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

from sitl.control.reference import Point
from sitl.guidance.leg_speeds import MAX_CORNER_SHARE, corner_lead, leg_airspeeds, speed_along
from sitl.model.arithmetic import sine_cosine

NO_LENGTH = 1e-3  # of a leg before the first where the turn begins with that [m]


class Leg(NamedTuple):
    """One straight leg in a steady wind."""

    distance: float  # horizontal [m]
    climb: float  # altitude gained [m]
    tail_wind: float = 0.0  # [m/s]
    cross_wind: float = 0.0  # to the left of the leg [m/s]
    turn: float = 0.0  # from the present heading to the leg's, positive to the left [rad]
    height: float = math.inf  # of its lower end above the ground [m]


class FlyingOn(NamedTuple):
    """The flight of one leg of a row, which does not begin or does not end at rest."""

    airspeed: float  # [m/s]
    entry: float = math.inf  # airspeed as it begins, if that is less [m/s]
    exit: float = math.inf  # and as the turn at its end begins [m/s]
    lead: float = 0.0  # so far before its beginning the turn to it begins [m]
    early: float = 0.0  # so far before its end the turn to the next one begins [m]


def flying_on(
    legs: Sequence[Leg], airspeed: float, *, lead: float | None = None, is_long: bool = False
) -> list[FlyingOn]:
    """The flight of a row of legs, as the autopilot plans it.

    Args:
        legs: The legs; the last one ends at rest.
        airspeed: Wanted [m/s].
        lead: So far before its beginning the turn to the first leg begins, at most [m]; None: that begins at rest.
        is_long: Whether the row goes on, so that no stop bounds its speeds.
    """
    points, wind = _points(legs, lead), (legs[0].tail_wind, legs[0].cross_wind, 0.0)
    speeds = [airspeed] * (len(points) - 1) if is_long else leg_airspeeds(points, airspeed, wind)
    corners = [min(pair) for pair in itertools.pairwise(speeds)]  # slowed down to before a slower leg
    leads = [
        corner_lead(start, corner, after, speed_along(start, corner, speed, wind))
        for start, corner, after, speed in zip(points, points[1:], points[2:], corners, strict=False)
    ]
    if lead is None:
        leads.insert(0, 0.0)
        corners.insert(0, math.inf)
    columns = (speeds[-len(legs) :], corners, [*corners[1:], math.inf], leads, [*leads[1:], 0.0])
    return [FlyingOn(*one) for one in zip(*columns, strict=True)]


def _points(legs: Sequence[Leg], lead: float | None) -> list[Point]:
    """Ends of the legs in the frame of the first one, with a point before it that leaves as much for its turn."""
    points: list[Point] = [(0.0, 0.0, 0.0)]
    if lead is not None:
        sine, cosine = sine_cosine(-legs[0].turn)
        before = max(lead / MAX_CORNER_SHARE, NO_LENGTH)
        points.insert(0, (-before * cosine, -before * sine, 0.0))
    course = 0.0
    for i, leg in enumerate(legs):
        course += leg.turn if i else 0.0
        sine, cosine = sine_cosine(course)
        x, y, z = points[-1]
        points.append((x + leg.distance * cosine, y + leg.distance * sine, z + leg.climb))
    return points
