"""The mission screen's edits: nothing here reaches the vehicle, and every edit can be taken back."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from darko_gcs.state.mission_items import (
    MISSION_COMMANDS,
    WAYPOINT,
    MissionCommand,
    edited_item,
    field_help,
    item_fields,
    mission_command_of,
    new_item,
    place_of,
    shifted,
)
from darko_gcs.state.mission_legs import (
    LEG_ENDS,
    asked_leg_modes,
    inserted,
    moved,
    removed,
    replaced,
    with_leg_mode,
)
from darko_gcs.state.number_ranges import DISTANCE, HEIGHT, fault_words, number_problem
from darko_gcs.state.return_goal import LANDINGS
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted
from darko_gcs.state.values import Items
from darko_gcs.tui.render.map_drawing import NorthEast
from darko_gcs.tui.screens.dialogs import SOUTH_HELP, WEST_HELP, AskScreen, Check, ChooseScreen, FormField
from darko_gcs.tui.screens.survey_editing import ask_survey
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.errors import LocalProtocolError
from protocol.frames import Vector
from protocol.names import RELATIVE_ALTITUDE_FRAMES, is_global_frame
from protocol.plans import MissionItem

if TYPE_CHECKING:
    from darko_gcs.tui.screens.mission_screen import MissionScreen

NO_PLACE_YET = "Insert: home is not known yet, so only items without a place"
LOW_HEIGHT = 3.0  # of a first item while the vehicle is on the ground [m]
FAR, FAR_HEIGHT = 40.0, 20.0  # from home, from which on a first waypoint of the map is put higher, and how high [m]
OWN_LEG_MODES = (LegMode.NONE, LegMode.HOVER, LegMode.FORWARD)  # of a vehicle that chooses by itself
OTHER_LEG_MODES = (LegMode.HOVER, LegMode.FORWARD)


class DraftEditing:
    """Edits of any part of the draft: they are taken back in the order in which they were made.

    Args:
        screen: Shows the draft.
    """

    def __init__(self, screen: MissionScreen) -> None:
        self._screen = screen

    @property
    def _row(self) -> int:
        return self._screen.table.cursor_row

    def undo(self) -> None:
        """Take the last edit of the plan back."""
        self._after(self._screen.draft.undo(), "Nothing to undo")

    def redo(self) -> None:
        """Make the edit again that was taken back last."""
        self._after(self._screen.draft.redo(), "Nothing to redo")

    def _after(self, is_done: bool, otherwise: str) -> None:
        self._screen.show_notice("" if is_done else otherwise)
        if is_done:
            self._screen.show_draft(self._row)


class MissionEditing(DraftEditing):
    """Edits of the mission by keys, form and map."""

    @property
    def _items(self) -> Items:
        return self._screen.draft.plan.items

    # Keys

    def edit(self) -> None:
        """Edit the item under the cursor, with a field for each parameter of its command."""
        if self._items:
            row = self._row
            item = self._items[row]
            title = f"Item {row}: {mission_command_of(item).label}"
            metres = _metre_fields(item, self._screen.snapshot)
            fields = [FormField(label, text, field_help(label)) for label, text in item_fields(item)]
            self._ask(title, [*fields, *metres], lambda values: self._edit(row, values, metres))

    def _edit(self, row: int, values: tuple[str, ...], metres: Sequence[FormField]) -> str | None:
        items, s = self._items, self._screen.snapshot
        own, asked = values[: len(values) - len(metres)], values[len(values) - len(metres) :]
        try:
            item = edited_item(items[row], own, s.position.home, s.position.home_p)
            item = _moved_to(items[row], item, metres, asked, s)
        except (ValueError, LocalProtocolError) as error:
            return fault_words(error)
        self._change(replaced(items, row, item), row)
        if item.command != items[row].command:  # the new command has other parameters: show them
            self._screen.app.call_after_refresh(self.edit)
        return None

    def insert(self, below: int) -> None:
        """Insert an item by the cursor, at the place of the nearest item before it, or where the vehicle is."""
        items = self._items
        row = self._row + below if items else 0
        possible = [kind for kind in MISSION_COMMANDS if self._new_item(kind, row) is not None]

        def chosen(number: int | None) -> None:
            item = None if number is None else self._new_item(possible[number], row)
            if item is not None:
                self._change(inserted(items, row, (item,)), row)

        self._screen.show_notice("")
        title = "Insert" if len(possible) == len(MISSION_COMMANDS) else NO_PLACE_YET
        self._screen.app.push_screen(ChooseScreen(title, [kind.label for kind in possible]), chosen)

    def _new_item(self, kind: MissionCommand, row: int) -> MissionItem | None:
        before = reversed(self._items[:row])
        near = next((item for item in before if mission_command_of(item).has_place and item.x), None)
        return new_item(kind, near, _here(self._screen.snapshot))

    def heights(self) -> None:
        """Ask for one height of all items above home, but landings, or a step by which to raise or lower them."""
        rows = [row for row, item in enumerate(self._items) if _has_height(item)]
        if not rows:
            self._screen.show_notice("No item has a height above home")
            return

        def check(values: tuple[str, ...]) -> str | None:
            height, is_step = float(values[0]), values[0].strip()[:1] in {"+", "-"}
            new = {row: round(self._items[row].z + height if is_step else height, 3) for row in rows}
            faults = (number_problem("Height above home [m]", f"{z:g}", HEIGHT) for z in new.values())
            if fault := next(filter(None, faults), None):
                return fault
            self._change(
                tuple(replace(item, z=new.get(row, item.z)) for row, item in enumerate(self._items)), self._row
            )
            return None

        self._screen.show_notice("")
        highest = max(self._items[row].z for row in rows)
        fields = [FormField("Height above home [m]", f"{highest:g}", "+5 raises, -5 lowers all by 5 m")]
        title = f"One height for {counted(len(rows), 'item')}"
        self._screen.app.push_screen(AskScreen(title, fields, check, ranges=[HEIGHT]))

    def survey(self) -> None:
        """Ask for an area and lines over it, and put their waypoints below the cursor."""

        def insert(items: Sequence[MissionItem]) -> None:
            row = self._row + 1 if self._items else 0
            self._change(inserted(self._items, row, items), row)

        ask_survey(self._screen, insert)

    def duplicate(self) -> None:
        """Put the same item below the one under the cursor."""
        if self._items:
            row = self._row
            self._change(inserted(self._items, row + 1, (self._items[row],)), row + 1)

    def remove(self) -> None:
        """Remove the item under the cursor."""
        if self._items:
            row = self._row
            self._change(removed(self._items, row), row)

    def leg_mode(self) -> None:
        """Another leg mode for the leg to the item under the cursor; the other legs keep theirs."""
        items, row = self._items, self._row
        if not items:
            return
        if items[row].command not in LEG_ENDS:
            self._screen.show_notice("No leg leads to this item: nothing to fly in hover or forward")
            return
        s = self._screen.snapshot
        modes = OTHER_LEG_MODES if not s.is_darko and s.identity.source is not None else OWN_LEG_MODES
        present = asked_leg_modes(items)[row]
        leg_mode = modes[(modes.index(present) + 1) % len(modes)] if present in modes else modes[0]
        self._change(*with_leg_mode(items, row, leg_mode))

    def move(self, step: int) -> None:
        """Move the item under the cursor up or down."""
        row = self._row
        if 0 <= row + step < len(self._items):
            self._change(moved(self._items, row, row + step), row + step)

    # The map

    def step(self, by: int) -> None:
        """Move items by smaller or larger steps."""
        self._screen.map.change_step(by)

    def shift(self, seq: int, by: Vector) -> None:
        """Move an item: north, east and up [m]."""
        home, items = self._screen.snapshot.position.home, self._items
        if home is None or seq >= len(items):
            self._screen.show_notice("Home is not known yet: no item can be moved on the map")
            return
        try:
            item = shifted(items[seq], by, home, self._screen.snapshot.position.home_p)
        except (ValueError, LocalProtocolError) as error:
            self._screen.show_notice(fault_words(error))
            return
        self._change(replaced(items, seq, item), seq)

    def add_waypoint(self, place: NorthEast) -> None:
        """A new waypoint below the cursor, as high as the item before it."""
        s = self._screen.snapshot
        items, home, home_p = self._items, s.position.home, s.position.home_p
        row = self._row + 1 if items else 0
        item = self._new_item(WAYPOINT, row)
        here = None if item is None or home is None else place_of(item, home, home_p)
        if item is None or home is None or here is None:
            self._screen.show_notice("Home is not known yet: no item can be put on the map")
            return
        is_far = not items and not s.status.is_airborne and math.dist(place, home_p[:2]) >= FAR
        by = (place[0] - here[0], place[1] - here[1], FAR_HEIGHT - LOW_HEIGHT if is_far else 0.0)
        self._change(inserted(items, row, (shifted(item, by, home, home_p),)), row)

    # Inside

    def _ask(self, title: str, fields: Sequence[FormField], check: Check) -> None:
        """Ask until ``check`` finds nothing wrong."""
        self._screen.show_notice("")
        self._screen.app.push_screen(AskScreen(title, fields, check))

    def _change(self, items: Items, row: int) -> None:
        if self._screen.snapshot.session.is_replay:
            self._screen.show_notice("The mission of a recording cannot be edited")
            return
        self._screen.show_notice("")
        self._screen.draft.edit(items)
        self._screen.show_draft(row)


def _has_height(item: MissionItem) -> bool:
    """True of an item that is flown to at a height above home, and not to land there."""
    is_relative = item.frame in RELATIVE_ALTITUDE_FRAMES
    return is_relative and mission_command_of(item).has_place and item.command not in LANDINGS


def _metre_fields(item: MissionItem, s: Snapshot) -> list[FormField]:
    """North and east of home [m], for those who do not think in degrees; empty without a place on the globe."""
    is_placed = s.position.home is not None and is_global_frame(item.frame) and mission_command_of(item).has_place
    place = place_of(item, s.position.home, s.position.home_p) if is_placed and s.position.home is not None else None
    if place is None:
        return []
    north, east = (
        f"{round(part - home, 2) + 0.0:.2f}" for part, home in zip(place[:2], s.position.home_p[:2], strict=True)
    )
    return [
        FormField("or north of home [m]", north, f"In place of latitude and longitude. {SOUTH_HELP}"),
        FormField("and east of home [m]", east, f"In place of latitude and longitude. {WEST_HELP}"),
    ]


def _moved_to(
    before: MissionItem, item: MissionItem, metres: Sequence[FormField], asked: Sequence[str], s: Snapshot
) -> MissionItem:
    """The item at the place that was typed in metres, if one was.

    Raises:
        ValueError: A field is no number, or the place was changed in degrees, too.
        LocalProtocolError: The place does not fit the wire.
    """
    changed = [(field.label, new) for field, new in zip(metres, asked, strict=True) if field.value != new]
    if not changed or s.position.home is None:
        return item
    if (item.x, item.y) != (before.x, before.y):
        raise ValueError("Change the place in degrees or in metres, not in both")
    for label, new in changed:
        if problem := number_problem(label, new, DISTANCE):
            raise ValueError(problem)
    north, east = (float(new) - float(field.value) for field, new in zip(metres, asked, strict=True))
    return shifted(item, (north, east, 0.0), s.position.home, s.position.home_p)


def _height_wanted(s: Snapshot, present: float) -> float:
    """Height above home that the vehicle is on its way to, as far as it is known; never lower than a low place [m]."""
    is_taking_off = s.status.landed_state == mavlink.MAV_LANDED_STATE_TAKEOFF
    if is_taking_off and s.operator.take_off_height is not None:
        return max(s.operator.take_off_height, LOW_HEIGHT)
    target = None if s.guidance.target is None else s.position.from_vehicle_frame(s.guidance.target)
    if target is not None and math.isfinite(target[2]):
        present = s.position.home_p[2] - target[2]
    return round(max(present, LOW_HEIGHT), 1)


def _here(s: Snapshot) -> tuple[float, float, float] | None:
    """Latitude, longitude [deg] and height above home [m] of a vehicle in the air; else of a low place above home."""
    if s.status.is_airborne and s.position.geodetic is not None and s.position.from_home is not None:
        return s.position.geodetic.lat_deg, s.position.geodetic.lon_deg, _height_wanted(s, -s.position.from_home[2])
    return None if s.position.home is None else (s.position.home.lat_deg, s.position.home.lon_deg, LOW_HEIGHT)
