"""The map panel, and where the mission's items lie on it."""

from __future__ import annotations

from textual import events
from textual.message import Message

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.maps.map_content import (
    fence_circles,
    fence_polygons,
    flight_content,
    home_place,
    loiter_circles,
    other_vehicles,
    plan_labels,
    plan_polygons,
    rally_points,
    waypoints,
)
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_background import MapBackground
from darko_gcs.tui.render.map_drawing import MapView, MapWindow, NorthEast, draw_map, place_at
from darko_gcs.tui.widgets.decision_panel import BesideDecision, decision_summary

ZOOM_FACTOR = 2.0
WHEEL_STEP = 0.5  # of a zoom step
PAN_SHARE = 0.25  # of the map, by a key
FOLLOW_SHARE = 0.25  # of the map that the vehicle may go from its middle before a map that follows moves


class MapPanel(BesideDecision):
    """Home, fence and rally points, mission legs and circles, track, vehicle and its course, north up.

    Where the decision has no panel of its own, the lower border shows it.
    """

    SOURCES = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")

    class PlaceClicked(Message):
        """A place was clicked: north and east in the vehicle's local frame [m]."""

        def __init__(self, place: NorthEast) -> None:
            super().__init__()
            self.place = place

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self.scale: float | None = None  # metres per cell height; None: fit everything
        self.middle: NorthEast | None = None  # where the operator moved it; None: follow the vehicle
        self.fleet: tuple[Snapshot, ...] = ()  # all vehicles on the link
        self._view = MapView(1.0, (0.0, 0.0))  # as shown
        self._followed: NorthEast | None = None  # the middle while it follows
        self._is_due = False  # it was moved, and is about to be drawn
        self._background = MapBackground()
        self._held: tuple[NorthEast, tuple[int, int]] | None = None  # the place that the mouse holds, and its cell
        self._has_moved = False  # the mouse that holds it

    def subtitle(self, s: Snapshot) -> str:
        """The decision, unless the values are old or it has a panel of its own."""
        return super().subtitle(s) or ("" if self.has_decision_panel() else decision_summary(s, self.size.width - 2))

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The map fills the panel."""
        content = flight_content(
            s,
            home=home_place(s),
            waypoints=[] if s.flies_plan else waypoints(s),
            circles=fence_circles(s) if s.flies_plan else [*loiter_circles(s), *fence_circles(s)],
            areas=[*fence_polygons(s), *plan_polygons(s)],
            labels=plan_labels(s),
            rally=rally_points(s),
            others=other_vehicles(s, self.fleet),
        )
        window = MapWindow(width, height, self.scale, self.middle or self._following(s, width, height))
        lines, self._view = draw_map(window, content, self._background)
        return lines

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        if step == 0:
            self.scale = self.middle = None
        else:
            self.scale = (self.scale or self._view.scale) / ZOOM_FACTOR**step
        self._followed = None
        self.redraw()

    def pan(self, east: int, north: int) -> None:
        """Move the map by a share of it; it does not follow the vehicle any more."""
        (scale, middle), (width, height) = self._view, self.size
        step = PAN_SHARE * scale * min(height, width / 2)
        self._show_around((middle[0] + north * step, middle[1] + east * step))

    def follow(self) -> None:
        """Have the vehicle in the middle, as large as the map is now."""
        self.scale, self.middle, self._followed = self._view.scale, None, None
        self.redraw()

    def _following(self, s: Snapshot, width: int, height: int) -> NorthEast | None:
        """The middle of a map that follows: it stands still for a while, or all of it would be drawn every time."""
        if self.scale is None or s.p is None:
            return None
        here, near = (s.p[0], s.p[1]), self._followed
        reach = FOLLOW_SHARE * self.scale * height, FOLLOW_SHARE * self.scale * width / 2
        if near is None or abs(here[0] - near[0]) > reach[0] or abs(here[1] - near[1]) > reach[1]:
            self._followed = here
        return self._followed

    def _show_around(self, middle: NorthEast) -> None:
        """Stand there; events that have come already are heeded before it is drawn."""
        self._view = self._view._replace(middle=middle)
        self.scale, self.middle = self._view.scale, middle
        if not self._is_due:
            self._is_due = True
            self.call_later(self._draw_moved)

    def _draw_moved(self) -> None:
        self._is_due = False
        self.redraw()

    # The mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of the map."""
        offset = event.get_content_offset(self)
        if offset is not None and event.button == 1:
            cell = (offset.x, offset.y)
            self._held, self._has_moved = (self.place_at(cell), cell), False
            self.capture_mouse()

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Move the map with the mouse that holds it."""
        if self._held is None:
            return
        offset, (place, pressed) = event.get_content_offset_capture(self), self._held
        cell = (offset.x, offset.y)
        self._has_moved = self._has_moved or cell != pressed
        if self._has_moved:
            self._put_under(cell, place)

    def on_mouse_up(self, event: events.MouseUp) -> None:  # noqa: ARG002 - where it was pressed counts
        """Let go; a mouse that did not move has clicked a place."""
        if self._held is None:
            return
        (place, _), self._held = self._held, None
        self.release_mouse()
        if not self._has_moved:
            self.post_message(self.PlaceClicked(place))

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Zoom in on the place under the mouse."""
        self._zoom_at(event, WHEEL_STEP)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Zoom out from the place under the mouse."""
        self._zoom_at(event, -WHEEL_STEP)

    def _zoom_at(self, event: events.MouseEvent, step: float) -> None:
        event.stop()
        offset = event.get_content_offset(self)
        if offset is None:
            return
        cell = (offset.x, offset.y)
        place = self.place_at(cell)
        self._view = self._view._replace(scale=self._view.scale / ZOOM_FACTOR**step)
        self._put_under(cell, place)

    def _put_under(self, cell: tuple[int, int], place: NorthEast) -> None:
        """Move the map so that a place lies in a cell."""
        there, middle = self.place_at(cell), self._view.middle
        self._show_around((middle[0] + place[0] - there[0], middle[1] + place[1] - there[1]))

    def place_at(self, cell: tuple[int, int]) -> NorthEast:
        """North and east of the middle of a cell (column, row) [m]."""
        return place_at(cell, *self.size, *self._view)
