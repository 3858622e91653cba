"""The map of the flight plan screen: its waypoints are moved here, by arrow keys or by the mouse."""

from __future__ import annotations

import math
from typing import ClassVar

from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.state.flight_plan_state import PlanPoint
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_drawing import NorthEast, draw_map, fitting_view, place_at
from darko_gcs.tui.widgets.fence_overlay import fence_circles, fence_polygons
from darko_gcs.tui.widgets.map_panel import ZOOM_FACTOR, position_ahead
from darko_gcs.tui.widgets.panel import Panel
from darko_gcs.tui.widgets.plan_overlay import plan_labels, plan_polygons, point_position
from protocol.dialect import mavlink
from protocol.frames import Vector

__all__ = ["MOVE_STEPS", "PlanMapPanel"]

MOVE_STEPS = (0.1, 0.25, 0.5, 1.0, 5.0, 25.0)  # of a waypoint by a key [m]
ANSWER_TIME = 1.0  # of the vehicle to a move [s]
REACH = 2  # cells from a waypoint within which the mouse takes hold of it


class PlanMapPanel(Panel, can_focus=True):
    """The plan's waypoints and sectors, the track, and the vehicle, north up."""

    class PointChosen(Message):
        """The mouse took hold of a waypoint."""

        def __init__(self, number: int) -> None:
            super().__init__()
            self.number = number

    class PointMoved(Message):
        """A waypoint is to be moved to a place: east, north and up of the plan's origin [m]."""

        def __init__(self, number: int, place: Vector) -> None:
            super().__init__()
            self.number, self.place = number, place

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(0, 1, 0)", "Move", key_display="arrows", tooltip="Move the chosen waypoint (on the map)"),
        Binding("down", "move(0, -1, 0)", "South", show=False),
        Binding("right", "move(1, 0, 0)", "East", show=False),
        Binding("left", "move(-1, 0, 0)", "West", show=False),
        Binding("pageup", "move(0, 0, 1)", "Higher", show=False),
        Binding("pagedown", "move(0, 0, -1)", "Lower", show=False),
    ]
    chosen: reactive[int] = reactive(0, repaint=False)  # number of a waypoint

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self._zoom = 1.0
        self._step = MOVE_STEPS.index(0.5)
        self._view: tuple[float, NorthEast] = (1.0, (0.0, 0.0))  # scale, middle
        self._held: tuple[int, NorthEast] | None = None  # the waypoint that the mouse holds, and where
        self._wanted: tuple[int, Vector, float] = (0, (0.0, 0.0, 0.0), 0.0)  # waypoint, place, and when it was asked
        self._show_step()

    def watch_chosen(self) -> None:
        """Mark another waypoint."""
        self.redraw()

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The plan fills the panel; while the mouse holds a waypoint, the map stands still."""
        labels, polygons = plan_labels(s, self.chosen), plan_polygons(s)
        here = None if s.p is None else (s.p[0], s.p[1])
        if self._held is None:
            places = [place for _, place, _ in labels] + [corner for corners, _ in polygons for corner in corners]
            scale, middle = fitting_view([*places, *([here] if here else [])], width, height)
            self._view = (scale / self._zoom, middle)
        else:
            labels.append(("◇", self._held[1], "warn"))
        on_ground = s.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
        lines, _ = draw_map(
            width=width,
            height=height,
            scale=self._view[0],
            centre=self._view[1],
            home=None,
            track=s.track,
            waypoints=[],
            vehicle=None if s.p is None else (s.p[0], s.p[1], s.heading or 0.0),
            target=None if s.goal is None or on_ground else s.goal[:2],
            circles=fence_circles(s),
            course=position_ahead(s),
            areas=[*fence_polygons(s), *polygons],
            labels=labels,
        )
        return lines

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        self._zoom = 1.0 if step == 0 else self._zoom * ZOOM_FACTOR**step
        self.redraw()

    def change_step(self, by: int) -> None:
        """Move by smaller or larger steps."""
        self._step = min(max(self._step + by, 0), len(MOVE_STEPS) - 1)
        self._show_step()

    def action_move(self, east: int, north: int, up: int) -> None:
        """Move the chosen waypoint by a step."""
        point = self._point(self.chosen)
        if point is not None:
            by, (x, y, z) = MOVE_STEPS[self._step], self._wanted_place(point)
            place = (x + by * east, y + by * north, z + by * up)
            self._wanted = (point.number, place, self.now)
            self.post_message(self.PointMoved(point.number, place))

    def _wanted_place(self, point: PlanPoint) -> Vector:
        """Where a waypoint is, or is about to be: keys may come faster than the vehicle's answers."""
        number, place, asked = self._wanted
        is_under_way = number == point.number and self.now - asked < ANSWER_TIME
        return place if is_under_way else point.position

    def _show_step(self) -> None:
        self.border_subtitle = f"step {MOVE_STEPS[self._step]:g} m"

    def _point(self, number: int) -> PlanPoint | None:
        plan = self.snapshot.flight_plan
        return None if plan is None else plan.points.get(number)

    # The mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of the waypoint under the mouse."""
        offset = event.get_content_offset(self)
        if offset is None:
            return
        number = self._nearest((offset.x, offset.y))
        if number:
            self._held = (number, self._place_at((offset.x, offset.y)))
            self.capture_mouse()
            self.post_message(self.PointChosen(number))

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Show where the waypoint would be put."""
        if self._held is not None:
            self._held = (self._held[0], self._place_at(self._cell(event)))
            self.redraw()

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Ask for the waypoint to be put there, unless the mouse did not move."""
        if self._held is None:
            return
        (number, _), self._held = self._held, None
        self.release_mouse()
        cell, point = self._cell(event), self._point(number)
        here = None if point is None else point_position(self.snapshot, point)
        if point is not None and here is not None and self._cell_of(here) != cell:
            north, east = self._place_at(cell)
            x, y, z = point.position
            self.post_message(self.PointMoved(number, (x + east - here[1], y + north - here[0], z)))
        self.redraw()

    def _cell(self, event: events.MouseEvent) -> tuple[int, int]:
        offset = event.get_content_offset_capture(self)
        return offset.x, offset.y

    def _place_at(self, cell: tuple[int, int]) -> NorthEast:
        return place_at(cell, *self.size, *self._view)

    def _cell_of(self, place: NorthEast) -> tuple[int, int]:
        (scale, (north, east)), (width, height) = self._view, self.size
        column = math.floor(width / 2 + (place[1] - east) * 2 / scale)
        return column, math.floor(height / 2 - (place[0] - north) / scale)

    def _nearest(self, cell: tuple[int, int]) -> int:
        """Number of the shown waypoint within reach of a cell; 0 without one."""
        plan = self.snapshot.flight_plan
        near: list[tuple[int, int]] = []
        for point in () if plan is None else plan.points.values():
            place = point_position(self.snapshot, point)
            if place is None or not point.is_shown:
                continue
            column, row = self._cell_of(place)
            away = max(abs(column - cell[0]), abs(row - cell[1]))
            near += [(away, point.number)] if away <= REACH else []
        return min(near)[1] if near else 0
