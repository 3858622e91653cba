"""The operator's view of a flight plan: its status, blocks, waypoints and variables, and its events."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple, TypeAlias

from protocol.flight_plans.flight_plan import EnuPoint
from protocol.frames import Geodetic

__all__ = [
    "AimKind",
    "BlockButton",
    "BlockEntered",
    "ExceptionFired",
    "NamedWaypoint",
    "PlanEvent",
    "PlanRemark",
    "PlanStatus",
    "PresentLeg",
    "VariableSetting",
    "WaypointMoved",
]


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
