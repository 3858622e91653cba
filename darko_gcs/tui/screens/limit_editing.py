"""The mission screen's edits of fence and rally points: as those of the mission, nothing reaches the vehicle."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from darko_gcs.state.fence_edits import (
    FENCE_CHOICES,
    RALLY_HEIGHT,
    TURNED,
    area_words,
    limit_item,
    limit_label,
    new_area,
    turned,
    with_corner,
    without,
)
from darko_gcs.state.fence_edits import RALLY as RALLY_COMMAND
from darko_gcs.state.fence_shapes import CIRCLE_STATES, POLYGON_STATES
from darko_gcs.state.mission_items import place_of, shifted
from darko_gcs.state.mission_legs import inserted, removed, replaced
from darko_gcs.state.number_ranges import DISTANCE, HEIGHT, RADIUS, fault_words
from darko_gcs.state.values import FENCE, RALLY, Items
from darko_gcs.tui.render.map_drawing import NorthEast
from darko_gcs.tui.screens.dialogs import (
    EAST_LABEL,
    NORTH_LABEL,
    SOUTH_HELP,
    WEST_HELP,
    AskScreen,
    ChooseScreen,
    FormField,
)
from darko_gcs.tui.screens.mission_editing import DraftEditing
from protocol.errors import LocalProtocolError
from protocol.frames import Geodetic, Vector
from protocol.plans import MissionItem

if TYPE_CHECKING:
    from darko_gcs.tui.screens.mission_screen import MissionScreen

NO_HOME = "Home is not known yet: nothing can be put on the map"


class LimitEditing(DraftEditing):
    """Edits of the draft's fence or rally points by keys, form and map.

    Args:
        screen: Shows the draft.
        kind: MAV_MISSION_TYPE of what is edited.
    """

    def __init__(self, screen: MissionScreen, kind: int) -> None:
        super().__init__(screen)
        self._kind = kind

    @property
    def _items(self) -> Items:
        return self._screen.draft.fence if self._kind == FENCE else self._screen.draft.rally

    def _home(self) -> tuple[Geodetic, Vector] | None:
        position = self._screen.snapshot.position
        if position.home is None:
            self._screen.show_notice(NO_HOME)
            return None
        return position.home, position.home_p

    # Keys

    def edit(self) -> None:
        """Edit the item under the cursor: metres from home, and its radius or its height."""
        home, row = self._home(), self._row
        if home is None or row >= len(self._items):
            return
        item = self._items[row]
        place = place_of(item, *home)
        if place is None:
            self._screen.show_notice("The item has no place on the map")
            return
        north, east = (f"{round(part - own, 2) + 0.0:.2f}" for part, own in zip(place[:2], home[1], strict=False))
        fields = [FormField(NORTH_LABEL, north, SOUTH_HELP), FormField(EAST_LABEL, east, WEST_HELP)]
        ranges = [DISTANCE, DISTANCE]
        if item.command in CIRCLE_STATES:
            fields.append(FormField("Radius [m]", f"{item.params[0]:.7g}", "Of the circle around this place"))
            ranges.append(RADIUS)
        elif item.command not in POLYGON_STATES:
            fields.append(FormField("Altitude [m]", f"{item.z:.7g}", "Above home, at which it comes back here"))
            ranges.append(HEIGHT)
        before = tuple(field.value for field in fields)

        def check(values: tuple[str, ...]) -> str | None:
            return self._edit(row, before, values, home)

        self._screen.show_notice("")
        title = f"{row} {limit_label(self._items, row)}"
        self._screen.app.push_screen(AskScreen(title, fields, check, ranges=ranges))

    def _edit(
        self, row: int, before: tuple[str, ...], values: tuple[str, ...], home: tuple[Geodetic, Vector]
    ) -> str | None:
        item = self._items[row]
        north, east = (float(new) - float(old) for old, new in zip(before[:2], values, strict=False))
        try:
            item = shifted(item, (north, east, 0.0), *home) if north or east else item
        except (ValueError, LocalProtocolError) as error:
            return fault_words(error)
        if values[2:] != before[2:]:
            third = float(values[2])
            if item.command in CIRCLE_STATES:
                item = replace(item, params=(third, *item.params[1:]))
            else:
                item = replace(item, z=third)
        return self._change(replaced(self._items, row, item), row)

    def insert(self, _below: int) -> None:
        """Put an area around the place that was clicked last, or a rally point there; else the middle of the map."""
        home = self._home()
        if home is None:
            return
        middle = self._screen.map.pressed or self._screen.map.middle
        if self._kind == RALLY:
            self.add_waypoint(middle)
            return

        def chosen(number: int | None) -> None:
            if number is not None:
                command = tuple(FENCE_CHOICES.values())[number]
                before = self._items
                self._change((*before, *new_area(command, middle, *home)), len(before))
                if self._items != before:
                    self._screen.show_notice(area_words(command, middle, home[1]))

        self._screen.show_notice("")
        self._screen.app.push_screen(ChooseScreen("Put into the fence", tuple(FENCE_CHOICES)), chosen)

    def remove(self) -> None:
        """Remove the corner, circle or point under the cursor."""
        items, row = self._items, self._row
        if row < len(items):
            self._change(without(items, row) if self._kind == FENCE else removed(items, row), row)
            if not self._items:
                self._screen.show_notice("The vehicle keeps what it has: c deletes it there")

    def turn(self) -> None:
        """Stay out of the area instead of in it, or the other way round."""
        items, row = self._items, self._row
        if row < len(items) and items[row].command in TURNED:
            self._change(turned(items, row), row)

    # The map

    def step(self, by: int) -> None:
        """Move points by smaller or larger steps."""
        self._screen.map.change_step(by)

    def shift(self, seq: int, by: Vector) -> None:
        """Move a corner, circle or point: north, east and up [m]."""
        home = self._home()
        if home is None or seq >= len(self._items):
            return
        item = self._items[seq]
        is_flat = self._kind == FENCE
        try:
            item = shifted(item, (by[0], by[1], 0.0 if is_flat else by[2]), *home)
        except (ValueError, LocalProtocolError) as error:
            self._screen.show_notice(fault_words(error))
            return
        self._change(replaced(self._items, seq, item), seq)

    def add_waypoint(self, place: NorthEast) -> None:
        """A corner after the chosen one, or a rally point as high as the chosen one."""
        home, items, row = self._home(), self._items, self._row
        if home is None:
            return
        try:
            if self._kind == RALLY:
                height = items[row].z if row < len(items) else RALLY_HEIGHT
                item = limit_item(RALLY_COMMAND, place, 0.0, height, *home)
                item = replace(item, frame=items[row].frame) if row < len(items) else item
                self._change(inserted(items, row + 1 if items else 0, (item,)), row + 1 if items else 0)
            elif row < len(items) and items[row].command in POLYGON_STATES:
                corner = limit_item(items[row].command, place, 0.0, 0.0, *home)
                self._change(with_corner(items, row, corner), row + 1)
            else:
                self._screen.show_notice("i puts a polygon or a circle there; a click chooses a corner or adds one")
        except LocalProtocolError as error:
            self._screen.show_notice(fault_words(error))

    # Inside

    def _change(self, items: Items, row: int) -> str | None:
        """Make an edit; what is wrong with it, or None."""
        if self._screen.snapshot.session.is_replay:
            self._screen.show_notice("The plans of a recording cannot be edited")
            return None
        self._screen.show_notice("")
        try:
            self._screen.draft.edit_limits(self._kind, items)
        except LocalProtocolError as error:
            self._screen.show_notice(fault_words(error))
            return fault_words(error)
        self._screen.show_draft(min(row, max(len(items) - 1, 0)))
        return None


def limit_cells(items: Items, seq: int, item: MissionItem, home: Geodetic | None, home_p: Vector) -> tuple[str, ...]:
    """Cells of the table: number, label, north and east of home, height of a rally point."""
    place = None if home is None else place_of(item, home, home_p)
    north, east = ("", "") if place is None else (f"{place[k] - home_p[k] + 0.0:.1f}" for k in (0, 1))
    height = f"{item.z:.1f}" if item.command == RALLY_COMMAND else ""
    return f"{seq:>2} ", f"{limit_label(items, seq)} ", f"{north:>7} ", f"{east:>7} ", f"{height:>8} "
