"""Positions of a plan's waypoints: east, north and up of the origin, the ground below it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from protocol.flight_plans.flight_plan import FlightPlan, PlanWaypoint
from protocol.frames import Geodetic, LocalFrame

__all__ = ["EnuPoint", "inside_polygon", "plan_frame", "waypoint_position"]


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
