"""Aims of stages, and the operator's view of a flight plan."""

from __future__ import annotations

import math
from enum import Enum
from typing import NamedTuple, TypeAlias

from protocol.flight_plans.flight_plan import EnuPoint
from protocol.frames import Geodetic

# Aims of stages: a point, a leg, an arc, a course or a velocity, each with its altitude.

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


# The operator's view of a flight plan: its status, blocks, waypoints and variables, and its events.


class AimKind(Enum):
    """Kind of the aim that a plan flies."""

    NOTHING = "nothing"  # no stage has asked for anything yet
    POINT = "point"
    LEG = "leg"
    ARC = "arc"
    COURSE = "course"
    VELOCITY = "velocity"


class BlockButton(NamedTuple):
    """A block as the operator may jump to it."""

    number: int
    name: str
    strip_button: str | None
    strip_icon: str | None
    key: str | None
    group: str | None
    description: str | None
    locked: str  # why it is not flown; empty if it is


class PlanStatus(NamedTuple):
    """Progress of a plan: block, stage and their times."""

    block: int
    block_name: str
    stage: int
    stage_text: str  # its element, such as ``go wp=p1``
    line: int  # of the stage in the file
    block_time: float  # [s]
    stage_time: float  # [s]
    flight_time: float  # [s]
    aim: AimKind


class NamedWaypoint(NamedTuple):
    """A waypoint where it is now."""

    number: int
    name: str
    position: EnuPoint  # of the plan's origin
    place: Geodetic  # at the altitude of the vehicle's world
    is_shown: bool


class VariableSetting(NamedTuple):
    """A variable of the plan, as a setting."""

    name: str
    label: str
    value: float
    low: float | None
    high: float | None
    step: float | None
    unit: str | None


class PresentLeg(NamedTuple):
    """The aim flown now, as a leg or a circle for stations that know missions only."""

    kind: AimKind
    start: Geodetic
    end: Geodetic  # or the centre of an arc
    radius: float  # of an arc [m], positive: clockwise; else 0
    name: str  # of the waypoint it leads to; empty if it has none


class ExceptionFired(NamedTuple):
    """An exception ended a block."""

    time: float  # [s]
    text: str  # its condition
    line: int
    from_block: str
    to_block: str
    values: str = ""  # that the condition saw


class BlockEntered(NamedTuple):
    """Another block is in force."""

    time: float  # [s]
    number: int
    name: str
    cause: str = ""  # empty where an exception told it just before, or the flight begins
    line: int = 0  # in the file of the plan, of what led there


class WaypointMoved(NamedTuple):
    """A waypoint is elsewhere."""

    time: float  # [s]
    name: str
    position: EnuPoint


class PlanRemark(NamedTuple):
    """Something that cannot be flown or evaluated, in words."""

    time: float  # [s]
    text: str


PlanEvent: TypeAlias = ExceptionFired | BlockEntered | WaypointMoved | PlanRemark
