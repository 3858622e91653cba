"""A map whose numbered points are chosen and moved, by arrow keys or by the mouse."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import ClassVar

from textual import events
from textual.binding import Binding, BindingType
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.tui.maps.map_panel import ZOOM_FACTOR
from darko_gcs.tui.render.map_drawing import NorthEast, fitting_view, place_at
from darko_gcs.tui.widgets.panel import Panel

__all__ = ["MOVE_STEPS", "MovableMap"]

MOVE_STEPS = (0.1, 0.25, 0.5, 1.0, 5.0, 25.0)  # of a point by a key [m]
SCALES = (0.01, 10_000.0)  # nearest and farthest [m per cell height]
REACH = 2  # cells from a point within which the mouse takes hold of it


class MovableMap(Panel, can_focus=True):
    """North up; while the mouse holds a point, the map stands still."""

    class PointChosen(Message):
        """The mouse took hold of a point."""

        def __init__(self, number: int) -> None:
            super().__init__()
            self.number = number

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up", "move(0, 1, 0)", "Move", key_display="arrows", tooltip="Move the chosen point (on the map)"),
        Binding("down", "move(0, -1, 0)", "South", show=False),
        Binding("right", "move(1, 0, 0)", "East", show=False),
        Binding("left", "move(-1, 0, 0)", "West", show=False),
        Binding("pageup", "move(0, 0, 1)", "Higher", show=False),
        Binding("pagedown", "move(0, 0, -1)", "Lower", show=False),
    ]
    chosen: reactive[int] = reactive(0, repaint=False)  # number of a point

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self._scale: float | None = None  # metres per cell height; None: fit everything
        self._step = MOVE_STEPS.index(0.5)
        self._view: tuple[float, NorthEast] = (1.0, (0.0, 0.0))  # scale, middle
        self._held: tuple[int, NorthEast] | None = None  # the point that the mouse holds, and where
        self._show_step()

    # What each kind of map does its own way

    def places(self) -> Mapping[int, NorthEast]:
        """Where the points are that can be taken hold of, by number [m].

        Raises:
            NotImplementedError: Always, here.
        """
        raise NotImplementedError

    def move_by(self, east: float, north: float, up: float) -> None:
        """Move the chosen point [m].

        Raises:
            NotImplementedError: Always, here.
        """
        raise NotImplementedError

    def drop(self, number: int, place: NorthEast) -> None:
        """Put a point where the mouse let it go.

        Raises:
            NotImplementedError: Always, here.
        """
        raise NotImplementedError

    def click(self, place: NorthEast) -> None:
        """The mouse was pressed where no point is: does nothing, unless a kind of map says what."""

    # The view

    def watch_chosen(self) -> None:
        """Mark another point."""
        self.redraw()

    @property
    def held(self) -> NorthEast | None:
        """Where the mouse holds a point; None: it holds none."""
        return None if self._held is None else self._held[1]

    def fit(
        self, places: Sequence[NorthEast], width: int, height: int, about: NorthEast | None = None
    ) -> tuple[float, NorthEast]:
        """Scale [m per cell height] and middle of the map: it stands still while the mouse holds a point.

        Zoomed out it stands still as well for as long as it shows all places: points are put there one after another.

        Args:
            places: What it shows, unless it is zoomed in.
            width: Cells.
            height: Cells.
            about: Its middle while it is zoomed in; None: that of all places.
        """
        if self._held is not None:
            return self._view
        scale, middle = fitting_view(places, width, height)
        if self._scale is not None and self._scale < scale:
            middle = about or middle
        elif self._scale is not None and self._shows(places, self._scale, width, height):
            middle = self._view[1]
        self._view = (self._scale or scale, middle)
        return self._view

    def _shows(self, places: Sequence[NorthEast], scale: float, width: int, height: int) -> bool:
        """Whether all places would be seen about the present middle."""
        north, east = self._view[1]
        return all(
            abs(place[0] - north) < scale * height / 2 and abs(place[1] - east) < scale * width / 4 for place in places
        )

    def zoom(self, step: int) -> None:
        """In (+1), out (-1), or fit everything again (0)."""
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
        self.move_by(by * east, by * north, by * up)

    @property
    def step_text(self) -> str:
        """How far a key moves a point."""
        return f"step {MOVE_STEPS[self._step]:g} m"

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
            self.click(place)
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
            self.drop(number, self._place_at(cell))
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
