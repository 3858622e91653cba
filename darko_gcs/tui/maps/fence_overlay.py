"""A vehicle's fence and rally points as shapes on the map."""

from __future__ import annotations

from collections.abc import Iterable

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.plan_overlay import item_position
from darko_gcs.tui.render.map_drawing import NorthEast
from protocol.dialect import mavlink
from protocol.limits import MIN_CORNERS
from protocol.plans import MissionItem

__all__ = ["fence_circles", "fence_polygons", "rally_points"]

# State on the map by command: "fence" to stay inside, "keep-out" to stay outside.
POLYGON_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "keep-out",
}
CIRCLE_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: "keep-out",
}


def fence_polygons(s: Snapshot) -> list[tuple[tuple[NorthEast, ...], str]]:
    """Corners and state of every polygon of the fence; incomplete polygons are left out."""
    polygons, rest = [], list(s.fence)
    while rest:
        state, count = POLYGON_STATES.get(rest[0].command), rest[0].params[0]
        items = rest[: max(1, int(count))] if state is not None and count < len(rest) + 1 else rest[:1]
        rest = rest[len(items) :]
        corners = _positions(s, items)
        if state is not None and len(corners) == len(items) >= MIN_CORNERS:
            polygons.append((corners, state))
    return polygons


def fence_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle of the fence."""
    placed = ((item, item_position(s, item)) for item in s.fence if item.command in CIRCLE_STATES)
    return [(*place, item.params[0], CIRCLE_STATES[item.command]) for item, place in placed if place is not None]


def rally_points(s: Snapshot) -> list[NorthEast]:
    """North and east [m] of every rally point."""
    return list(_positions(s, s.rally))


def _positions(s: Snapshot, items: Iterable[MissionItem]) -> tuple[NorthEast, ...]:
    return tuple(place for place in (item_position(s, item) for item in items) if place is not None)
