"""The stages of a block, one class for each element; the fields are its attributes.

Attributes that every stage of movement has: ``vmode`` and what it needs, ``until``, calls before and after each tick.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar

from protocol.flight_plans.attributes import Kind, NameUse, attribute, required
from protocol.flight_plans.expressions.expression_tree import Expression, Script, StoredIn
from protocol.flight_plans.place import NOWHERE, Place

__all__ = [
    "STAGE_CLASSES",
    "VERTICAL_MODES",
    "AttitudeStage",
    "CallOnceStage",
    "CallStage",
    "CircleStage",
    "DerouteStage",
    "EightStage",
    "FollowStage",
    "ForStage",
    "GoStage",
    "GuidedStage",
    "HeadingStage",
    "HomeStage",
    "ManualStage",
    "OvalStage",
    "PathStage",
    "PlanException",
    "ReturnStage",
    "SetStage",
    "Stage",
    "StayStage",
    "SurveyStage",
    "WhileStage",
    "XyzStage",
]

VERTICAL_MODES = ("alt", "climb", "throttle", "glide", "xyz")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanElement:
    """Fields of all elements: a place, and the comments in front of them and at their end."""

    place: Place = field(default=NOWHERE, compare=False)
    comments: tuple[str, ...] = ()
    last_comments: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage(PlanElement):
    """One stage."""

    tag: ClassVar[str] = ""
    absent: ClassVar[frozenset[str]] = frozenset()  # fields that the element has no attribute for


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanException(PlanElement):
    """A condition under which the plan jumps to a block."""

    tag: ClassVar[str] = "exception"
    cond: Expression = required(Kind.EXPRESSION)
    deroute: NameUse = required(Kind.BLOCK)


@dataclass(frozen=True, slots=True, kw_only=True)
class _CallingStage(Stage):
    """With calls before and after the stage, and the names of a navigation pattern of the build."""

    pre_call: Script | None = attribute(Kind.SCRIPT)
    post_call: Script | None = attribute(Kind.SCRIPT)
    nav_type: str | None = attribute(Kind.TEXT)
    nav_params: str | None = attribute(Kind.TEXT)


@dataclass(frozen=True, slots=True, kw_only=True)
class _MovingStage(_CallingStage):
    """With a vertical mode."""

    vmode: str | None = attribute(Kind.CHOICE, choices=VERTICAL_MODES)
    alt: Expression | None = attribute(Kind.EXPRESSION)  # above sea [m]
    height: Expression | None = attribute(Kind.EXPRESSION)  # above the ground [m]
    climb: Expression | None = attribute(Kind.EXPRESSION)  # [m/s]
    throttle: Expression | None = attribute(Kind.EXPRESSION)  # 0..1
    pitch: Expression | None = attribute(Kind.EXPRESSION)  # [deg], or auto
    until: Expression | None = attribute(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class GoStage(_MovingStage):
    """Go to a waypoint."""

    tag: ClassVar[str] = "go"
    wp: NameUse = required(Kind.WAYPOINT)
    wp_qdr: Expression | None = attribute(Kind.EXPRESSION)  # bearing of the point from wp [deg]
    wp_dist: Expression | None = attribute(Kind.EXPRESSION)  # [m]
    from_wp: NameUse | None = attribute(Kind.WAYPOINT, name="from")
    from_qdr: Expression | None = attribute(Kind.EXPRESSION)
    from_dist: Expression | None = attribute(Kind.EXPRESSION)
    hmode: str | None = attribute(Kind.CHOICE, choices=("direct", "route"))
    approaching_time: Expression | None = attribute(Kind.EXPRESSION)  # [s], or CARROT
    exceeding_time: Expression | None = attribute(Kind.EXPRESSION)  # [s]


@dataclass(frozen=True, slots=True, kw_only=True)
class PathStage(_MovingStage):
    """Legs through several waypoints."""

    tag: ClassVar[str] = "path"
    absent: ClassVar[frozenset[str]] = frozenset({"pre_call", "post_call", "nav_type", "nav_params", "height", "until"})
    wpts: tuple[NameUse, ...] = required(Kind.WAYPOINTS)
    approaching_time: Expression | None = attribute(Kind.EXPRESSION)
    exceeding_time: Expression | None = attribute(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class StayStage(_MovingStage):
    """Hold a waypoint."""

    tag: ClassVar[str] = "stay"
    absent: ClassVar[frozenset[str]] = frozenset({"pitch"})
    wp: NameUse = required(Kind.WAYPOINT)


@dataclass(frozen=True, slots=True, kw_only=True)
class CircleStage(_MovingStage):
    """Circle about a waypoint."""

    tag: ClassVar[str] = "circle"
    wp: NameUse = required(Kind.WAYPOINT)
    wp_qdr: Expression | None = attribute(Kind.EXPRESSION)
    wp_dist: Expression | None = attribute(Kind.EXPRESSION)
    radius: Expression = required(Kind.EXPRESSION)  # [m], positive: clockwise


@dataclass(frozen=True, slots=True, kw_only=True)
class OvalStage(_MovingStage):
    """Two legs beside the line between two waypoints, with half a turn about each."""

    tag: ClassVar[str] = "oval"
    absent: ClassVar[frozenset[str]] = frozenset({"height", "nav_type", "nav_params"})
    p1: NameUse = required(Kind.WAYPOINT)
    p2: NameUse = required(Kind.WAYPOINT)
    radius: Expression = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class EightStage(_MovingStage):
    """A figure of eight about two waypoints."""

    tag: ClassVar[str] = "eight"
    absent: ClassVar[frozenset[str]] = frozenset({"height", "nav_type", "nav_params"})
    center: NameUse = required(Kind.WAYPOINT)
    turn_around: NameUse = required(Kind.WAYPOINT)
    radius: Expression = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingStage(_MovingStage):
    """Fly a course."""

    tag: ClassVar[str] = "heading"
    course: Expression = required(Kind.EXPRESSION)  # [deg]
    until: Expression | None = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class AttitudeStage(_MovingStage):
    """Hold a roll angle."""

    tag: ClassVar[str] = "attitude"
    roll: Expression = required(Kind.EXPRESSION)  # [deg]


@dataclass(frozen=True, slots=True, kw_only=True)
class ManualStage(_MovingStage):
    """Fly roll, pitch and yaw commands."""

    tag: ClassVar[str] = "manual"
    roll: Expression = required(Kind.EXPRESSION)
    yaw: Expression = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class XyzStage(Stage):
    """Move by the sticks within a radius."""

    tag: ClassVar[str] = "xyz"
    radius: Expression | None = attribute(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class FollowStage(_CallingStage):
    """Follow another aircraft."""

    tag: ClassVar[str] = "follow"
    ac_id: Expression = required(Kind.EXPRESSION)
    distance: Expression = required(Kind.EXPRESSION)
    height: Expression = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class SurveyStage(_CallingStage):
    """Sweep a rectangle."""

    tag: ClassVar[str] = "survey_rectangle"
    grid: Expression = required(Kind.EXPRESSION)  # between the lines [m]
    orientation: str | None = attribute(Kind.CHOICE, choices=("NS", "WE"))
    wp1: NameUse = required(Kind.WAYPOINT)
    wp2: NameUse = required(Kind.WAYPOINT)
    until: Expression | None = attribute(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidedStage(_CallingStage):
    """Fly set-points of the autopilot's guided mode."""

    tag: ClassVar[str] = "guided"
    commands: tuple[Expression, ...] = required(Kind.EXPRESSIONS)
    flags: Expression | None = attribute(Kind.EXPRESSION)
    until: Expression | None = attribute(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class HomeStage(Stage):
    """Return home and hold."""

    tag: ClassVar[str] = "home"


@dataclass(frozen=True, slots=True, kw_only=True)
class SetStage(Stage):
    """Store a value in a variable."""

    tag: ClassVar[str] = "set"
    var: StoredIn = required(Kind.TARGET)
    value: Expression = required(Kind.EXPRESSION)


@dataclass(frozen=True, slots=True, kw_only=True)
class CallStage(Stage):
    """Call a function every tick while it returns true."""

    tag: ClassVar[str] = "call"
    fun: Script = required(Kind.SCRIPT)
    until: Expression | None = attribute(Kind.EXPRESSION)
    loop: bool = attribute(Kind.FLAG, default=True)
    ends_tick: bool | None = attribute(Kind.FLAG, name="break")


@dataclass(frozen=True, slots=True, kw_only=True)
class CallOnceStage(Stage):
    """Call a function once."""

    tag: ClassVar[str] = "call_once"
    fun: Script = required(Kind.SCRIPT)
    ends_tick: bool | None = attribute(Kind.FLAG, name="break")


@dataclass(frozen=True, slots=True, kw_only=True)
class DerouteStage(Stage):
    """Jump to a block."""

    tag: ClassVar[str] = "deroute"
    block: NameUse = required(Kind.BLOCK)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnStage(Stage):
    """Jump back to where the last block was left."""

    tag: ClassVar[str] = "return"
    reset_stage: Expression | None = attribute(Kind.EXPRESSION)  # 1: to its first stage


@dataclass(frozen=True, slots=True, kw_only=True)
class WhileStage(Stage):
    """Repeat stages while a condition holds; without one for ever."""

    tag: ClassVar[str] = "while"
    cond: Expression | None = attribute(Kind.EXPRESSION)
    stages: tuple[Stage, ...] = ()
    exceptions: tuple[PlanException, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class ForStage(Stage):
    """Repeat stages while a counter goes from one number to another, both included."""

    tag: ClassVar[str] = "for"
    var: str = required(Kind.NAME)
    from_value: Expression = required(Kind.EXPRESSION, name="from")
    to_value: Expression = required(Kind.EXPRESSION, name="to")
    stages: tuple[Stage, ...] = ()
    exceptions: tuple[PlanException, ...] = ()


STAGE_CLASSES: dict[str, type[Stage]] = {
    stage.tag: stage
    for stage in (
        *(GoStage, PathStage, StayStage, CircleStage, OvalStage, EightStage, HeadingStage, AttitudeStage, ManualStage),
        *(XyzStage, FollowStage, SurveyStage, GuidedStage, HomeStage, SetStage, CallStage, CallOnceStage),
        *(DerouteStage, ReturnStage, WhileStage, ForStage),
    )
}
