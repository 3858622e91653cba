"""The mission: load, edit in a table, save, upload, follow."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.coordinate import Coordinate
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import DataTable, Footer, Static

from darko_gcs.state.mission_labels import (
    FRAME_LABELS,
    MISSION_COMMANDS,
    coordinate_texts,
    edited_item,
    field_text,
    item_fields,
    item_summary,
    mission_command_of,
    new_item,
)
from darko_gcs.state.plan_parts import ALL_PLANS, FENCE, MISSION, RALLY
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import command_name
from darko_gcs.station.station import Station
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.dialogs import AskScreen, Check, ChooseScreen, ConfirmScreen
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.plans import MissionItem, load, save

__all__ = ["MissionScreen"]

CLEAR_CHOICES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally points", ALL_PLANS: "All three"}
ITEM_COLUMNS = ("", "#", "command", "parameters", "lat/north", "lon/east", "alt", "frame")
MAX_FILES_LISTED = 8  # in the dialog that opens a file


class MissionScreen(Screen[None]):
    """One plan, edited here and sent as a whole."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,m", "close", "Back"),
        Binding("o", "open", "Open", tooltip="Open a plan file"),
        Binding("w", "save", "Write", tooltip="Write the plan to a file"),
        Binding("u", "upload", "Upload", tooltip="Send the plan, its fence and rally points"),
        Binding("f", "fetch", "Fetch", tooltip="Fetch the vehicle's plans"),
        Binding("e,enter", "edit", "Edit", priority=True, tooltip="Edit the item"),
        Binding("i", "insert", "Insert", tooltip="Insert an item below"),
        Binding("x,delete", "remove", "Remove", tooltip="Remove the item"),
        Binding("z,ctrl+z", "undo", "Undo", tooltip="Take the last edit of the plan back"),
        Binding("shift+up", "move(-1)", "Move the item up", show=False),
        Binding("shift+down", "move(1)", "Move the item down", show=False),
        Binding("c", "clear", "Clear", tooltip="Delete a plan on the vehicle"),
        Binding("j", "set_current", "Jump to", tooltip="Continue the mission at the item"),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float], draft: PlanDraft) -> None:
        super().__init__()
        self._station, self._clock = station, clock
        self.draft = draft
        self._is_ready = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

    def compose(self) -> ComposeResult:
        """Status bar, table, messages, footer."""
        yield StatusBar().data_bind(MissionScreen.snapshot, MissionScreen.now)
        yield DataTable(id="items", cursor_type="row", zebra_stripes=True)
        yield Static("", id="mission-notice", markup=False)
        yield Static("", id="mission-status", markup=False)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Fill the table."""
        self.table.add_columns(*ITEM_COLUMNS)
        self._is_ready = True
        self._show()
        self._follow(EMPTY_SNAPSHOT, self.snapshot)

    @property
    def table(self) -> DataTable[str]:
        """The table of items."""
        return self.query_one("#items", DataTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle: its plans, its progress, transfers."""
        if self._is_ready:
            self._follow(old, s)

    def _follow(self, old: Snapshot, s: Snapshot) -> None:
        draft = self.draft
        vehicle_plans = (s.mission, s.fence, s.rally)
        if vehicle_plans != draft.vehicle_plans and s.source is not None:
            draft.vehicle_plans = vehicle_plans
            draft.changed = draft.changed and not draft.is_on_vehicle(s)  # false after an accepted upload
            if not draft.changed:
                self._show_vehicle_plan(s)
                return
        progress = (s.mission_current, s.reached, s.mission_state)
        if progress != (old.mission_current, old.reached, old.mission_state):
            self._show_progress(s)
        if s.messages and s.messages is not old.messages:
            self.query_one("#mission-status", Static).update(self._status() + "\n" + s.messages[-1].text)

    def _show_vehicle_plan(self, s: Snapshot) -> None:
        try:
            self.draft.follow_vehicle(s)
        except LocalProtocolError as error:
            self.show_notice(f"The vehicle's fence or rally points cannot be saved: {error}")
        self._show()

    # Keys

    def action_close(self) -> None:
        """Back to the flight; an unsent plan stays for the next time."""
        if self.draft.is_at_risk:
            self.app.notify("The plan is not on the vehicle. Press m to see it again", severity="warning")
        self.dismiss(None)

    def action_open(self) -> None:
        """Ask for a file and load it."""
        found = sorted(str(path) for suffix in ("*.plan", "*.waypoints") for path in Path().rglob(suffix))
        found = found[:MAX_FILES_LISTED]
        title = "Open a plan" + (": " + ", ".join(found) if found else "")
        suggested = self.draft.path or (found[0] if found else "")
        self._confirm_loss(lambda: self._ask(title, [("File (.plan or QGC WPL 110)", suggested)], self._open))

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
        self.show_notice(f"Saved {values[0]}")
        return None

    def action_upload(self) -> None:
        """Send the plan to the vehicle."""
        station = self._vehicle()
        if station is None:
            return
        if self.snapshot.mission_state == mavlink.MISSION_STATE_ACTIVE:
            self._confirm("A mission is being flown. Replace it?", lambda: self._upload(station))
        else:
            self._upload(station)

    def _upload(self, station: Station) -> None:
        draft = self.draft
        draft.changed, draft.vehicle_plans = True, ()  # until the vehicle has accepted it
        station.upload(draft.plan.items, self._clock(), fence=draft.fence, rally=draft.rally)

    def action_fetch(self) -> None:
        """Replace the plan by the vehicle's."""
        station = self._vehicle()
        if station is not None:
            self._confirm_loss(lambda: self._fetch(station))

    def _fetch(self, station: Station) -> None:
        self.draft.changed, self.draft.vehicle_plans = False, ()
        station.download(self._clock())

    def action_clear(self) -> None:
        """Delete the vehicle's mission, fence, rally points or all three; the table keeps its plan."""
        station = self._vehicle()
        if station is None:
            return

        def chosen(number: int | None) -> None:
            if number is not None:
                self.draft.changed, self.draft.saved = True, False
                station.clear_plan(tuple(CLEAR_CHOICES)[number], self._clock())

        self.show_notice("")
        self.app.push_screen(ChooseScreen("Delete on the vehicle", tuple(CLEAR_CHOICES.values())), chosen)

    def action_set_current(self) -> None:
        """Continue the mission at the item under the cursor."""
        station = self._vehicle()
        if station is None:
            return
        if self.draft.changed:
            self.show_notice("The vehicle does not have this plan: press u to upload it")
        elif self.draft.plan.items:
            self.show_notice("")
            row = self.table.cursor_row
            self._confirm(f"Continue the mission at item {row}?", lambda: station.set_current(row, self._clock()))

    def action_edit(self) -> None:
        """Edit the item under the cursor, with a field for each parameter of its command."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            item = self.draft.plan.items[row]
            title = f"Item {row}: {mission_command_of(item).label}"
            self._ask(title, item_fields(item), lambda values: self._edit(row, values))

    def _edit(self, row: int, values: tuple[str, ...]) -> str | None:
        items = self.draft.plan.items
        try:
            item = edited_item(items[row], values, self.snapshot.home, self.snapshot.home_p)
        except (ValueError, LocalProtocolError) as error:
            return str(error)
        self._change((*items[:row], item, *items[row + 1 :]), row)
        if item.command != items[row].command:  # the new command has other parameters: show them
            self.call_after_refresh(self.action_edit)
        return None

    def action_insert(self) -> None:
        """Insert an item below the cursor, at the place of the nearest item before it, or above home."""

        def chosen(number: int | None) -> None:
            if number is not None:
                self._insert(number)

        self.show_notice("")
        self.app.push_screen(ChooseScreen("Insert", [command.label for command in MISSION_COMMANDS]), chosen)

    def _insert(self, number: int) -> None:
        items = self.draft.plan.items
        row = self.table.cursor_row if items else -1
        near = next(
            (item for item in reversed(items[: row + 1]) if mission_command_of(item).has_place and item.x), None
        )
        home = self.snapshot.home
        item = new_item(MISSION_COMMANDS[number], near, None if home is None else (home.lat_deg, home.lon_deg))
        if item is None:
            self.show_notice("Insert: home is not known yet; open a plan instead")
            return
        self._change((*items[: row + 1], item, *items[row + 1 :]), row + 1)

    def action_remove(self) -> None:
        """Remove the item under the cursor."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            self._change((*self.draft.plan.items[:row], *self.draft.plan.items[row + 1 :]), row)

    def action_undo(self) -> None:
        """Take the last edit of the plan back."""
        row = self.table.cursor_row
        if self.draft.undo():
            self._show(row)
        else:
            self.show_notice("There is no edit to take back")

    def action_move(self, step: int) -> None:
        """Move the item under the cursor up or down."""
        row, items = self.table.cursor_row, list(self.draft.plan.items)
        if 0 <= row + step < len(items):
            items[row], items[row + step] = items[row + step], items[row]
            self._change(tuple(items), row + step)

    def show_notice(self, text: str) -> None:
        """Show a text below the table; "" clears it."""
        self.query_one("#mission-notice", Static).update(text)

    # Inside

    def _ask(self, title: str, fields: list[tuple[str, str]], check: Check) -> None:
        """Ask until ``check`` finds nothing wrong."""
        self.show_notice("")
        self.app.push_screen(AskScreen(title, fields, check))

    def _confirm_loss(self, then: Callable[[], None]) -> None:
        """Do something that replaces the plan, after asking if the plan would be lost."""
        if self.draft.is_at_risk:
            self._confirm("The plan is neither saved nor on the vehicle. Discard it?", then)
        else:
            then()

    def _confirm(self, question: str, then: Callable[[], None]) -> None:
        """Do something after a yes."""

        def answered(yes: bool | None) -> None:
            if yes:
                then()

        self.app.push_screen(ConfirmScreen(question), answered)

    def _vehicle(self) -> Station | None:
        if self._station is None:
            self.show_notice("This is a recording: there is no vehicle")
        elif self._station.snapshot.source is None:
            self.show_notice("No vehicle has been heard yet")
        else:
            return self._station
        return None

    def _change(self, items: tuple[MissionItem, ...], row: int) -> None:
        self.draft.edit(items)
        self._show(row)

    def _show(self, row: int = 0) -> None:
        self.table.clear()
        for seq, item in enumerate(self.draft.plan.items):
            self.table.add_row(*_item_cells(seq, item), key=str(seq))
        if self.draft.plan.items:
            self.table.move_cursor(row=min(row, len(self.draft.plan.items) - 1))
        self._show_progress(self.snapshot)
        self.query_one("#mission-status", Static).update(self._status())

    def _show_progress(self, s: Snapshot) -> None:
        active = s.mission_state in {mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED}
        for seq in range(self.table.row_count):
            mark = "▶" if active and seq == s.mission_current else "✓" if seq in s.reached else " "
            self.table.update_cell_at(Coordinate(seq, 0), mark)

    def _status(self) -> str:
        draft = self.draft
        if not draft.plan.items and not draft.vehicle_plans:
            return "no plan: o opens a file, f fetches the vehicle's, i inserts an item"
        state = "not on the vehicle" if draft.changed else "as on the vehicle"
        unsaved = "" if draft.saved or not draft.changed else ", not saved"
        limits = (("fence", draft.fence), ("rally points", draft.rally))
        parts = [f"{len(draft.plan.items)} items", *(f"{name} of {len(items)}" for name, items in limits if items)]
        return f"{draft.path or 'unsaved plan'}: {', '.join(parts)}, {state}{unsaved}"


def _item_cells(seq: int, item: MissionItem) -> tuple[str, ...]:
    has_place = mission_command_of(item).has_place
    place = (*coordinate_texts(item), field_text(item.z)) if has_place else ("", "", "")
    command = command_name(item.command).removeprefix("nav ").removeprefix("do ")
    return " ", str(seq), command, item_summary(item), *place, FRAME_LABELS.get(item.frame, str(item.frame))
