"""The mission: load, edit in a table, save, upload, follow."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import DataTable, Footer, Static

from darko_gcs.screens.dialogs import AskScreen, ask_number
from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.station import Station
from darko_gcs.store import command_name
from darko_gcs.widgets.status import StatusBar
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.plans import MissionItem, Plan, load, save
from protocol.units import from_e7, from_local_e4, is_global_frame, local_e4, to_e7

__all__ = ["MissionScreen"]

COLUMNS = ("", "#", "command", "frame", "hold/p1", "acc/p2", "yaw/p4", "lat/north", "lon/east", "alt")
FRAMES = {0: "AMSL", 1: "NED", 2: "-", 3: "rel", 4: "ENU", 5: "AMSL", 6: "rel"}
NAN = math.nan


class MissionScreen(Screen[None]):
    """One plan, edited here and sent as a whole."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,m", "close", "Back"),
        Binding("o", "open", "Open"),
        Binding("w", "save", "Write"),
        Binding("u", "upload", "Upload"),
        Binding("f", "fetch", "Fetch"),
        Binding("e,enter", "edit", "Edit", priority=True),
        Binding("i", "insert", "Insert"),
        Binding("x,delete", "remove", "Remove"),
        Binding("shift+up", "move(-1)", "Up"),
        Binding("shift+down", "move(1)", "Down"),
        Binding("c", "clear", "Clear vehicle"),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float]) -> None:
        super().__init__()
        self._station, self._clock = station, clock
        self.plan = Plan()
        self._path = ""
        self._changed = False
        self._known: tuple[MissionItem, ...] = ()  # the vehicle's mission when it was last looked at

    def compose(self) -> ComposeResult:
        """Status bar, table, words, footer."""
        yield StatusBar().data_bind(MissionScreen.snapshot, MissionScreen.now)
        yield DataTable(id="items", cursor_type="row", zebra_stripes=True)
        yield Static("", id="mission-complaint", markup=False)
        yield Static("", id="mission-words", markup=False)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Fill the table."""
        self.table.add_columns(*COLUMNS)
        self._show()

    @property
    def table(self) -> DataTable[str]:
        """The table of items."""
        return self.query_one("#items", DataTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle: its mission, where it is in it, how a transfer goes."""
        if s.mission is not self._known:
            self._known = s.mission
            self._changed = self._changed and s.mission != self.plan.items  # an upload that was accepted
            if not self._changed:
                self.plan = replace(self.plan, items=s.mission, item_keys=())
                self._show()
                return
        followed = (s.mission_current, s.reached, s.mission_state)
        if followed != (old.mission_current, old.reached, old.mission_state):
            self._mark(s)
        if s.messages and s.messages is not old.messages:
            self.query_one("#mission-words", Static).update(self._words() + "\n" + s.messages[-1].text)

    # Keys

    def action_close(self) -> None:
        """Back to the flight; an unsent plan is kept on the vehicle's side only when uploaded."""
        self.dismiss(None)

    def action_open(self) -> None:
        """Ask for a file and load it."""
        found = sorted(str(path) for suffix in ("*.plan", "*.waypoints") for path in Path().rglob(suffix))[:8]
        hint = "Open a plan" + (": " + ", ".join(found) if found else "")
        self._ask(hint, [("File (.plan or QGC WPL 110)", self._path or (found[0] if found else ""))], self._open)

    def _open(self, values: tuple[str, ...]) -> None:
        try:
            self.plan = load(Path(values[0]).expanduser())
        except FileError as error:
            self.complain(str(error))
            return
        self._path, self._changed = values[0], True
        self._show()

    def action_save(self) -> None:
        """Ask for a file and save the plan."""
        self._ask("Save the plan", [("File (.plan or .waypoints)", self._path or "mission.plan")], self._save)

    def _save(self, values: tuple[str, ...]) -> None:
        try:
            save(self.plan, Path(values[0]).expanduser())
        except FileError as error:
            self.complain(str(error))
            return
        self._path = values[0]
        self.complain(f"Saved {values[0]}")

    def action_upload(self) -> None:
        """Send the plan to the vehicle."""
        station = self._vehicle()
        if station is not None:
            self._changed, self._known = True, ()  # until the vehicle has accepted it
            station.upload(self.plan.items, self._clock())

    def action_fetch(self) -> None:
        """Replace the plan by the vehicle's."""
        station = self._vehicle()
        if station is not None:
            self._changed = False
            self._known = ()
            station.download(self._clock())

    def action_clear(self) -> None:
        """Delete the mission on the vehicle; the table keeps it."""
        station = self._vehicle()
        if station is not None:
            self._changed = True
            station.clear_mission(self._clock())

    def action_edit(self) -> None:
        """Edit the item under the cursor."""
        if self.plan.items:
            row = self.table.cursor_row
            self._ask(f"Item {row}", _fields(self.plan.items[row]), lambda values: self._edited(row, values))

    def _edited(self, row: int, values: tuple[str, ...]) -> None:
        try:
            item = _item(values, self.plan.items[row])
        except (ValueError, LocalProtocolError) as error:
            self.complain(f"Item {row}: {error}")
            return
        self._change((*self.plan.items[:row], item, *self.plan.items[row + 1 :]), row)

    def action_insert(self) -> None:
        """Insert a waypoint below the cursor: a copy of it, or one above home."""
        row = self.table.cursor_row if self.plan.items else -1
        home = self.snapshot.home
        if row >= 0:
            item = replace(self.plan.items[row], command=int(mavlink.MAV_CMD_NAV_WAYPOINT))
        elif home is not None:
            place = (to_e7(home.lat_deg), to_e7(home.lon_deg))
            item = MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, 3, (0.0, 0.0, 0.0, NAN), *place, 3.0)
        else:
            self.complain("Insert: home is not known yet; open a plan instead")
            return
        self._change((*self.plan.items[: row + 1], item, *self.plan.items[row + 1 :]), row + 1)

    def action_remove(self) -> None:
        """Remove the item under the cursor."""
        if self.plan.items:
            row = self.table.cursor_row
            self._change((*self.plan.items[:row], *self.plan.items[row + 1 :]), row)

    def action_move(self, step: int) -> None:
        """Move the item under the cursor up or down."""
        row, items = self.table.cursor_row, list(self.plan.items)
        if 0 <= row + step < len(items):
            items[row], items[row + step] = items[row + step], items[row]
            self._change(tuple(items), row + step)

    def complain(self, text: str) -> None:
        """Say something below the table."""
        self.query_one("#mission-complaint", Static).update(text)

    # Inside

    def _ask(self, title: str, fields: list[tuple[str, str]], then: Callable[[tuple[str, ...]], None]) -> None:
        self.complain("")

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None:
                then(values)

        self.app.push_screen(AskScreen(title, fields, numbers=False), answered)

    def _vehicle(self) -> Station | None:
        if self._station is None:
            self.complain("This is a recording: there is no vehicle")
        elif self._station.snapshot.source is None:
            self.complain("No vehicle has been heard yet")
        else:
            return self._station
        return None

    def _change(self, items: tuple[MissionItem, ...], row: int) -> None:
        # What a file says of single items belongs to their old places.
        self.plan, self._changed = replace(self.plan, items=items, item_keys=()), True
        self._show(row)

    def _show(self, row: int = 0) -> None:
        self.table.clear()
        for seq, item in enumerate(self.plan.items):
            self.table.add_row(*_row(seq, item), key=str(seq))
        if self.plan.items:
            self.table.move_cursor(row=min(row, len(self.plan.items) - 1))
        self._mark(self.snapshot)
        self.query_one("#mission-words", Static).update(self._words())

    def _mark(self, s: Snapshot) -> None:
        active = s.mission_state in {mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED}
        for seq in range(self.table.row_count):
            mark = "▶" if active and seq == s.mission_current else "✓" if seq in s.reached else " "
            self.table.update_cell_at(Coordinate(seq, 0), mark)

    def _words(self) -> str:
        name = self._path or "unsaved plan"
        if not self.plan.items and not self._known:
            return "no plan: o opens a file, f fetches the vehicle's"
        state = "not on the vehicle" if self._changed else "as on the vehicle"
        return f"{name}: {len(self.plan.items)} items, {state}"


def _place(item: MissionItem) -> tuple[str, str]:
    if is_global_frame(item.frame):
        return f"{from_e7(item.x):.7f}", f"{from_e7(item.y):.7f}"
    return f"{from_local_e4(item.x):.2f}", f"{from_local_e4(item.y):.2f}"


def _text(value: float) -> str:
    return "-" if math.isnan(value) else f"{value:g}"


def _row(seq: int, item: MissionItem) -> tuple[str, ...]:
    return (
        " ", str(seq), command_name(item.command), FRAMES.get(item.frame, str(item.frame)), _text(item.params[0]),
        _text(item.params[1]), _text(item.params[3]), *_place(item), _text(item.z),
    )  # fmt: skip


def _fields(item: MissionItem) -> list[tuple[str, str]]:
    places = ("Latitude [deg]", "Longitude [deg]") if is_global_frame(item.frame) else ("x [m]", "y [m]")
    x, y = _place(item)
    return [
        ("Command (MAV_CMD)", str(item.command)),
        ("Frame (MAV_FRAME)", str(item.frame)),
        ("param1 (hold) param2 (acceptance) param3 param4 (yaw)", " ".join(_text(v) for v in item.params)),
        (f"{places[0]} {places[1]} altitude [m]", f"{x} {y} {_text(item.z)}"),
    ]


def _item(values: tuple[str, ...], old: MissionItem) -> MissionItem:
    command, frame = (_whole(text, name) for text, name in zip(values, ("command", "frame"), strict=False))
    params = [_value(text, f"param{n}") for n, text in enumerate(values[2].split(), 1)]
    place = [_value(text, name) for text, name in zip(values[3].split(), ("x", "y", "altitude"), strict=False)]
    if len(params) != 4:
        raise ValueError(f"{len(params)} params where 4 are wanted")
    if len(place) != 3:
        raise ValueError("position wants three numbers")
    scale = to_e7 if is_global_frame(frame) else local_e4
    first = (params[0], params[1], params[2], params[3])
    return MissionItem(command, frame, first, scale(place[0]), scale(place[1]), place[2], old.autocontinue)


def _whole(text: str, name: str) -> int:
    if not text.isdigit():
        raise ValueError(f"{name} {text!r} is not a whole number")
    return int(text)


def _value(text: str, name: str) -> float:
    if text in {"-", "nan"}:
        return NAN
    value = ask_number(text)
    if value is None:
        raise ValueError(f"{name} {text!r} is not a number")
    return value
