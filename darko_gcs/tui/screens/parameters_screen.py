"""The vehicle's parameters: filtered by typing, described by the vehicle itself, changed, compared, kept in files."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, VerticalScroll
from textual.reactive import reactive
from textual.widgets import Input, Static

from darko_gcs.preferences import FAULT_SHOWN_TIME, PreferencesFile
from darko_gcs.state.parameters import (
    ParameterFilter,
    differences,
    is_changed,
    matching_names,
    metadata_of,
    number_text,
    parameter_counts,
    parameter_details,
)
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import counted, printable
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import why_unreachable
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.screens.dialogs import AskScreen, FileDialog, FormField, Named, confirm
from darko_gcs.tui.screens.parameter_dialogs import (
    ChooseBitsScreen,
    ChooseValueScreen,
    ComparisonScreen,
    parameter_heading,
    parameter_row,
)
from darko_gcs.tui.screens.typed_filter import TYPING, TYPING_KEYS, can_leave, show_typing, typed_words
from darko_gcs.tui.widgets.row_list import RowList
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.errors import FileError
from protocol.plans.parameter_files import load_parameters, save_parameters
from protocol.wire.message import Source

SUFFIXES = (".params", ".parm", ".param")
FIRST_VEHICLE = (1, mavlink.MAV_COMP_ID_AUTOPILOT1)  # whose rows of a file are compared before a vehicle is heard
MAX_NAMED = 5  # parameters in a notice


class DoneChange(NamedTuple):
    """A change that was made here, to be taken back."""

    vehicle: Source | None
    name: str
    before: float


class ParametersScreen(StationScreen[None]):
    """A list of the vehicle's parameters; typed text filters it."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (160, "-wide")]  # noqa: RUF012 - declared so by Textual
    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "parameters",
        [
            *TYPING_KEYS,
            Binding("enter", "edit", "Change", priority=True, tooltip="Change the parameter"),
            Binding("up", "move(-1)", show=False, priority=True),
            Binding("down", "move(1)", show=False, priority=True),
            Binding("pageup", "page(-1)", show=False, priority=True),
            Binding("pagedown", "page(1)", show=False, priority=True),
            Binding("f1", "app.act('help')", "Help", priority=True, tooltip="These keys"),
            Binding(
                "f2", "changed", "Changed", priority=True, tooltip="Only what differs from its default, or all again"
            ),
            Binding("f3", "favourites", "Only ★", priority=True, tooltip="Only favourites, or all again"),
            Binding("f4", "favourite", "★", priority=True, tooltip="Make it a favourite, or no longer"),
            Binding("f5", "fetch", "Fetch all from the vehicle again", priority=True, show=False),
            Binding("f6", "reset", "Default", priority=True, tooltip="Set it back to its default"),
            Binding("ctrl+z", "undo", "Undo", priority=True, show=False, tooltip="Take the last change back"),
            Binding("f7", "compare", "File", priority=True, tooltip="Compare with a file and set what is chosen"),
            Binding("f8", "save", "Save", priority=True, tooltip="Save all to a file"),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(
        self,
        station: Station | None,
        clock: Callable[[], float],
        preferences: PreferencesFile | None = None,
        named: Named = str,
        changes: list[DoneChange] | None = None,
    ) -> None:
        super().__init__()
        self._station, self._clock, self._named = station, clock, named
        self._changes = [] if changes is None else changes  # newest last
        self._preferences = preferences or PreferencesFile()
        self._filter = ParameterFilter()
        self._requested_of = -1  # the vehicle's restarts when its parameters were asked for
        self._file = "vehicle.params"
        self._comparison: ComparisonScreen | None = None
        # Kept, not looked up: the app hands out snapshots before the screen is mounted and while it is taken down.
        self.table = RowList(parameter_heading, self._draw_row, id="parameters")
        self._description = Static("", id="parameter-description", markup=False)
        self._status = Static("", id="parameter-status", markup=False)
        self._is_ready = False

    def compose(self) -> ComposeResult:
        """Status bar, filter, list with details below or beside it, status, footer."""
        yield StatusBar().data_bind(ParametersScreen.snapshot, ParametersScreen.now)
        yield Input(placeholder=f"part of a name or description: {TYPING}", id="filter", compact=True)
        with Container(id="parameter-panes"):
            yield self.table
            with VerticalScroll(id="parameter-details", can_focus=False):
                yield self._description
        yield self._status
        yield KeyFooter()

    def on_mount(self) -> None:
        """Fill the list."""
        try:
            favourites = self._preferences.load().favourite_parameters
        except FileError as error:
            self.app.notify(f"No favourites: {error}", severity="warning", timeout=FAULT_SHOWN_TIME)
        else:
            self._filter = self._filter._replace(favourites=favourites)
        self._is_ready = True
        self._request()
        self._show()

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle's values, whoever changes them."""
        if not self._is_ready:
            return
        self._request()
        if self._comparison is not None:
            self._comparison.follow(s)
        if (
            s.parameters.values is not old.parameters.values
            or s.parameters.metadata is not old.parameters.metadata
            or s.parameters.changes is not old.parameters.changes
        ):
            self._show()
        elif s.log.lines is not old.log.lines:
            self._tell()

    # Keys. The filter has the focus: some of them move the list's cursor.

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Esc does one thing at a time, and the footer says which."""
        return can_leave(self, action) and super().check_action(action, parameters)

    def action_clear_filter(self) -> None:
        """Show all again."""
        self.query_one("#filter", Input).value = ""

    def action_close(self) -> None:
        """Go back to the flight."""
        self.dismiss(None)

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.table.move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages."""
        self.table.move_page(pages)

    def action_fetch(self) -> None:
        """Fetch all parameters again."""
        if (station := self._vehicle()) is not None:
            station.fetch_parameters(self._clock())

    def action_changed(self) -> None:
        """Show only parameters that differ from their defaults, or all again."""
        self._filter = self._filter._replace(only_changed=not self._filter.only_changed)
        self._show()

    def action_favourites(self) -> None:
        """Show only favourites, or all again."""
        self._filter = self._filter._replace(only_favourites=not self._filter.only_favourites)
        self._show()

    def action_favourite(self) -> None:
        """Make the parameter under the cursor a favourite, or no longer."""
        if self.table.key is None:
            return
        favourites = frozenset(self._filter.favourites) ^ {self.table.key}
        try:
            self._preferences.save(self._preferences.load()._replace(favourite_parameters=favourites))
        except FileError as error:
            self.app.notify(f"Favourite not saved: {error}", severity="warning", timeout=FAULT_SHOWN_TIME)
            return
        self._filter = self._filter._replace(favourites=favourites)
        self._show()

    def action_edit(self) -> None:
        """Change the parameter under the cursor: by a number, from a list, or bit by bit."""
        name = self.table.key
        if name is None or self._vehicle() is None:
            return
        metadata, value = metadata_of(self.snapshot, name), self.snapshot.parameters.values[name]
        title = self._named(f"{printable(name)}: {metadata.text}" if metadata.text else printable(name))

        def chosen(place: int | None) -> None:
            if place is not None and place < len(metadata.values):
                self._set(name, metadata.values[place][0])
            elif place is not None:
                self._ask_number(title, name)

        def switched(mask: int | None) -> None:
            if mask is not None:
                self._set(name, mask)

        if metadata.bits:
            self.app.push_screen(ChooseBitsScreen(title, metadata.bits, int(value)), switched)
        elif metadata.values:
            self.app.push_screen(ChooseValueScreen(title, metadata, value), chosen)
        else:
            self._ask_number(title, name)

    def action_reset(self) -> None:
        """Ask, then set the parameter under the cursor back to its default."""
        name = self.table.key
        if name is None or self._vehicle() is None:
            return
        metadata = metadata_of(self.snapshot, name)
        if math.isnan(metadata.default):
            self.app.notify(f"The vehicle does not report the default of {printable(name)}", severity="warning")
        elif not is_changed(self.snapshot, name):
            self.app.notify(f"{printable(name)} has its default value")
        else:
            default, value = metadata.shown(metadata.default), metadata.shown(self.snapshot.parameters.values[name])
            question = f"Set {printable(name)} back to its default, {default}? It is {value} now."
            confirm(self.app, self._named(question), lambda: self._set(name, metadata.default))

    def action_undo(self) -> None:
        """Ask, then set the parameter that was changed last back to what it was."""
        if self._vehicle() is None:
            return
        own = [change for change in self._changes if change.vehicle == self.snapshot.identity.source]
        if not own:
            self.app.notify("Nothing to undo: no parameter of this vehicle has been changed here")
            return
        _, name, value = own[-1]
        metadata, present = metadata_of(self.snapshot, name), self.snapshot.parameters.values.get(name, math.nan)
        question = f"Set {printable(name)} back to {metadata.shown(value)}? It is {metadata.shown(present)} now."

        def take_back() -> None:
            self._changes.remove(own[-1])
            self._send(name, value)

        confirm(self.app, self._named(question), take_back)

    def action_compare(self) -> None:
        """Ask for a file, and show where the vehicle differs from it."""
        found = sorted(str(path) for suffix in SUFFIXES for path in Path().glob(f"*{suffix}"))
        name = found[0] if found and not Path(self._file).exists() else self._file
        self._ask_file("Compare with a file of parameters", name, found, self._compare)

    def action_save(self) -> None:
        """Ask for a file, and save all parameters there."""
        s = self.snapshot
        if s.identity.source is None or len(s.parameters.values) < (s.parameters.total or 1):
            self.app.notify(f"Not saved: {parameter_counts(s, 0)}", severity="warning")
            return
        self._ask_file("Save the parameters (.parm: MAVProxy's format)", self._file, [], self._save)

    # Inside

    def _ask_file(self, title: str, name: str, known: Sequence[str], check: Callable[[str], str | None]) -> None:
        self.app.push_screen(FileDialog(title, name, known=known, suffixes=SUFFIXES, check=check))

    def _vehicle(self) -> Station | None:
        """The vehicle if it can be commanded; else a notice says why not."""
        reason = why_unreachable(self._station, self.snapshot)
        if reason:
            self.app.notify(reason, severity="warning")
            return None
        return self._station

    def _set(self, name: str, value: float) -> None:
        before = self.snapshot.parameters.values[name]
        if value != before:
            self._changes.append(DoneChange(self.snapshot.identity.source, name, before))
        self._send(name, value)

    def _send(self, name: str, value: float) -> None:
        if self._station is not None:
            self._station.set_parameter(name, value, self._clock())

    def _ask_number(self, title: str, name: str) -> None:
        metadata = metadata_of(self.snapshot, name)
        label = " ".join(filter(None, ("Value", f"[{metadata.unit}]" if metadata.unit else "", metadata.bounds)))
        value = number_text(self.snapshot.parameters.values[name])
        default = "" if math.isnan(metadata.default) else f"Its default is {metadata.shown(metadata.default)}. "
        fields = [FormField(label, value, f"{default}Ctrl+Z takes the change back")]
        self.app.push_screen(AskScreen(title, fields, lambda texts: self._set_text(name, texts[0])))

    def _set_text(self, name: str, text: str) -> str | None:
        metadata = metadata_of(self.snapshot, name)
        try:
            value = metadata.value_of(text)
        except ValueError as error:
            return f"{printable(name)}: {error}"
        problem = metadata.problem_with(value)
        if problem is not None:
            return f"{printable(name)}: {problem}"
        self._set(name, value)
        return None

    def _compare(self, path: str) -> str | None:
        vehicle = self.snapshot.identity.source or FIRST_VEHICLE
        try:
            file = load_parameters(Path(path).expanduser())
            wanted, left_out = file.of(vehicle), file.left_out(vehicle)
        except FileError as error:
            return str(error)
        self._file = path
        if left_out:
            names = ", ".join(row.name for row in left_out[:MAX_NAMED])
            self.app.notify(f"{path}: left out, of other components: {counted(len(left_out), 'parameter')}, {names}")
        rows = differences(self.snapshot, wanted)
        if not rows:
            self.app.notify(f"{path}: all {len(wanted)} parameters are as on the vehicle")
            return None
        title = self._named(f"{path}: {len(rows)} of {len(wanted)} parameters differ")
        self._comparison = ComparisonScreen(title, rows, self.snapshot, self._station, self._clock)
        self.call_after_refresh(self._show_comparison)
        return None

    def _show_comparison(self) -> None:
        if self._comparison is not None:
            self.app.push_screen(self._comparison, lambda _: self._forget_comparison())

    def _forget_comparison(self) -> None:
        self._comparison = None

    def _save(self, path: str) -> str | None:
        s = self.snapshot
        if s.identity.source is None:
            return "No vehicle has been heard yet"
        try:
            save_parameters(Path(path).expanduser(), s.parameters.values, s.parameters.types, s.identity.source)
        except FileError as error:
            return str(error)
        self._file = path
        self.app.notify(f"{path}: {len(s.parameters.values)} parameters saved")
        return None

    def _request(self) -> None:
        """Fetch missing parameters and metadata, once in a life of the vehicle; it may come after this screen."""
        s = self.snapshot
        if self._requested_of == s.link.restarts or self._station is None or s.identity.source is None:
            return
        self._requested_of = s.link.restarts
        if not s.parameters.values or len(s.parameters.values) < (s.parameters.total or 0):
            self._station.fetch_parameters(self._clock())
        self._station.fetch_parameter_metadata(self._clock())

    @on(Input.Changed)
    def _filter_changed(self, event: Input.Changed) -> None:
        self._filter = self._filter._replace(text=event.value)
        show_typing(self)
        self._show()

    @on(RowList.Moved)
    def _moved(self) -> None:
        self._tell()

    def _draw_row(self, name: str, width: int) -> StyledLine:
        s = self.snapshot
        return parameter_row(s, name, self._filter.favourites, width) if name in s.parameters.values else []

    def _show(self) -> None:
        self.table.show(matching_names(self.snapshot, self._filter))
        self._tell()

    def _tell(self) -> None:
        s, name = self.snapshot, self.table.key
        details = "" if name is None or name not in s.parameters.values else "\n".join(parameter_details(s, name))
        self._description.update(details)
        only = ", only changed" * self._filter.only_changed + ", only favourites" * self._filter.only_favourites
        last = s.log.lines[-1].text if s.log.lines else ""
        counts = parameter_counts(s, len(self.table.keys))
        self._status.update(f"{typed_words(self)}{counts}{only}\n{last}")
