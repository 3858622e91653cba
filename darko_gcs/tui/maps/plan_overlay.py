"""A flight plan's waypoints and sectors as shapes on the map."""

from __future__ import annotations

from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.map_drawing import MapLabel, NorthEast
from protocol.limits import MIN_CORNERS

__all__ = ["plan_labels", "plan_polygons", "point_position"]


def point_position(s: Snapshot, point: PlanPoint) -> NorthEast | None:
    """North and east [m] of a waypoint; None until home is known."""
    place = None if point.place is None else s.local(point.place)
    return None if place is None else place[:2]


def plan_labels(s: Snapshot, chosen: int = 0) -> list[MapLabel]:
    """The waypoints that the plan shows; the chosen one is marked."""
    plan = s.flight_plan
    if plan is None:
        return []
    shown = [point for point in plan.points.values() if point.is_shown or point.number == chosen]
    placed = [(point, point_position(s, point)) for point in sorted(shown, key=lambda point: point.number == chosen)]
    return [
        (f"{'◆' if point.number == chosen else '·'}{point.name}", place, "warn" if point.number == chosen else "plan")
        for point, place in placed
        if place is not None
    ]


def plan_polygons(s: Snapshot) -> list[tuple[tuple[NorthEast, ...], str]]:
    """Corners and state of every sector: "fence" if the plan stays inside."""
    plan = s.flight_plan
    if plan is None:
        return []
    polygons = []
    for area in plan.areas.values():
        corners = [point_position(s, plan.points[number]) for number in area.corners if number in plan.points]
        placed = tuple(corner for corner in corners if corner is not None)
        if len(placed) == len(area.corners) >= MIN_CORNERS:
            polygons.append((placed, "fence" if area.is_fence else "sector"))
    return polygons
