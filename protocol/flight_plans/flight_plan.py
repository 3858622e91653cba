"""A flight plan: waypoints, sectors, variables, exceptions and blocks with their stages, as its file holds them.

Attributes that every stage of movement has: ``vmode`` and what it needs, ``until``, calls before and after each tick.

What a stage or an exception names may be missing: :mod:`protocol.flight_plans.plan_check` then locks the block.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, NamedTuple

from protocol.flight_plans.attributes import Kind, NameUse, attribute, required
from protocol.flight_plans.expressions import Expression, Script, StoredIn
from protocol.flight_plans.xml_elements import NOWHERE, Place
from protocol.frames import Geodetic, LocalFrame

VERTICAL_MODES = ("alt", "climb", "throttle", "glide", "xyz")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanElement:
    """Fields of all elements: a place, attributes that no plan has, and comments in front and at the end."""

    place: Place = field(default=NOWHERE, compare=False)
    unknown: tuple[NameUse, ...] = field(default=(), compare=False)  # of blocks and stages: ignored
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


HOME_WAYPOINT = "HOME"
HOME_BLOCK = "HOME"  # added behind the last block of every plan


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanHeader(PlanElement):
    """C text for the autopilot's build, which is not flown."""

    tag: ClassVar[str] = "header"
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanWaypoint(PlanElement):
    """A named place: east and north of the origin, or latitude and longitude, which count where both are given."""

    tag: ClassVar[str] = "waypoint"
    name: str = required(Kind.NAME)
    x: float | None = attribute(Kind.NUMBER)  # east of the origin [m]
    y: float | None = attribute(Kind.NUMBER)  # north of the origin [m]
    lat: float | None = attribute(Kind.ANGLE)  # [deg]
    lon: float | None = attribute(Kind.ANGLE)  # [deg]
    alt: float | None = attribute(Kind.NUMBER)  # above sea [m]
    height: float | None = attribute(Kind.NUMBER)  # above the ground [m]

    @property
    def is_shown(self) -> bool:
        """Whether an operator may drag it."""
        return not self.name.startswith("_")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanSector(PlanElement):
    """A named polygon."""

    tag: ClassVar[str] = "sector"
    name: str = required(Kind.NAME)
    color: str | None = attribute(Kind.TEXT)
    type: str | None = attribute(Kind.TEXT)
    corners: tuple[NameUse, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class KmlSector(PlanElement):
    """Sectors in a file that is not there."""

    tag: ClassVar[str] = "kml"
    file: str = required(Kind.TEXT)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanVariable(PlanElement):
    """A variable of the plan, shown as a setting if it has limits."""

    tag: ClassVar[str] = "variable"
    var: str = required(Kind.NAME)
    type: str | None = attribute(Kind.TEXT)
    init: Expression | None = attribute(Kind.EXPRESSION)
    shortname: str | None = attribute(Kind.TEXT)
    min: float | None = attribute(Kind.NUMBER)
    max: float | None = attribute(Kind.NUMBER)
    step: float | None = attribute(Kind.NUMBER)
    unit: str | None = attribute(Kind.TEXT)
    alt_unit: str | None = attribute(Kind.TEXT)
    alt_unit_coef: str | None = attribute(Kind.TEXT)
    values: str | None = attribute(Kind.TEXT)


@dataclass(frozen=True, slots=True, kw_only=True)
class AbiBinding(PlanElement):
    """Variables that a message inside the autopilot sets."""

    tag: ClassVar[str] = "abi_binding"
    name: str = required(Kind.NAME)
    vars: str | None = attribute(Kind.TEXT)
    id: str | None = attribute(Kind.TEXT)
    handler: str | None = attribute(Kind.TEXT)


@dataclass(frozen=True, slots=True, kw_only=True)
class ModuleOption(PlanElement):
    """A line of a module: ``define`` or ``configure``."""

    option: str  # its tag
    name: str = required(Kind.NAME)
    value: str | None = attribute(Kind.TEXT)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanModule(PlanElement):
    """A module of the autopilot's build."""

    tag: ClassVar[str] = "module"
    name: str = required(Kind.NAME)
    type: str | None = attribute(Kind.TEXT)
    options: tuple[ModuleOption, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanBlock(PlanElement):
    """A block: stages, and the exceptions that leave it."""

    tag: ClassVar[str] = "block"
    name: str = required(Kind.NAME)
    pre_call: Script | None = attribute(Kind.SCRIPT)
    post_call: Script | None = attribute(Kind.SCRIPT)
    strip_button: str | None = attribute(Kind.TEXT)
    strip_icon: str | None = attribute(Kind.TEXT)
    group: str | None = attribute(Kind.TEXT)
    key: str | None = attribute(Kind.TEXT)
    description: str | None = attribute(Kind.TEXT)
    stages: tuple[Stage, ...] = ()
    exceptions: tuple[PlanException, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class FlightPlan(PlanElement):
    """A whole plan, its procedures in place."""

    tag: ClassVar[str] = "flight_plan"
    name: str = required(Kind.TEXT)
    lat0: float = required(Kind.ANGLE)  # of the origin [deg]
    lon0: float = required(Kind.ANGLE)
    max_dist_from_home: float = required(Kind.NUMBER)  # [m]
    ground_alt: float = required(Kind.NUMBER)  # above sea [m]
    security_height: float = required(Kind.NUMBER)  # above the ground [m]
    alt: float = required(Kind.NUMBER)  # above sea, of waypoints without their own [m]
    wp_frame: str | None = attribute(Kind.CHOICE, choices=("UTM", "LTP"))
    qfu: float | None = attribute(Kind.NUMBER)  # direction of take-off [deg]
    home_mode_height: float | None = attribute(Kind.NUMBER)  # [m]
    geofence_max_alt: float | None = attribute(Kind.NUMBER)  # [m]
    geofence_max_height: float | None = attribute(Kind.NUMBER)  # [m]
    geofence_sector: NameUse | None = attribute(Kind.BLOCK)
    header: PlanHeader | None = None
    utm_x0: float | None = None
    utm_y0: float | None = None
    waypoints: tuple[PlanWaypoint, ...] = ()
    sectors: tuple[PlanSector | KmlSector, ...] = ()
    variables: tuple[PlanVariable | AbiBinding, ...] = ()
    modules: tuple[PlanModule, ...] = ()
    exceptions: tuple[PlanException, ...] = ()
    blocks: tuple[PlanBlock, ...] = ()
    repeated_attributes: tuple[NameUse, ...] = ()  # tag and attribute: the first in their tag count
    section_comments: tuple[tuple[str, tuple[str, ...], tuple[str, ...]], ...] = ()  # tag, in front, at the end

    def block_index(self, name: str) -> int | None:
        """Number of a block; None if there is none."""
        return next((index for index, block in enumerate(self.blocks) if block.name == name), None)

    def waypoint(self, name: str) -> PlanWaypoint | None:
        """A waypoint by its name; of an included procedure also as ``PROCEDURE.name``."""
        found = next((point for point in self.waypoints if point.name == name), None)
        if found is None and "." in name:
            return self.waypoint(name.split(".", 1)[1])
        return found

    def sector(self, name: str) -> PlanSector | None:
        """A polygon by its name."""
        polygons = (sector for sector in self.sectors if isinstance(sector, PlanSector))
        return next((sector for sector in polygons if sector.name == name), None)


class EnuPoint(NamedTuple):
    """East, north and up of the plan's origin on the ground [m]."""

    x: float
    y: float
    z: float


def plan_frame(plan: FlightPlan) -> LocalFrame:
    """The plane at the plan's origin, at the altitude of its ground."""
    return LocalFrame(Geodetic(plan.lat0, plan.lon0, plan.ground_alt))


def waypoint_position(plan: FlightPlan, point: PlanWaypoint) -> EnuPoint:
    """Position of a waypoint; one without an altitude of its own is at that of the plan."""
    up = (plan.alt if point.alt is None else point.alt) - plan.ground_alt
    if point.height is not None:
        up = point.height
    if point.lat is not None and point.lon is not None:
        north, east, _ = plan_frame(plan).to_ned(Geodetic(point.lat, point.lon, plan.ground_alt))
        return EnuPoint(east, north, up)
    return EnuPoint(point.x or 0.0, point.y or 0.0, up)


def inside_polygon(corners: Sequence[tuple[float, float]], x: float, y: float) -> bool:
    """Whether a point is in a polygon: a ray from it crosses the outline an odd number of times.

    Args:
        corners: East and north [m].
        x: East [m].
        y: North [m].
    """
    inside = False
    for (x1, y1), (x2, y2) in zip(corners, (*corners[1:], *corners[:1]), strict=True):
        if (y1 > y) != (y2 > y) and x < x1 + (y - y1) / (y2 - y1) * (x2 - x1):
            inside = not inside
    return inside
