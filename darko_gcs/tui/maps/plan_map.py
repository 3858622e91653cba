"""The map of the flight plan screen: its waypoints are moved here, by arrow keys or by the mouse."""

from __future__ import annotations

from textual.message import Message

from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.fence_overlay import fence_circles, fence_polygons
from darko_gcs.tui.maps.map_panel import position_ahead, target_place
from darko_gcs.tui.maps.movable_map import MovableMap
from darko_gcs.tui.maps.plan_overlay import plan_labels, plan_polygons, point_position
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_drawing import NorthEast, draw_map
from protocol.frames import Vector

__all__ = ["PlanMapPanel"]

ANSWER_TIME = 1.0  # of the vehicle to a move [s]


class PlanMapPanel(MovableMap):
    """The plan's waypoints and sectors, the track, and the vehicle, north up."""

    class PointMoved(Message):
        """A waypoint is to be moved to a place: east, north and up of the plan's origin [m]."""

        def __init__(self, number: int, place: Vector) -> None:
            super().__init__()
            self.number, self.place = number, place

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self._wanted: tuple[int, Vector, float] = (0, (0.0, 0.0, 0.0), 0.0)  # waypoint, place, and when it was asked

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The plan fills the panel."""
        labels, polygons = plan_labels(s, self.chosen), plan_polygons(s)
        here = None if s.p is None else (s.p[0], s.p[1])
        places = [place for _, place, _ in labels] + [corner for corners, _ in polygons for corner in corners]
        scale, middle = self.fit([*places, *([here] if here else [])], width, height)
        if self.held is not None:
            labels.append(("◇", self.held, "warn"))
        lines, _ = draw_map(
            width=width,
            height=height,
            scale=scale,
            centre=middle,
            home=None,
            track=s.track,
            waypoints=[],
            vehicle=None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0),
            target=target_place(s),
            circles=fence_circles(s),
            course=position_ahead(s),
            areas=[*fence_polygons(s), *polygons],
            labels=labels,
        )
        return lines

    def places(self) -> dict[int, NorthEast]:
        """Where the shown waypoints are."""
        plan = self.snapshot.flight_plan
        points = () if plan is None else plan.points.values()
        placed = ((point.number, point_position(self.snapshot, point)) for point in points if point.is_shown)
        return {number: place for number, place in placed if place is not None}

    def move_by(self, east: float, north: float, up: float) -> None:
        """Ask for the chosen waypoint to be moved."""
        point = self._point(self.chosen)
        if point is not None:
            x, y, z = self._wanted_place(point)
            place = (x + east, y + north, z + up)
            self._wanted = (point.number, place, self.now)
            self.post_message(self.PointMoved(point.number, place))

    def drop(self, number: int, place: NorthEast) -> None:
        """Ask for a waypoint to be put there."""
        point = self._point(number)
        here = None if point is None else point_position(self.snapshot, point)
        if point is not None and here is not None:
            x, y, z = point.position
            self.post_message(self.PointMoved(number, (x + place[1] - here[1], y + place[0] - here[0], z)))

    def _wanted_place(self, point: PlanPoint) -> Vector:
        """Where a waypoint is, or is about to be: keys may come faster than the vehicle's answers."""
        number, place, asked = self._wanted
        is_under_way = number == point.number and self.now - asked < ANSWER_TIME
        return place if is_under_way else point.position

    def _point(self, number: int) -> PlanPoint | None:
        plan = self.snapshot.flight_plan
        return None if plan is None else plan.points.get(number)
