"""Aims of stages: a point, a leg, an arc, a course or a velocity, each with its altitude."""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.flight_plans.flight_plan import EnuPoint
from sitl.autopilot.flight_plan.operator_view import AimKind

__all__ = ["PLAN_ORIGIN", "Aim", "AimKey", "away", "bearing_between", "qdr_point"]

PLAN_ORIGIN = EnuPoint(0.0, 0.0, 0.0)


class AimKey(NamedTuple):
    """Tells an aim from the one before it."""

    stage: int = 0  # stages entered so far
    part: int = 0  # of the stage: piece of its pattern, or turn at a bank


class Aim(NamedTuple):
    """The aim of a plan at this tick, east, north and up of the plan's origin.

    An aim with the ``key`` of the last is the same one, a little later.
    """

    kind: AimKind
    key: AimKey = AimKey()
    start: EnuPoint = PLAN_ORIGIN  # of a leg or a course
    end: EnuPoint = PLAN_ORIGIN  # of a leg; the point; the centre of an arc; the velocity [m/s]
    radius: float = 0.0  # of an arc [m], positive: clockwise
    climb: float | None = None  # vertical speed [m/s]; None: the altitude of the aim
    course: float = 0.0  # clockwise from north [rad]
    followers: tuple[EnuPoint, ...] = ()  # ends of the legs that follow without a stop
    name: str = ""  # of the waypoint
    turn_rate: float = 0.0  # of the heading, clockwise [rad/s]
    is_hovered: bool = False  # never flown forward


def away(a: EnuPoint, b: EnuPoint) -> float:
    """Level distance [m]."""
    return math.hypot(a.x - b.x, a.y - b.y)


def bearing_between(a: EnuPoint, b: EnuPoint) -> float:
    """Bearing of a point from another, clockwise from north [rad]."""
    return math.atan2(b.x - a.x, b.y - a.y)


def qdr_point(point: EnuPoint, qdr: float, distance: float) -> EnuPoint:
    """The point at a bearing [deg] and distance [m] of another."""
    turn = math.radians(qdr)
    return EnuPoint(point.x + distance * math.sin(turn), point.y + distance * math.cos(turn), point.z)
