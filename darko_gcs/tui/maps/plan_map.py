"""Content of the flight plan screen's map: the plan's waypoints and sectors, and the vehicle."""

from __future__ import annotations

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.fence_overlay import fence_circles, fence_polygons
from darko_gcs.tui.maps.flight_content import flight_content
from darko_gcs.tui.maps.plan_overlay import plan_labels, plan_polygons, point_position
from darko_gcs.tui.render.map_drawing import MapContent, NorthEast

__all__ = ["LoadedFlightPlan"]


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
