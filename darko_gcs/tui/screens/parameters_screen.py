"""The vehicle's parameters: filtered by typing, described by the vehicle itself, changed one at a time."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import ClassVar

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import DataTable, Footer, Input, Static

from darko_gcs.state.parameter_metadata import NO_METADATA, ParameterMetadata
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import printable
from darko_gcs.station.station import Station
from darko_gcs.tui.screens.dialogs import AskScreen, parse_number
from darko_gcs.tui.widgets.status_bar import StatusBar

__all__ = ["ParametersScreen", "is_changed", "matching_names", "parameter_cells"]

PARAMETER_COLUMNS = ("", "name", "value", "unit", "range", "description")
VALUE_COLUMN = PARAMETER_COLUMNS.index("value")
RELATIVE_TOLERANCE = 1e-6  # values are float32 on the wire, defaults are decimals in a file
ABSOLUTE_TOLERANCE = 1e-12


class ParametersScreen(Screen[None]):
    """A table of the vehicle's parameters; typed text filters it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "close", "Back", priority=True),
        Binding("enter", "edit", "Change", priority=True),
        Binding("up", "cursor_up", show=False, priority=True),
        Binding("down", "cursor_down", show=False, priority=True),
        Binding("pageup", "page_up", show=False, priority=True),
        Binding("pagedown", "page_down", show=False, priority=True),
        Binding("f5", "fetch", "Fetch again", priority=True),
        Binding("f2", "changed", "Only changed", priority=True),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float]) -> None:
        super().__init__()
        self._station, self._clock = station, clock
        self._shown_names: tuple[str, ...] = ()  # in the table's order
        self._shown_metadata: Mapping[str, ParameterMetadata] = {}  # as in the table
        self._is_requested = False
        self._only_changed = False
        self._is_ready = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

    def compose(self) -> ComposeResult:
        """Status bar, filter, table, description, status, footer."""
        yield StatusBar().data_bind(ParametersScreen.snapshot, ParametersScreen.now)
        yield Input(placeholder="type part of a name or description", id="filter", compact=True)
        yield DataTable(id="parameters", cursor_type="row", zebra_stripes=True)
        yield Static("", id="parameter-description", markup=False)
        yield Static("", id="parameter-status", markup=False)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Fill the table."""
        for name in PARAMETER_COLUMNS:
            self.table.add_column(name, key=name)
        self.table.can_focus = False
        self._is_ready = True
        self._request()
        self._show()

    @property
    def table(self) -> DataTable[Text]:
        """The table of parameters."""
        return self.query_one("#parameters", DataTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle's values, whoever changes them."""
        if not self._is_ready:
            return
        self._request()
        if s.parameters is not old.parameters or s.parameter_metadata is not old.parameter_metadata:
            self._show()
        elif s.messages is not old.messages:
            self._show_status()

    # Keys

    def action_close(self) -> None:
        """Clear the filter; without a filter, go back to the flight."""
        field = self.query_one("#filter", Input)
        if field.value:
            field.value = ""
        else:
            self.dismiss(None)

    # The filter has the focus: these keys move the table's cursor.

    def action_cursor_up(self) -> None:
        """One row up."""
        self.table.action_cursor_up()

    def action_cursor_down(self) -> None:
        """One row down."""
        self.table.action_cursor_down()

    def action_page_up(self) -> None:
        """One page up."""
        self.table.action_page_up()

    def action_page_down(self) -> None:
        """One page down."""
        self.table.action_page_down()

    def action_fetch(self) -> None:
        """Fetch all parameters again."""
        if self._station is not None:
            self._station.fetch_parameters(self._clock())

    def action_changed(self) -> None:
        """Show only parameters that differ from their defaults, or all again."""
        self._only_changed = not self._only_changed
        self._show()

    def action_edit(self) -> None:
        """Change the parameter under the cursor."""
        name = self._selected_name
        if name is None:
            return
        if self._station is None:
            self.app.notify("This is a recording: there is no vehicle to command", severity="warning")
            return
        metadata = _metadata(self.snapshot, name)
        title = f"{printable(name)}: {metadata.text}" if metadata.text else printable(name)
        label = f"Value [{metadata.unit}]" if metadata.unit else "Value"
        if metadata.bounds:
            label += f" {metadata.bounds}"
        value = _value_text(self.snapshot.parameters[name])
        self.app.push_screen(AskScreen(title, [(label, value)], lambda texts: self._set(name, texts[0])))

    def _set(self, name: str, text: str) -> str | None:
        value = parse_number(text)
        if value is None:
            return f"{printable(name)}: {text!r} is not a number"
        problem = _metadata(self.snapshot, name).problem_with(value)
        if problem is not None:
            return f"{printable(name)}: {problem}"
        if self._station is not None:
            self._station.set_parameter(name, value, self._clock())
        return None

    # Inside

    def _request(self) -> None:
        """Fetch missing parameters and metadata, once; the screen may be open before there is a vehicle."""
        s = self.snapshot
        if self._is_requested or self._station is None or s.source is None:
            return
        self._is_requested = True
        if not s.parameters or len(s.parameters) < (s.parameter_count or 0):
            self._station.fetch_parameters(self._clock())
        self._station.fetch_parameter_metadata(self._clock())

    @on(Input.Changed)
    def _filter_changed(self) -> None:
        self._show()

    @on(DataTable.RowHighlighted)
    def _row_highlighted(self) -> None:
        self._show_status()

    @property
    def _selected_name(self) -> str | None:
        row = self.table.cursor_row
        return self._shown_names[row] if 0 <= row < len(self._shown_names) else None

    def _show(self) -> None:
        s, table = self.snapshot, self.table
        names = matching_names(s, self.query_one("#filter", Input).value, only_changed=self._only_changed)
        if names == self._shown_names and s.parameter_metadata is self._shown_metadata:
            for name in names:
                for column, cell in zip(PARAMETER_COLUMNS[: VALUE_COLUMN + 1], parameter_cells(s, name), strict=False):
                    table.update_cell(name, column, cell)
        else:
            selected = self._selected_name
            self._shown_names, self._shown_metadata = names, s.parameter_metadata
            table.clear()
            for name in names:
                table.add_row(*parameter_cells(s, name), key=name)
            if selected in names:
                table.move_cursor(row=names.index(selected))
        self._show_status()

    def _show_status(self) -> None:
        name = self._selected_name
        description = "" if name is None else _description(self.snapshot, name)
        self.query_one("#parameter-description", Static).update(description)
        counts = _counts(self.snapshot, len(self._shown_names))
        last = self.snapshot.messages[-1].text if self.snapshot.messages else ""
        self.query_one("#parameter-status", Static).update(f"{counts}\n{last}")


def matching_names(s: Snapshot, text: str, *, only_changed: bool = False) -> tuple[str, ...]:
    """Names of the parameters with every word of the text in their name or description, in order."""
    words = text.lower().split()
    return tuple(
        name
        for name in sorted(s.parameters)
        if all(word in f"{name} {_metadata(s, name).text}".lower() for word in words)
        and (is_changed(s, name) or not only_changed)
    )


def is_changed(s: Snapshot, name: str) -> bool:
    """True if a parameter differs from its default; false if the default is not known."""
    default, value = _metadata(s, name).default, s.parameters[name]
    if math.isnan(default):
        return False
    return not math.isclose(value, default, rel_tol=RELATIVE_TOLERANCE, abs_tol=ABSOLUTE_TOLERANCE)


def parameter_cells(s: Snapshot, name: str) -> tuple[Text, ...]:
    """A parameter's cells in the table; a star marks one that differs from its default."""
    metadata = _metadata(s, name)
    mark = "*" if is_changed(s, name) else " "
    value = _value_text(s.parameters[name])
    cells = (mark, printable(name), value, metadata.unit, metadata.bounds, metadata.text)
    return tuple(Text(cell) for cell in cells)


def _metadata(s: Snapshot, name: str) -> ParameterMetadata:
    return s.parameter_metadata.get(name, NO_METADATA)


def _value_text(value: float) -> str:
    """A value as it is edited, in the digits of a float32."""
    return str(value) if isinstance(value, int) else f"{value:.7g}"


def _description(s: Snapshot, name: str) -> str:
    metadata = _metadata(s, name)
    default = "" if math.isnan(metadata.default) else f"default {metadata.default:g}"
    reboot = "takes effect after a reboot" if metadata.needs_reboot else ""
    parts = [metadata.text, f"{metadata.bounds} {metadata.unit}".strip(), default, reboot]
    return f"{printable(name)}: " + (", ".join(filter(None, parts)) or "the vehicle has no description of it")


def _counts(s: Snapshot, shown: int) -> str:
    if not s.parameters:
        return "no parameters received yet" if s.source is not None else "no vehicle has been heard yet"
    received, count = len(s.parameters), s.parameter_count or 0
    if received < count:
        return f"{received} of {count} parameters received"
    changed = sum(is_changed(s, name) for name in s.parameters)
    return f"{shown} of {received} parameters shown, {changed} changed from default (*)"
