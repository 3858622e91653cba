"""A flight plan's waypoints and sectors as shapes on the map."""

from __future__ import annotations

from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.fence_overlay import fence_circles, fence_polygons
from darko_gcs.tui.maps.flight_content import flight_content
from darko_gcs.tui.render.map_drawing import MapContent, MapLabel, NorthEast
from protocol.dialect import mavlink
from protocol.frames import Geodetic, is_global_frame
from protocol.limits import MIN_CORNERS
from protocol.plans import MissionItem
from protocol.units import from_e7, from_local_e4

__all__ = [
    "LoadedFlightPlan",
    "item_position",
    "plan_labels",
    "plan_polygons",
    "point_position",
]


def item_position(s: Snapshot, item: MissionItem) -> NorthEast | None:
    """North and east [m]; None for an item without a place, or until home is known."""
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        x, y = from_local_e4(item.x), from_local_e4(item.y)
        here = s.from_vehicle_frame((y, x, 0.0) if item.frame == mavlink.MAV_FRAME_LOCAL_ENU else (x, y, 0.0))
        return None if here is None else here[:2]
    local = s.local(Geodetic(from_e7(item.x), from_e7(item.y), 0.0))
    return None if local is None else local[:2]


class LoadedFlightPlan:
    """The flight plan that the vehicle has loaded."""

    def is_empty(self, s: Snapshot) -> bool:  # noqa: ARG002 - of every map's source
        """Never: it is not drawn here."""
        return False

    def places(self, s: Snapshot) -> dict[int, NorthEast]:
        """Positions of the shown waypoints, by number [m]."""
        points = () if s.flight_plan is None else s.flight_plan.points.values()
        placed = ((point.number, point_position(s, point)) for point in points if point.is_shown)
        return {number: place for number, place in placed if place is not None}

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen waypoint."""
        return flight_content(
            s,
            circles=fence_circles(s),
            areas=[*fence_polygons(s), *plan_polygons(s)],
            labels=plan_labels(s, chosen),
        )


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
