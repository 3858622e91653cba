"""The mission screen's edits: nothing here reaches the vehicle, and every edit can be taken back."""

from __future__ import annotations

from textual import on
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import DataTable, Static

from darko_gcs.state.missions.mission_frames import place_of, shifted
from darko_gcs.state.missions.mission_labels import (
    MISSION_COMMANDS,
    MissionCommand,
    edited_item,
    item_fields,
    mission_command_of,
    new_item,
)
from darko_gcs.state.missions.plan_edits import LEG_ENDS, asked_ways, inserted, moved, removed, replaced, with_way
from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.tui.maps.movable_map import MovableMap
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.dialogs import AskScreen, Check, ChooseScreen
from darko_gcs.tui.screens.mission_table import MissionTable
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.errors import LocalProtocolError
from protocol.plans import MissionItem

__all__ = ["MissionEditing"]

WAYPOINT = next(entry for entry in MISSION_COMMANDS if entry.command == mavlink.MAV_CMD_NAV_WAYPOINT)
OWN_WAYS = (Way.NONE, Way.HOVER, Way.FORWARD)  # of a vehicle that chooses by itself
OTHER_WAYS = (Way.HOVER, Way.FORWARD)


class MissionEditing(Screen[None]):
    """Edits of the draft by keys, form and map."""

    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again

    def __init__(self, draft: PlanDraft) -> None:
        super().__init__()
        self.draft = draft

    @property
    def table(self) -> MissionTable:
        """The table of items."""
        return self.query_one("#items", MissionTable)

    @property
    def map(self) -> MovableMap:
        """The map of items."""
        return self.query_one("#mission-map", MovableMap)

    def show_draft(self, row: int = 0) -> None:
        """Show the draft after a change, with the cursor on a row.

        Raises:
            NotImplementedError: Always, here: the screen does it.
        """
        raise NotImplementedError

    def show_notice(self, text: str) -> None:
        """Show a text below the table; "" clears it."""
        self.query_one("#mission-notice", Static).update(text)

    # Keys

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
        self._change(replaced(items, row, item), row)
        if item.command != items[row].command:  # the new command has other parameters: show them
            self.call_after_refresh(self.action_edit)
        return None

    def action_insert(self, below: int) -> None:
        """Insert an item by the cursor, at the place of the nearest item before it, or above home."""

        def chosen(number: int | None) -> None:
            if number is not None:
                self._insert(MISSION_COMMANDS[number], below)

        self.show_notice("")
        self.app.push_screen(ChooseScreen("Insert", [command.label for command in MISSION_COMMANDS]), chosen)

    def _insert(self, kind: MissionCommand, below: int) -> None:
        items = self.draft.plan.items
        row = self.table.cursor_row + below if items else 0
        item = self._new_item(kind, row)
        if item is None:
            self.show_notice("Insert: home is not known yet; open a plan instead")
            return
        self._change(inserted(items, row, (item,)), row)

    def _new_item(self, kind: MissionCommand, row: int) -> MissionItem | None:
        before = reversed(self.draft.plan.items[:row])
        near = next((item for item in before if mission_command_of(item).has_place and item.x), None)
        home = self.snapshot.home
        return new_item(kind, near, None if home is None else (home.lat_deg, home.lon_deg))

    def action_duplicate(self) -> None:
        """Put the same item below the one under the cursor."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            self._change(inserted(self.draft.plan.items, row + 1, (self.draft.plan.items[row],)), row + 1)

    def action_remove(self) -> None:
        """Remove the item under the cursor."""
        if self.draft.plan.items:
            row = self.table.cursor_row
            self._change(removed(self.draft.plan.items, row), row)

    def action_way(self) -> None:
        """Another way for the leg to the item under the cursor; the other legs keep theirs."""
        items, row = self.draft.plan.items, self.table.cursor_row
        if not items:
            return
        if items[row].command not in LEG_ENDS:
            self.show_notice("No leg to choose a way for leads to this item")
            return
        ways = OTHER_WAYS if self.snapshot.hybrid is None and self.snapshot.source is not None else OWN_WAYS
        present = asked_ways(items)[row]
        way = ways[(ways.index(present) + 1) % len(ways)] if present in ways else ways[0]
        self._change(*with_way(items, row, way))

    def action_undo(self) -> None:
        """Take the last edit of the plan back."""
        self._after(self.draft.undo(), "There is no edit to take back")

    def action_redo(self) -> None:
        """Make the edit again that was taken back last."""
        self._after(self.draft.redo(), "There is no edit to make again")

    def _after(self, is_done: bool, otherwise: str) -> None:
        self.show_notice("" if is_done else otherwise)
        if is_done:
            self.show_draft(self.table.cursor_row)

    def action_move(self, step: int) -> None:
        """Move the item under the cursor up or down."""
        row = self.table.cursor_row
        if 0 <= row + step < len(self.draft.plan.items):
            self._change(moved(self.draft.plan.items, row, row + step), row + step)

    def action_step(self, by: int) -> None:
        """Move items on the map by smaller or larger steps."""
        self.map.change_step(by)

    # The map

    @on(MovableMap.PointChosen)
    def _item_chosen(self, event: MovableMap.PointChosen) -> None:
        self.table.choose_row(event.number)

    @on(DataTable.RowHighlighted, "#items")
    def _row_chosen(self) -> None:
        self.map.chosen = self.table.cursor_row
        self.show_item()

    def show_item(self) -> None:
        """Tell of the item under the cursor.

        Raises:
            NotImplementedError: Always, here: the screen does it.
        """
        raise NotImplementedError

    @on(MovableMap.PointMoved)
    def _shift_item(self, event: MovableMap.PointMoved) -> None:
        home, items, seq = self.snapshot.home, self.draft.plan.items, event.number
        if home is None or seq >= len(items):
            self.show_notice("Home is not known yet: no item can be moved on the map")
            return
        try:
            item = shifted(items[seq], event.by, home, self.snapshot.home_p)
        except (ValueError, LocalProtocolError) as error:
            self.show_notice(str(error))
            return
        self._change(replaced(items, seq, item), seq)

    @on(MovableMap.PlacePressed)
    def _add_waypoint(self, event: MovableMap.PlacePressed) -> None:
        """A new waypoint below the cursor, as high as the item before it."""
        items, home, home_p = self.draft.plan.items, self.snapshot.home, self.snapshot.home_p
        row = self.table.cursor_row + 1 if items else 0
        item = self._new_item(WAYPOINT, row)
        here = None if item is None or home is None else place_of(item, home, home_p)
        if item is None or home is None or here is None:
            self.show_notice("Home is not known yet: no item can be put on the map")
            return
        by = (event.place[0] - here[0], event.place[1] - here[1], 0.0)
        self._change(inserted(items, row, (shifted(item, by, home, home_p),)), row)

    # Inside

    def _ask(self, title: str, fields: list[tuple[str, str]], check: Check) -> None:
        """Ask until ``check`` finds nothing wrong."""
        self.show_notice("")
        self.app.push_screen(AskScreen(title, fields, check))

    def _change(self, items: Items, row: int) -> None:
        self.show_notice("")
        self.draft.edit(items)
        self.show_draft(row)
