"""The vehicle's parameters: found by typing, explained in its own words, changed one at a time."""

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

from darko_gcs.meanings import UNKNOWN, Meaning
from darko_gcs.screens.dialogs import AskScreen, ask_number
from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.station import Station
from darko_gcs.widgets.status import StatusBar
from darko_gcs.words import printable

__all__ = ["ParametersScreen", "differs", "matching", "row", "value_text"]

COLUMNS = ("", "name", "value", "unit", "range", "meaning")
VALUE = COLUMNS.index("value")
CLOSE = 1e-6  # relative: values are float32 on the wire, defaults are decimals in a file


class ParametersScreen(Screen[None]):
    """A table that follows the vehicle; what is typed filters it."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "close", "Back", priority=True),
        Binding("enter", "edit", "Change", priority=True),
        Binding("up", "move('cursor_up')", show=False, priority=True),
        Binding("down", "move('cursor_down')", show=False, priority=True),
        Binding("pageup", "move('page_up')", show=False, priority=True),
        Binding("pagedown", "move('page_down')", show=False, priority=True),
        Binding("f5", "fetch", "Fetch again", priority=True),
        Binding("f2", "changed", "Only changed", priority=True),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float]) -> None:
        super().__init__()
        self._station, self._clock = station, clock
        self._shown: tuple[str, ...] = ()  # names, in the table's order
        self._meanings: Mapping[str, Meaning] = {}  # as in the table
        self._asked = False
        self._only_changed = False
        self._filled = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted

    def compose(self) -> ComposeResult:
        """Status bar, filter, table, words, footer."""
        yield StatusBar().data_bind(ParametersScreen.snapshot, ParametersScreen.now)
        yield Input(placeholder="type a part of a name or of a meaning", id="filter", compact=True)
        yield DataTable(id="parameters", cursor_type="row", zebra_stripes=True)
        yield Static("", id="parameter-meaning", markup=False)
        yield Static("", id="parameter-words", markup=False)
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        """Fill the table."""
        for name in COLUMNS:
            self.table.add_column(name, key=name)
        self.table.can_focus = False
        self._filled = True
        self._ask()
        self._show()

    @property
    def table(self) -> DataTable[Text]:
        """The table of parameters."""
        return self.query_one("#parameters", DataTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle: its values, whoever changes them."""
        if not self._filled:
            return
        self._ask()
        if s.parameters is not old.parameters or s.meanings is not old.meanings:
            self._show()
        elif s.messages is not old.messages:
            self._say()

    # Keys

    def action_close(self) -> None:
        """Back to the flight; first, back to all parameters."""
        field = self.query_one("#filter", Input)
        if field.value:
            field.value = ""
        else:
            self.dismiss(None)

    def action_move(self, how: str) -> None:
        """Move the table's cursor while the filter has the keys."""
        getattr(self.table, f"action_{how}")()

    def action_fetch(self) -> None:
        """Have the vehicle tell all of them again."""
        if self._station is not None:
            self._station.fetch_parameters(self._clock())

    def action_changed(self) -> None:
        """Show only what differs from its default, or all again."""
        self._only_changed = not self._only_changed
        self._show()

    def action_edit(self) -> None:
        """Change the parameter under the cursor."""
        name = self._selected
        if name is None:
            return
        if self._station is None:
            self.app.notify("This is a recording: there is no vehicle to command", severity="warning")
            return
        meaning = self._meaning(name)
        title = f"{printable(name)}: {meaning.text}" if meaning.text else printable(name)
        label = f"Value [{meaning.unit}]" if meaning.unit else "Value"
        if meaning.bounds:
            label += f" {meaning.bounds}"
        value = value_text(self.snapshot.parameters[name])
        self.app.push_screen(AskScreen(title, [(label, value)], lambda texts: self._set(name, texts[0])))

    def _set(self, name: str, text: str) -> str | None:
        value = ask_number(text)
        if value is None:
            return f"{printable(name)}: {text!r} is not a number"
        complaint = self._meaning(name).complaint(value)
        if complaint is not None:
            return f"{printable(name)}: {complaint}"
        if self._station is not None:
            self._station.set_parameter(name, value, self._clock())
        return None

    # Inside

    def _ask(self) -> None:
        """Have the vehicle tell what is not known yet, once; the screen may be open before there is one."""
        s = self.snapshot
        if self._asked or self._station is None or s.source is None:
            return
        self._asked = True
        if not s.parameters or len(s.parameters) < (s.parameter_count or 0):
            self._station.fetch_parameters(self._clock())
        self._station.fetch_meanings(self._clock())

    @on(Input.Changed)
    def _filtered(self) -> None:
        self._show()

    @on(DataTable.RowHighlighted)
    def _highlighted(self) -> None:
        self._say()

    @property
    def _selected(self) -> str | None:
        return self._shown[self.table.cursor_row] if 0 <= self.table.cursor_row < len(self._shown) else None

    def _meaning(self, name: str) -> Meaning:
        return self.snapshot.meanings.get(name, UNKNOWN)

    def _show(self) -> None:
        s, table = self.snapshot, self.table
        names = matching(s, self.query_one("#filter", Input).value, only_changed=self._only_changed)
        if names == self._shown and s.meanings is self._meanings:
            for name in names:
                for column, cell in zip(COLUMNS[: VALUE + 1], row(s, name), strict=False):
                    table.update_cell(name, column, cell)
        else:
            selected = self._selected
            self._shown, self._meanings = names, s.meanings
            table.clear()
            for name in names:
                table.add_row(*row(s, name), key=name)
            if selected in names:
                table.move_cursor(row=names.index(selected))
        self._say()

    def _say(self) -> None:
        name = self._selected
        self.query_one("#parameter-meaning", Static).update("" if name is None else _explained(self.snapshot, name))
        words = _summary(self.snapshot, len(self._shown))
        last = self.snapshot.messages[-1].text if self.snapshot.messages else ""
        self.query_one("#parameter-words", Static).update(f"{words}\n{last}")


def matching(s: Snapshot, text: str, *, only_changed: bool = False) -> tuple[str, ...]:
    """Names of the parameters that hold every word of the text in their name or their meaning, in order."""
    words = text.lower().split()
    return tuple(
        name
        for name in sorted(s.parameters)
        if all(word in f"{name} {s.meanings.get(name, UNKNOWN).text}".lower() for word in words)
        and (differs(s, name) or not only_changed)
    )


def differs(s: Snapshot, name: str) -> bool:
    """Whether a parameter is not at the default that the vehicle told; false where it told none."""
    default = s.meanings.get(name, UNKNOWN).default
    return not math.isnan(default) and not math.isclose(s.parameters[name], default, rel_tol=CLOSE, abs_tol=1e-12)


def row(s: Snapshot, name: str) -> tuple[Text, ...]:
    """A parameter's cells; a star marks what differs from its default."""
    meaning = s.meanings.get(name, UNKNOWN)
    mark = "*" if differs(s, name) else " "
    cells = (mark, printable(name), value_text(s.parameters[name]), meaning.unit, meaning.bounds, meaning.text)
    return tuple(Text(cell) for cell in cells)


def value_text(value: float) -> str:
    """A value as it is edited: a float32 in the digits that say it."""
    return str(value) if isinstance(value, int) else f"{value:.7g}"


def _explained(s: Snapshot, name: str) -> str:
    meaning = s.meanings.get(name, UNKNOWN)
    default = "" if math.isnan(meaning.default) else f"default {meaning.default:g}"
    reboot = "in force after a reboot" if meaning.needs_reboot else ""
    said = [meaning.text, f"{meaning.bounds} {meaning.unit}".strip(), default, reboot]
    return f"{printable(name)}: " + (", ".join(filter(None, said)) or "the vehicle does not say what it means")


def _summary(s: Snapshot, shown: int) -> str:
    if not s.parameters:
        return "no parameters were told so far" if s.source is not None else "no vehicle has been heard yet"
    known, count = len(s.parameters), s.parameter_count or 0
    if known < count:
        return f"{known} of {count} parameters received"
    changed = sum(differs(s, name) for name in s.parameters)
    return f"{shown} of {known} parameters shown, {changed} (*) not at their default"
