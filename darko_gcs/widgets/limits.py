"""Where a vehicle's fence and rally points lie on the map."""

from __future__ import annotations

from darko_gcs.snapshot import Snapshot
from darko_gcs.widgets.places import place_of
from protocol.dialect import mavlink
from protocol.plans.mission import MissionItem

__all__ = ["fence_areas", "fence_circles", "rally_points"]

# Style on the map by command: where it may fly, where it may not.
POLYGONS = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "keep-out",
}
CIRCLES = {mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: "fence", mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: "keep-out"}

Point = tuple[float, float]  # north, east [m]


def fence_areas(s: Snapshot) -> list[tuple[tuple[Point, ...], str]]:
    """Corners and style of every polygon of the fence; one that is not complete is left out."""
    areas, left = [], list(s.fence)
    while left:
        first = left[0]
        count = max(1, int(first.params[0])) if first.command in POLYGONS and first.params[0] < len(left) + 1 else 1
        corners, left = _places(s, left[:count]), left[count:]
        if first.command in POLYGONS and len(corners) == count >= 3:
            areas.append((corners, POLYGONS[first.command]))
    return areas


def fence_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and style of every circle of the fence."""
    placed = ((item, place_of(s, item)) for item in s.fence if item.command in CIRCLES)
    return [(*place, item.params[0], CIRCLES[item.command]) for item, place in placed if place is not None]


def rally_points(s: Snapshot) -> list[Point]:
    """North and east [m] of every rally point."""
    return list(_places(s, s.rally))


def _places(s: Snapshot, items: tuple[MissionItem, ...] | list[MissionItem]) -> tuple[Point, ...]:
    return tuple(place for place in (place_of(s, item) for item in items) if place is not None)
