"""The mission: load, edit in a table, save, upload, follow."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import DataTable, Footer, Static

from darko_gcs.mission_items import FRAMES, KINDS, edited, fields, kind_of, made, place_words, value_text, words
from darko_gcs.plans import ALL, FENCE, MISSION, RALLY, Items
from darko_gcs.screens.dialogs import AskScreen, ChooseScreen, ConfirmScreen
from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.station import Station
from darko_gcs.store import command_name
from darko_gcs.widgets.status import StatusBar
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.plans import MissionItem, Plan, load, save
from protocol.plans.geofence import fence_items, rally_items, with_fence, with_rally

__all__ = ["Draft", "MissionScreen"]

CLEARED = {MISSION: "The mission", FENCE: "The fence", RALLY: "The rally points", ALL: "All three"}
COLUMNS = ("", "#", "command", "parameters", "lat/north", "lon/east", "alt", "frame")


@dataclass
class Draft:
    """The plan being edited. It outlives the screen, so that leaving the screen loses nothing."""

    plan: Plan = field(default_factory=Plan)
    path: str = ""
    changed: bool = False  # not what the vehicle has
    saved: bool = True  # in a file as it is
    fence: Items = ()  # of the plan
    rally: Items = ()
    known: tuple[Items, ...] = ()  # the vehicle's mission, fence and rally points when they were last looked at

    def take(self, plan: Plan, path: str) -> None:
        """Begin with the plan of a file.

        Raises:
            FileError: Its fence or its rally points are none; the draft stays as it was.
        """
        fence, rally = fence_items(plan), rally_items(plan)
        self.plan, self.path, self.fence, self.rally = plan, path, fence, rally
        self.changed = self.saved = True

    def is_on(self, s: Snapshot) -> bool:
        """Whether the vehicle has all of the plan; a fence or rally points that it has beside it do not matter."""
        limits = ((self.fence, s.fence), (self.rally, s.rally))
        return self.plan.items == s.mission and all(not own or own == held for own, held in limits)

    def follow(self, s: Snapshot) -> None:
        """Become what the vehicle has.

        Raises:
            LocalProtocolError: No file can say what its fence is; it is followed all the same.
        """
        plan = replace(self.plan, items=s.mission, item_keys=())
        old, self.fence, self.rally = (self.fence, self.rally), s.fence, s.rally
        self.plan = plan
        if old != (s.fence, s.rally):
            self.plan = with_rally(with_fence(plan, s.fence), s.rally)

    @property
    def is_at_risk(self) -> bool:
        """True while the plan is nowhere but here."""
        return bool(self.plan.items) and self.changed and not self.saved


class MissionScreen(Screen[None]):
    """One plan, edited here and sent as a whole."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,m", "close", "Back"),
        Binding("o", "open", "Open", tooltip="Open a plan's file"),
        Binding("w", "save", "Write", tooltip="Write the plan to a file"),
        Binding("u", "upload", "Upload", tooltip="Send the plan, its fence and rally points"),
        Binding("f", "fetch", "Fetch", tooltip="Fetch the vehicle's plans"),
        Binding("e,enter", "edit", "Edit", priority=True, tooltip="Edit the item"),
        Binding("i", "insert", "Insert", tooltip="Insert an item below"),
        Binding("x,delete", "remove", "Remove", tooltip="Remove the item"),
        Binding("shift+up", "move(-1)", "Move the item up", show=False),
        Binding("shift+down", "move(1)", "Move the item down", show=False),
        Binding("c", "clear", "Clear", tooltip="Delete a plan on the vehicle"),
        Binding("j", "go_on", "Jump to", tooltip="Let the mission go on at the item"),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float], draft: Draft) -> None:
        super().__init__()
        self._station, self._clock = station, clock
        self.draft = draft
        self._filled = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

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
        self._filled = True
        self._show()
        self._follow(EMPTY, self.snapshot)

    @property
    def table(self) -> DataTable[str]:
        """The table of items."""
        return self.query_one("#items", DataTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle: its mission, where it is in it, how a transfer goes."""
        if self._filled:
            self._follow(old, s)

    def _follow(self, old: Snapshot, s: Snapshot) -> None:
        d = self.draft
        held = (s.mission, s.fence, s.rally)
        if held != d.known and s.source is not None:
            d.known = held
            d.changed = d.changed and not d.is_on(s)  # an upload that was accepted
            if not d.changed:
                self._become(s)
                return
        followed = (s.mission_current, s.reached, s.mission_state)
        if followed != (old.mission_current, old.reached, old.mission_state):
            self._mark(s)
        if s.messages and s.messages is not old.messages:
            self.query_one("#mission-words", Static).update(self._words() + "\n" + s.messages[-1].text)

    def _become(self, s: Snapshot) -> None:
        try:
            self.draft.follow(s)
        except LocalProtocolError as error:
            self.complain(f"The vehicle's fence or rally points cannot be saved: {error}")
        self._show()

    # Keys

    def action_close(self) -> None:
        """Back to the flight; an unsent plan is kept for the next time."""
        if self.draft.is_at_risk:
            self.app.notify("The plan is not on the vehicle. It is kept here: m shows it again", severity="warning")
        self.dismiss(None)

    def action_open(self) -> None:
        """Ask for a file and load it."""
        found = sorted(str(path) for suffix in ("*.plan", "*.waypoints") for path in Path().rglob(suffix))[:8]
        hint = "Open a plan" + (": " + ", ".join(found) if found else "")
        suggested = self.draft.path or (found[0] if found else "")
        self._or_lose(lambda: self._ask(hint, [("File (.plan or QGC WPL 110)", suggested)], self._open))

    def _open(self, values: tuple[str, ...]) -> str | None:
        try:
            self.draft.take(load(Path(values[0]).expanduser()), values[0])
        except FileError as error:
            return str(error)
        self._show()
        return None

    def action_save(self) -> None:
        """Ask for a file and save the plan."""
        self._ask("Save the plan", [("File (.plan or .waypoints)", self.draft.path or "mission.plan")], self._save)

    def _save(self, values: tuple[str, ...]) -> str | None:
        try:
            save(self.draft.plan, Path(values[0]).expanduser())
        except FileError as error:
            return str(error)
        self.draft.path, self.draft.saved = values[0], True
        self.complain(f"Saved {values[0]}")
        return None

    def action_upload(self) -> None:
        """Send the plan to the vehicle."""
        station = self._vehicle()
        if station is not None:
            d = self.draft
            d.changed, d.known = True, ()  # until the vehicle has accepted it
            station.upload(d.plan.items, self._clock(), fence=d.fence, rally=d.rally)

    def action_fetch(self) -> None:
        """Replace the plan by the vehicle's."""
        station = self._vehicle()
        if station is not None:
            self._or_lose(lambda: self._fetch(station))

    def _fetch(self, station: Station) -> None:
        self.draft.changed, self.draft.known = False, ()
        station.download(self._clock())

    def action_clear(self) -> None:
        """Delete the mission on the vehicle, its fence, its rally points or all three; the table keeps them."""
        station = self._vehicle()
        if station is None:
            return

        def chosen(number: int | None) -> None:
            if number is not None:
                self.draft.changed, self.draft.saved = True, False
                station.clear_plan(tuple(CLEARED)[number], self._clock())

        self.complain("")
        self.app.push_screen(ChooseScreen("Delete on the vehicle", tuple(CLEARED.values())), chosen)

    def action_go_on(self) -> None:
        """Let the mission go on at the item under the cursor."""
        station = self._vehicle()
        if station is None:
            return
        if self.draft.changed:
            self.complain("The vehicle does not have this plan: u uploads it")
        elif self.draft.plan.items:
            self.complain("")
            station.set_current(self.table.cursor_row, self._clock())

    def action_edit(self) -> None:
        """Edit the item under the cursor, each of its command's parameters in a field of its own."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            item = self.draft.plan.items[row]
            self._ask(f"Item {row}: {kind_of(item).label}", fields(item), lambda values: self._edited(row, values))

    def _edited(self, row: int, values: tuple[str, ...]) -> str | None:
        items = self.draft.plan.items
        try:
            item = edited(items[row], values)
        except (ValueError, LocalProtocolError) as error:
            return str(error)
        self._change((*items[:row], item, *items[row + 1 :]), row)
        if item.command != items[row].command:  # its parameters have other names: show them
            self.call_after_refresh(self.action_edit)
        return None

    def action_insert(self) -> None:
        """Insert an item below the cursor, where the nearest item before it is, or above home."""

        def chosen(number: int | None) -> None:
            if number is not None:
                self._insert(number)

        self.complain("")
        self.app.push_screen(ChooseScreen("Insert", [kind.label for kind in KINDS]), chosen)

    def _insert(self, number: int) -> None:
        items = self.draft.plan.items
        row = self.table.cursor_row if items else -1
        near = next((item for item in reversed(items[: row + 1]) if kind_of(item).is_placed and item.x), None)
        home = self.snapshot.home
        item = made(KINDS[number], near, None if home is None else (home.lat_deg, home.lon_deg))
        if item is None:
            self.complain("Insert: home is not known yet; open a plan instead")
            return
        self._change((*items[: row + 1], item, *items[row + 1 :]), row + 1)

    def action_remove(self) -> None:
        """Remove the item under the cursor."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            self._change((*self.draft.plan.items[:row], *self.draft.plan.items[row + 1 :]), row)

    def action_move(self, step: int) -> None:
        """Move the item under the cursor up or down."""
        row, items = self.table.cursor_row, list(self.draft.plan.items)
        if 0 <= row + step < len(items):
            items[row], items[row + step] = items[row + step], items[row]
            self._change(tuple(items), row + step)

    def complain(self, text: str) -> None:
        """Say something below the table."""
        self.query_one("#mission-complaint", Static).update(text)

    # Inside

    def _ask(self, title: str, fields: list[tuple[str, str]], then: Callable[[tuple[str, ...]], str | None]) -> None:
        """Ask until ``then`` has nothing to complain of."""
        self.complain("")
        self.app.push_screen(AskScreen(title, fields, then))

    def _or_lose(self, then: Callable[[], None]) -> None:
        """Do something that replaces the plan, after asking if it is nowhere else."""
        if not self.draft.is_at_risk:
            then()
            return

        def answered(yes: bool | None) -> None:
            if yes:
                then()

        self.app.push_screen(ConfirmScreen("The plan is neither saved nor on the vehicle. Lose it?"), answered)

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
        self.draft.plan = replace(self.draft.plan, items=items, item_keys=())
        self.draft.changed, self.draft.saved = True, False
        self._show(row)

    def _show(self, row: int = 0) -> None:
        self.table.clear()
        for seq, item in enumerate(self.draft.plan.items):
            self.table.add_row(*_row(seq, item), key=str(seq))
        if self.draft.plan.items:
            self.table.move_cursor(row=min(row, len(self.draft.plan.items) - 1))
        self._mark(self.snapshot)
        self.query_one("#mission-words", Static).update(self._words())

    def _mark(self, s: Snapshot) -> None:
        active = s.mission_state in {mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED}
        for seq in range(self.table.row_count):
            mark = "▶" if active and seq == s.mission_current else "✓" if seq in s.reached else " "
            self.table.update_cell_at(Coordinate(seq, 0), mark)

    def _words(self) -> str:
        d = self.draft
        if not d.plan.items and not d.known:
            return "no plan: o opens a file, f fetches the vehicle's, i inserts an item"
        state = "not on the vehicle" if d.changed else "as on the vehicle"
        unsaved = "" if d.saved or not d.changed else ", not saved"
        limits = [f"{name} of {len(part)}" for name, part in (("fence", d.fence), ("rally points", d.rally)) if part]
        parts = ", ".join([f"{len(d.plan.items)} items", *limits])
        return f"{d.path or 'unsaved plan'}: {parts}, {state}{unsaved}"


def _row(seq: int, item: MissionItem) -> tuple[str, ...]:
    place = (*place_words(item), value_text(item.z)) if kind_of(item).is_placed else ("", "", "")
    command = command_name(item.command).removeprefix("nav ").removeprefix("do ")
    return " ", str(seq), command, words(item), *place, FRAMES.get(item.frame, str(item.frame))
