"""A flight plan: waypoints, sectors, variables, exceptions and blocks, as its file holds them.

What a stage or an exception names may be missing: :mod:`protocol.flight_plans.plan_check` then locks the block.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from protocol.flight_plans.attributes import Kind, NameUse, attribute, required
from protocol.flight_plans.expressions.expression_tree import Expression, Script
from protocol.flight_plans.stages import PlanElement, PlanException, Stage

__all__ = [
    "HOME_BLOCK",
    "HOME_WAYPOINT",
    "AbiBinding",
    "FlightPlan",
    "KmlSector",
    "PlanBlock",
    "PlanHeader",
    "PlanModule",
    "PlanSector",
    "PlanVariable",
    "PlanWaypoint",
]

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
