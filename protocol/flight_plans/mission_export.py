"""A flight plan as the nearest mission: its stages in the order of the file, and what a mission cannot say."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

from protocol import units
from protocol.dialect import mavlink
from protocol.flight_plans.attributes import NameUse
from protocol.flight_plans.evaluation import evaluate
from protocol.flight_plans.expressions import Call, Expression, Number, Operation, Tree, VariableName
from protocol.flight_plans.flight_plan import (
    HOME_WAYPOINT,
    CircleStage,
    EnuPoint,
    FlightPlan,
    ForStage,
    GoStage,
    HomeStage,
    PathStage,
    PlanVariable,
    Stage,
    StayStage,
    WhileStage,
    plan_frame,
    waypoint_position,
)
from protocol.flight_plans.plan_limits import is_loop_waypoint
from protocol.flight_plans.plan_names import PlanConstants
from protocol.flight_plans.xml_elements import FlightPlanError, Place
from protocol.frames import Geodetic
from protocol.plans import MissionItem, Plan
from protocol.plans.fence_rally import with_fence

_FRAME = mavlink.MAV_FRAME_GLOBAL
NAN = math.nan


@dataclass(frozen=True, slots=True)
class Loss:
    """Something of a plan that a mission does not hold."""

    place: Place
    text: str

    def __str__(self) -> str:
        return f"{self.place}: {self.text}"


@dataclass(frozen=True, slots=True)
class MissionExport:
    """The mission, and what was lost."""

    mission: Plan
    losses: tuple[Loss, ...]


def to_mission(plan: FlightPlan, *, with_fence_of_sector: bool = True) -> MissionExport:
    """The plan as a mission.

    Args:
        plan: The plan.
        with_fence_of_sector: Whether the mission holds the plan's fence; the older file format has none.
    """
    return _Export(plan).exported(with_fence_of_sector=with_fence_of_sector)


class _Export:
    """Collects items and losses."""

    def __init__(self, plan: FlightPlan) -> None:
        self._plan, self._frame = plan, plan_frame(plan)
        self._names = PlanConstants(plan)
        self._losses: list[Loss] = []

    def exported(self, *, with_fence_of_sector: bool) -> MissionExport:
        """The whole plan."""
        plan = self._plan
        items = [item for block in plan.blocks for stage in block.stages for item in self._stage(stage)]
        for exception in plan.exceptions:
            self._lose(exception.place, f"exception to {exception.deroute}")
        for block in plan.blocks:
            for exception in block.exceptions:
                self._lose(exception.place, f"exception from block {block.name} to {exception.deroute}")
            for call in (block.pre_call, block.post_call):
                if call is not None:
                    self._lose(call.place, f"call {call.text}")
        self._losses += [
            Loss(variable.place, f"variable {variable.var}")
            for variable in plan.variables
            if isinstance(variable, PlanVariable)
        ]
        home = self._geodetic(self._position(HOME_WAYPOINT)._replace(z=0.0))
        mission = Plan(items=tuple(items), planned_home=home)
        fence = self._fence(wanted=with_fence_of_sector)
        return MissionExport(with_fence(mission, fence) if fence else mission, tuple(self._losses))

    def _lose(self, place: Place, text: str) -> None:
        self._losses.append(Loss(place, text))

    def _stage(self, stage: Stage) -> Iterator[MissionItem]:
        match stage:
            case GoStage():
                yield from self._go(stage)
            case PathStage():
                yield from self._path(stage)
            case StayStage():
                yield from self._stay(stage)
            case CircleStage():
                yield from self._circle(stage)
            case WhileStage() | ForStage():
                if stage.stages:
                    self._lose(stage.place, f"<{stage.tag}>: its stages are flown once")
                for inner in stage.stages:
                    yield from self._stage(inner)
            case HomeStage():
                yield self._item(mavlink.MAV_CMD_NAV_LOITER_UNLIM, self._position(HOME_WAYPOINT))
            case _:
                self._lose(stage.place, f"<{stage.tag}>")

    def _go(self, stage: GoStage) -> Iterator[MissionItem]:
        for name in ("wp_qdr", "from_qdr", "approaching_time", "exceeding_time", "until", "pre_call", "post_call"):
            if getattr(stage, name) is not None:
                self._lose(stage.place, f"<go> {name}")
        if is_loop_waypoint(stage.wp):
            self._lose(stage.place, f"<go> to {stage.wp}")
            return
        if stage.from_wp is not None and not is_loop_waypoint(stage.from_wp):
            yield self._item(mavlink.MAV_CMD_NAV_WAYPOINT, self._at(stage.from_wp, stage))
        yield self._item(mavlink.MAV_CMD_NAV_WAYPOINT, self._at(stage.wp, stage))

    def _path(self, stage: PathStage) -> Iterator[MissionItem]:
        for use in stage.wpts:
            if is_loop_waypoint(use):
                self._lose(stage.place, f"<path> over {use}")
            else:
                yield self._item(mavlink.MAV_CMD_NAV_WAYPOINT, self._at(use, stage))

    def _stay(self, stage: StayStage) -> Iterator[MissionItem]:
        if is_loop_waypoint(stage.wp):
            self._lose(stage.place, f"<stay> at {stage.wp}")
            return
        at = self._at(stage.wp, stage)
        climb = self._constant(stage.climb) if stage.vmode == "climb" else None
        if stage.vmode == "climb":
            if climb is None:
                self._lose(stage.place, "<stay> with a climb that is not constant")
                return
            command = mavlink.MAV_CMD_NAV_TAKEOFF if climb > 0.0 else mavlink.MAV_CMD_NAV_LAND
            yield self._item(command, at if climb > 0.0 else at._replace(z=0.0))
            return
        if stage.vmode in {"throttle", "xyz"}:
            self._lose(stage.place, "<stay> with a throttle" if stage.vmode == "throttle" else "<stay> by the sticks")
            return
        seconds = _limit(stage.until, "stage_time")
        if stage.until is not None and seconds is None:
            self._lose(stage.until.place, f"<stay> until {stage.until.text}")
        if seconds is None:
            yield self._item(mavlink.MAV_CMD_NAV_LOITER_UNLIM, at)
        else:
            yield self._item(mavlink.MAV_CMD_NAV_LOITER_TIME, at, seconds)

    def _circle(self, stage: CircleStage) -> Iterator[MissionItem]:
        radius = self._constant(stage.radius)
        if radius is None or is_loop_waypoint(stage.wp):
            self._lose(stage.place, "<circle> whose centre or radius is not constant")
            return
        at = self._at(stage.wp, stage)
        turns = _limit(stage.until, "NavCircleCount")
        if stage.until is not None and turns is None:
            self._lose(stage.until.place, f"<circle> until {stage.until.text}")
        if turns is None:
            yield self._item(mavlink.MAV_CMD_NAV_LOITER_UNLIM, at, third=radius)
        else:
            yield self._item(mavlink.MAV_CMD_NAV_LOITER_TURNS, at, turns, radius)

    def _at(self, use: NameUse, stage: GoStage | PathStage | StayStage | CircleStage) -> EnuPoint:
        """Position at which a stage flies over a waypoint."""
        at = self._position(use.name)
        alt, height = self._constant(stage.alt), self._constant(getattr(stage, "height", None))
        for name, value in (("alt", alt), ("height", height)):
            if getattr(stage, name, None) is not None and value is None:
                self._lose(stage.place, f"<{stage.tag}> {name} that is not constant")
        if height is not None:
            return at._replace(z=height)
        return at if alt is None else at._replace(z=alt - self._plan.ground_alt)

    def _position(self, name: str) -> EnuPoint:
        point = self._plan.waypoint(name)
        return EnuPoint(0.0, 0.0, 0.0) if point is None else waypoint_position(self._plan, point)

    def _constant(self, expression: Expression | None) -> float | None:
        """The value of an expression without anything that changes in flight, else None."""
        if expression is None:
            return None
        try:
            return float(evaluate(expression.tree, self._names))
        except FlightPlanError:
            return None

    def _geodetic(self, at: EnuPoint) -> Geodetic:
        return self._frame.to_geodetic((at.y, at.x, -at.z))

    def _item(self, command: int, at: EnuPoint, first: float = 0.0, third: float = 0.0) -> MissionItem:
        point = self._geodetic(at)
        lat, lon = units.to_e7(point.lat_deg), units.to_e7(point.lon_deg)
        params = (first, 0.0, third, NAN)
        return MissionItem(command=command, frame=_FRAME, params=params, x=lat, y=lon, z=point.alt)

    def _fence(self, *, wanted: bool) -> list[MissionItem]:
        name = self._plan.geofence_sector
        sector = None if name is None else self._plan.sector(name.name)
        for other in self._plan.sectors:
            if other is not sector:
                self._lose(other.place, f"<{other.tag}>")
        if sector is None:
            return []
        if not wanted:
            self._lose(sector.place, f"fence {sector.name}: this format has none")
            return []
        count = float(len(sector.corners))
        command = mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION
        points = [self._geodetic(self._position(corner.name)) for corner in sector.corners]
        return [
            MissionItem(
                command=command,
                frame=_FRAME,
                params=(count, 0.0, 0.0, 0.0),
                x=units.to_e7(point.lat_deg),
                y=units.to_e7(point.lon_deg),
                z=0.0,
            )
            for point in points
        ]


def _limit(until: Expression | None, name: str) -> float | None:
    """The number that a condition such as ``stage_time > 10`` waits for, else None."""
    tree: Tree | None = None if until is None else until.tree
    if not isinstance(tree, Operation) or tree.operator not in {">", ">="} or not isinstance(tree.right, Number):
        return None
    left = tree.left
    named = left.name if isinstance(left, VariableName | Call) else ""
    return float(tree.right.value) if named == name else None
