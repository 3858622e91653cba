"""The map panel, and a map whose numbered points are chosen and moved, by arrow keys or by the mouse."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar, Protocol

from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.state.fence_shapes import fence_circles, fence_polygons, rally_points
from darko_gcs.state.map_overlay import Overlay
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.map_content import (
    PlacedOverlay,
    flight_content,
    height_labels,
    home_place,
    loiter_circles,
    other_vehicles,
    plan_labels,
    plan_polygons,
    waypoints,
)
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.map_drawing import (
    MapBackground,
    MapContent,
    MapLabel,
    MapView,
    MapWindow,
    NorthEast,
    draw_map,
    fitting_view,
    place_at,
)
from darko_gcs.tui.widgets.flight_panel import BesideDecision, decision_summary
from darko_gcs.tui.widgets.panel import Panel
from protocol.frames import Vector

ZOOM_FACTOR = 2.0
WHEEL_STEP = 0.5  # of a zoom step
PAN_SHARE = 0.25  # of the map, by a key
FOLLOW_SHARE = 0.25  # of the map that the vehicle may go from its middle before a map that follows moves


class MapPanel(BesideDecision):
    """Home, fence and rally points, mission legs and circles, track, vehicle and its course, north up.

    Where the decision has no panel of its own, the lower border shows it.
    """

    SOURCES = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
    FRAMES = 2

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
        self.overlay = PlacedOverlay()
        self._view = MapView(1.0, (0.0, 0.0))  # as shown
        self._heights: tuple[object, list[MapLabel]] = (None, [])  # and what they were made of
        self._followed: NorthEast | None = None  # the middle while it follows
        self._is_due = False  # it was moved, and is about to be drawn
        self._background = MapBackground()
        self._held: tuple[NorthEast, tuple[int, int]] | None = None  # the place that the mouse holds, and its cell
        self._has_moved = False  # the mouse that holds it

    def on_mount(self) -> None:
        """Take the shapes that the pilot laid over all maps."""
        self.overlay = PlacedOverlay(getattr(self.app, "overlay", ()))

    def take_overlay(self, overlay: Overlay) -> None:
        """Lay other shapes over the map."""
        self.overlay = PlacedOverlay(overlay)
        self.redraw()

    def subtitle(self, s: Snapshot) -> str:
        """The decision, unless the values are old or it has a panel of its own."""
        return super().subtitle(s) or ("" if self.has_decision_panel() else decision_summary(s, self.size.width - 4))

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The map fills the panel."""
        others = other_vehicles(s, self.fleet)
        source = s.identity.source
        content = flight_content(
            s,
            name=str(source[0]) if others and source is not None else "",
            home=home_place(s),
            waypoints=[] if s.flies_plan else waypoints(s),
            circles=fence_circles(s) if s.flies_plan else [*loiter_circles(s), *fence_circles(s)],
            areas=[*fence_polygons(s), *plan_polygons(s)],
            labels=[*self._height_labels(s), *plan_labels(s)],
            rally=rally_points(s),
            others=others,
            overlay=self.overlay.shapes(s),
        )
        window = MapWindow(width, height, self.scale, self.middle or self._following(s, width, height))
        lines, self._view = draw_map(window, content, self._background)
        return lines

    def _height_labels(self, s: Snapshot) -> list[MapLabel]:
        """Heights of the mission's items: placed again only when mission or home are others."""
        if s.flies_plan:
            return []
        key = (s.plans.mission, s.position.home, s.position.home_p)
        if key != self._heights[0]:
            self._heights = (key, height_labels(s))
        return self._heights[1]

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
        if self.scale is None or s.position.p is None:
            return None
        here, near = (s.position.p[0], s.position.p[1]), self._followed
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


MOVE_STEPS = (0.1, 0.25, 0.5, 1.0, 5.0, 25.0)  # of a point by a key [m]
FIRST_EXTENT = 200.0  # of a map without a point: what a first plan may be about [m]
SCALES = (0.01, 10_000.0)  # nearest and farthest [m per cell height]
REACH = 2  # cells from a point within which the mouse takes hold of it


class MapSource(Protocol):
    """Tells what lies on the map."""

    def places(self, s: Snapshot) -> Mapping[int, NorthEast]:
        """Positions of the points that can be moved, by number [m]."""

    def content(self, s: Snapshot, chosen: int) -> MapContent:
        """All that is on the map, with a mark on the chosen point."""

    def is_empty(self, s: Snapshot) -> bool:
        """True while nothing says how large the place is."""


class MovableMap(Panel, can_focus=True):
    """North up; while the mouse holds a point, the map stands still.

    It moves nothing itself: it posts what is to be moved.

    Args:
        title: In its border.
        source: Tells what lies on it.
        id: As Textual's.
    """

    class PointChosen(Message):
        """The mouse took hold of a point."""

        def __init__(self, number: int) -> None:
            super().__init__()
            self.number = number

    class PointMoved(Message):
        """A point is to be moved: north, east and up [m]."""

        def __init__(self, number: int, by: Vector) -> None:
            super().__init__()
            self.number, self.by = number, by

    class PlacePressed(Message):
        """The mouse was pressed where no point is."""

        def __init__(self, place: NorthEast) -> None:
            super().__init__()
            self.place = place

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(0, 1, 0)", "Move", key_display="arrows", tooltip="Move the chosen point (on the map)"),
        Binding("down", "move(0, -1, 0)", "", show=False),
        Binding("right", "move(1, 0, 0)", "", show=False),
        Binding("left", "move(-1, 0, 0)", "", show=False),
        Binding(
            "pageup",
            "move(0, 0, 1)",
            "Raise",
            show=False,
            key_display="pgup pgdn",
            tooltip="Raise or lower the chosen point (on the map)",
        ),
        Binding("pagedown", "move(0, 0, -1)", "", show=False),
    ]
    chosen: reactive[int] = reactive(0, repaint=False)  # number of a point

    def __init__(self, title: str, source: MapSource, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self._source, self._background = source, MapBackground()
        self.fleet: tuple[Snapshot, ...] = ()  # all vehicles on the link
        self.overlay = PlacedOverlay()
        self._scale: float | None = None  # metres per cell height; None: fit everything
        self._is_first = False  # the scale is that for a first plan
        self._step = MOVE_STEPS.index(0.5)
        self._view: tuple[float, NorthEast] = (1.0, (0.0, 0.0))  # scale, middle
        self._held: tuple[int, NorthEast] | None = None  # the point that the mouse holds, and where
        self.pressed: NorthEast | None = None  # the last place that was clicked without a point
        self._show_step()

    def on_mount(self) -> None:
        """Take the shapes that the pilot laid over all maps."""
        self.overlay = PlacedOverlay(getattr(self.app, "overlay", ()))

    def take_overlay(self, overlay: Overlay) -> None:
        """Lay other shapes over the map."""
        self.overlay = PlacedOverlay(overlay)
        self.redraw()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Nothing is moved in a recording."""
        return not (action == "move" and self.snapshot.session.is_replay) and super().check_action(action, parameters)

    # The view

    @property
    def middle(self) -> NorthEast:
        """North and east of the middle as shown [m]."""
        return self._view[1]

    def watch_chosen(self) -> None:
        """Mark another point."""
        self.redraw()

    def places(self) -> Mapping[int, NorthEast]:
        """Positions of the points that can be moved, by number [m]."""
        return self._source.places(self.snapshot)

    def subtitle(self, s: Snapshot) -> str:
        """Distance by which a key moves a point, or that the values are old."""
        return super().subtitle(s) or self.step_text

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """Everything fits unless the pilot zooms; zoomed in, the chosen point is in the middle."""
        content = self._source.content(s, self.chosen)
        content = replace(content, overlay=self.overlay.shapes(s), others=other_vehicles(s, self.fleet))
        self._fit(content.places, width, height, about=self._source.places(s).get(self.chosen))
        if self._held is not None:
            content = replace(content, labels=[*content.labels, ("◇", self._held[1], "warn")])
        return draw_map(MapWindow(width, height, *self._view), content, self._background)[0]

    def _fit(self, places: Sequence[NorthEast], width: int, height: int, about: NorthEast | None) -> None:
        """Choose scale and middle: the map stands still while the mouse holds a point.

        Zoomed out it stands still as well for as long as it shows all places: points are put there one after another.

        Args:
            places: What it shows, unless it is zoomed in.
            width: Cells.
            height: Cells.
            about: Its middle while it is zoomed in; None: that of all places.
        """
        if self._held is not None:
            return
        scale, middle = fitting_view(places, width, height)
        if (self._scale is None or self._is_first) and self._source.is_empty(self.snapshot):
            self._is_first = True
            self._scale = max(scale, FIRST_EXTENT / min(height, width / 2))
        if self._scale is not None and self._shows(places, self._scale, width, height):
            middle = self._view[1]
        elif self._scale is not None and self._scale < scale:
            middle = about or middle
        self._view = (self._scale or scale, middle)

    def _shows(self, places: Sequence[NorthEast], scale: float, width: int, height: int) -> bool:
        """Whether all places would be seen about the present middle."""
        north, east = self._view[1]
        return all(
            abs(place[0] - north) < scale * height / 2 and abs(place[1] - east) < scale * width / 4 for place in places
        )

    def fit_plan(self) -> None:
        """Fit a plan that was not drawn here, unless the pilot has chosen a scale."""
        if self._is_first:
            self.zoom(0)

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
        self._is_first = False
        wanted = (self._scale or self._view[0]) / ZOOM_FACTOR**step
        self._scale = None if step == 0 else min(max(wanted, SCALES[0]), SCALES[1])
        self.redraw()

    def change_step(self, by: int) -> None:
        """Move by smaller or larger steps."""
        self._step = min(max(self._step + by, 0), len(MOVE_STEPS) - 1)
        self._show_step()

    def action_move(self, east: int, north: int, up: int) -> None:
        """Move the chosen point by a step."""
        by = MOVE_STEPS[self._step]
        if self.chosen in self.places():
            self.post_message(self.PointMoved(self.chosen, (by * north, by * east, by * up)))

    @property
    def step_text(self) -> str:
        """Distance by which a key moves a point, in words."""
        return f"step {MOVE_STEPS[self._step]:g} m (< >)"

    def _show_step(self) -> None:
        self.border_subtitle = self.step_text

    # The mouse

    def on_mouse_down(self, event: events.MouseDown) -> None:
        """Take hold of the point under the mouse."""
        offset = event.get_content_offset(self)
        if offset is None:
            return
        place, number = self._place_at((offset.x, offset.y)), self._nearest((offset.x, offset.y))
        if number is None:
            self._is_first = self._is_first or self._scale is None
            self._scale, self.pressed = self._view[0], place  # else the map would move under the mouse
            self.post_message(self.PlacePressed(place))
            return
        self._held = (number, place)
        self.capture_mouse()
        self.post_message(self.PointChosen(number))

    def on_mouse_move(self, event: events.MouseMove) -> None:
        """Show where the point would be put."""
        if self._held is not None:
            self._held = (self._held[0], self._place_at(self._cell(event)))
            self.redraw()

    def on_mouse_up(self, event: events.MouseUp) -> None:
        """Put the point there, unless the mouse did not move."""
        if self._held is None:
            return
        (number, _), self._held = self._held, None
        self.release_mouse()
        cell, here = self._cell(event), self.places().get(number)
        if here is not None and self._cell_of(here) != cell:
            north, east = self._place_at(cell)
            self.post_message(self.PointMoved(number, (north - here[0], east - here[1], 0.0)))
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

    def _nearest(self, cell: tuple[int, int]) -> int | None:
        """Number of the point within reach of a cell; None without one."""
        near: list[tuple[int, int]] = []
        for number, place in self.places().items():
            column, row = self._cell_of(place)
            away = max(abs(column - cell[0]), abs(row - cell[1]))
            near += [(away, number)] if away <= REACH else []
        return min(near)[1] if near else None
