"""Rules for a plan beyond its grammar: names that exist once, and numbers within their ranges."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from protocol.flight_plans.attributes import NameUse
from protocol.flight_plans.flight_plan import (
    HOME_BLOCK,
    HOME_WAYPOINT,
    AbiBinding,
    CircleStage,
    EightStage,
    FlightPlan,
    ForStage,
    GoStage,
    OvalStage,
    PathStage,
    PlanSector,
    PlanVariable,
    PlanWaypoint,
    Stage,
    StayStage,
    SurveyStage,
    WhileStage,
)
from protocol.flight_plans.xml_elements import FlightPlanError, Place
from protocol.ranges import MIN_CORNERS

MAX_COORDINATE = 100_000.0  # of a waypoint from the origin [m]
MAX_ALTITUDE = 100_000.0  # [m]
MAX_LATITUDE = 89.9  # nearer to a pole there is no local frame [deg]


def check_plan(plan: FlightPlan) -> None:
    """Check names and ranges.

    Raises:
        FlightPlanError: The first that is not valid.
    """
    _check_origin(plan)
    _once("waypoint", ((point.name, point.place) for point in plan.waypoints))
    _once("block", ((block.name, block.place) for block in plan.blocks))
    _once("variable", ((v.var, v.place) for v in plan.variables if isinstance(v, PlanVariable)))
    for point in plan.waypoints:
        _check_waypoint(point)
    if not plan.blocks:
        raise FlightPlanError(plan.place, "<blocks> holds no block")
    if plan.waypoint(HOME_WAYPOINT) is None:
        raise FlightPlanError(plan.place, f"no waypoint is called {HOME_WAYPOINT}")
    _check_sectors(plan)
    for variable in plan.variables:
        _check_variable(variable)
    _check_references(plan)


def all_stages(stages: Iterable[Stage]) -> Iterator[Stage]:
    """All stages of a body, those of its loops as well."""
    for stage in stages:
        yield stage
        if isinstance(stage, WhileStage | ForStage):
            yield from all_stages(stage.stages)


def waypoint_uses(stage: Stage) -> list[NameUse]:
    """The waypoints that a stage names."""
    match stage:
        case GoStage():
            return [stage.wp] + ([stage.from_wp] if stage.from_wp is not None else [])
        case StayStage() | CircleStage():
            return [stage.wp]
        case PathStage():
            return list(stage.wpts)
        case OvalStage():
            return [stage.p1, stage.p2]
        case EightStage():
            return [stage.center, stage.turn_around]
        case SurveyStage():
            return [stage.wp1, stage.wp2]
        case _:
            return []


def is_loop_waypoint(use: NameUse) -> bool:
    """Whether a waypoint is named by the counter of a loop: ``$i``."""
    return use.name.startswith("$")


def _once(what: str, names: Iterable[tuple[str, Place]]) -> None:
    seen: dict[str, Place] = {}
    for name, place in names:
        if name in seen:
            raise FlightPlanError(place, f"a second {what} is called {name!r}; the first is in line {seen[name].line}")
        seen[name] = place


def _check_origin(plan: FlightPlan) -> None:
    if abs(plan.lat0) > MAX_LATITUDE or abs(plan.lon0) > 180.0:
        raise FlightPlanError(
            plan.place, f"lat0, lon0 {plan.lat0:g}, {plan.lon0:g} are not on the globe, or too near a pole"
        )
    if not plan.max_dist_from_home > 0.0:
        raise FlightPlanError(plan.place, f"max_dist_from_home {plan.max_dist_from_home:g} is not positive")
    if plan.security_height < 0.0:
        raise FlightPlanError(plan.place, f"security_height {plan.security_height:g} is negative")
    for name in ("ground_alt", "alt", "home_mode_height", "geofence_max_alt", "geofence_max_height"):
        value = getattr(plan, name)
        if _exceed(MAX_ALTITUDE, value):
            raise FlightPlanError(plan.place, f"{name} {value:g} is not within {MAX_ALTITUDE:g} m")
    if plan.geofence_sector is not None:
        fence = plan.sector(plan.geofence_sector.name)
        if fence is None:
            raise FlightPlanError(plan.geofence_sector.place, f"there is no sector {plan.geofence_sector.name!r}")
        if len(fence.corners) < MIN_CORNERS:
            raise FlightPlanError(fence.place, f"{len(fence.corners)} corners are too few for a fence")


def _check_waypoint(point: PlanWaypoint) -> None:
    local, globe = (point.x, point.y), (point.lat, point.lon)
    if (None in local and None in globe) or any((a is None) != (b is None) for a, b in (local, globe)):
        raise FlightPlanError(point.place, f"waypoint {point.name!r} needs x and y, or lat and lon")
    if point.alt is not None and point.height is not None:
        raise FlightPlanError(point.place, f"waypoint {point.name!r} has both alt and height")
    if _exceed(90.0, point.lat) or _exceed(180.0, point.lon):
        raise FlightPlanError(point.place, f"waypoint {point.name!r} is not on the globe")
    if _exceed(MAX_COORDINATE, point.x, point.y):
        raise FlightPlanError(point.place, f"waypoint {point.name!r} is farther than {MAX_COORDINATE:g} m away")
    if _exceed(MAX_ALTITUDE, point.alt, point.height):
        raise FlightPlanError(point.place, f"waypoint {point.name!r} is higher than {MAX_ALTITUDE:g} m")


def _exceed(limit: float, *values: float | None) -> bool:
    """Whether one of the values that there are is beyond a limit, above or below zero."""
    return any(value is not None and abs(value) > limit for value in values)


def _check_sectors(plan: FlightPlan) -> None:
    polygons = [sector for sector in plan.sectors if isinstance(sector, PlanSector)]
    _once("sector", ((sector.name, sector.place) for sector in polygons))
    for sector in polygons:
        for corner in sector.corners:
            if not is_waypoint(plan, corner):
                raise FlightPlanError(corner.place, f"there is no waypoint {corner.name!r}")


def _check_variable(variable: PlanVariable | AbiBinding) -> None:
    if isinstance(variable, AbiBinding):
        if variable.vars is None and variable.handler is None:
            raise FlightPlanError(variable.place, "<abi_binding> needs vars or handler")
        return
    if not variable.var.replace("_", "a").isidentifier():
        raise FlightPlanError(variable.place, f"{variable.var!r} is not the name of a variable")
    low, high = variable.min, variable.max
    if low is not None and high is not None and low > high:
        raise FlightPlanError(variable.place, f"min {low:g} is above max {high:g}")
    if variable.step is not None and variable.step <= 0.0:
        raise FlightPlanError(variable.place, f"step {variable.step:g} is not positive")


def _check_references(plan: FlightPlan) -> None:
    for exception in plan.exceptions:
        if not is_block(plan, exception.deroute):
            raise FlightPlanError(exception.deroute.place, f"there is no block {exception.deroute.name!r}")
    for block in plan.blocks:
        for stage in all_stages(block.stages):
            if isinstance(stage, PathStage) and len(stage.wpts) < 2:
                raise FlightPlanError(stage.place, "<path> needs two waypoints or more")


def is_waypoint(plan: FlightPlan, use: NameUse) -> bool:
    """Whether a plan has the waypoint that is named."""
    return is_loop_waypoint(use) or plan.waypoint(use.name) is not None


def is_block(plan: FlightPlan, use: NameUse) -> bool:
    """Whether a plan has the block that is named."""
    return use.name == HOME_BLOCK or plan.block_index(use.name) is not None
