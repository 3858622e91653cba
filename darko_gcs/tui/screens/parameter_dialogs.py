"""Parameters in dialogs: one of several values, the bits of a mask, and a file beside the vehicle's values."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Label, OptionList, SelectionList, Static

from darko_gcs.state.parameters import ChangeState, Difference, ParameterMetadata, is_changed, metadata_of, number_text
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import why_unreachable
from darko_gcs.tui.containment import Dialog
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.screens.dialogs import ChooseScreen
from darko_gcs.tui.widgets.panel import styled_line
from darko_gcs.tui.widgets.row_list import RowList, padded

MARKS, NAME, UNIT, DEFAULT = 3, 16, 6, 18  # widths [cells]
NARROW_VALUE, VALUE = 20, 28
WIDE_FROM = 110  # narrower lists have no column for the default [cells]
CHANGE_MARKS = {ChangeState.WAITING: "…", ChangeState.REFUSED: "!", ChangeState.SET: " "}
CHANGE_STYLES = {ChangeState.WAITING: "dim", ChangeState.REFUSED: "warn", ChangeState.SET: "good"}


def parameter_heading(width: int) -> StyledLine:
    """Names of the columns."""
    return [(_cells(width, "", "name", "value", "unit", "default", "description"), "label")]


def parameter_row(s: Snapshot, name: str, favourites: Collection[str], width: int) -> StyledLine:
    """One parameter: marks of a favourite, of a value that is not the default and of a change, then its cells."""
    metadata = metadata_of(s, name)
    change = s.parameters.changes.get(name)
    changed = is_changed(s, name)
    marks = ("★" if name in favourites else " ") + ("*" if changed else " ")
    marks += CHANGE_MARKS[change.state] if change is not None else " "
    default = "" if math.isnan(metadata.default) else metadata.shown(metadata.default)
    value = metadata.shown(s.parameters.values[name])
    text = _cells(width, marks, printable(name), value, metadata.unit, default, metadata.text)
    is_refused = change is not None and change.state is ChangeState.REFUSED
    return styled_line((text, "warn" if is_refused else "accent" if changed else ""))


def _cells(width: int, marks: str, name: str, value: str, unit: str, default: str, text: str) -> str:
    is_wide = width >= WIDE_FROM
    cells = [padded(marks, MARKS), padded(name, NAME), padded(value, VALUE if is_wide else NARROW_VALUE)]
    cells.append(padded(unit, UNIT))
    if is_wide:
        cells.append(padded(default, DEFAULT))
    used = sum(map(len, cells)) + len(cells)
    return " ".join([*cells, padded(text, max(0, width - used))])


def difference_heading(width: int, other: str) -> StyledLine:
    """Names of the columns of a comparison."""
    return [(_compared(width, "", "name", other, "vehicle", ""), "label")]


def difference_row(s: Snapshot, each: Difference, width: int, *, is_chosen: bool) -> StyledLine:
    """One difference: whether it is chosen, what the file and the vehicle have, and what became of a change."""
    metadata, change = metadata_of(s, each.name), s.parameters.changes.get(each.name)
    vehicle = s.parameters.values.get(each.name)
    here = "missing" if vehicle is None else metadata.shown(vehicle)
    is_ours = change is not None and change.value == each.other
    state = change.words if change is not None and is_ours else ""
    style = CHANGE_STYLES[change.state] if change is not None and is_ours else "dim" if vehicle is None else ""
    box = "   " if vehicle is None else "[x]" if is_chosen else "[ ]"
    return styled_line((_compared(width, box, printable(each.name), metadata.shown(each.other), here, state), style))


def _compared(width: int, box: str, name: str, other: str, vehicle: str, state: str) -> str:
    value_width = max(10, (width - MARKS - NAME - 5) * 3 // 10)
    cells = [padded(box, MARKS), padded(name, NAME), padded(other, value_width), padded(vehicle, value_width)]
    used = sum(map(len, cells)) + len(cells)
    return " ".join([*cells, padded(state, max(0, width - used))])


KEYS = "Space: choose  a: all or none  Enter: set on the vehicle  Esc: close"


class ComparisonScreen(Dialog[None]):
    """Differences between a file and the vehicle; all that the vehicle has are chosen at first.

    Args:
        title: Names the file.
        rows: What differs.
        s: The vehicle as it is now.
        station: Sets parameters; None in a recording.
        clock: The station's [s].
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "Close"),
        Binding("enter", "load", "Set the chosen ones"),
        Binding("space", "choose", "Choose"),
        Binding("a", "choose_all", "All or none"),
        Binding("up", "move(-1)", show=False),
        Binding("down", "move(1)", show=False),
        Binding("pageup", "page(-1)", show=False),
        Binding("pagedown", "page(1)", show=False),
    ]

    def __init__(
        self, title: str, rows: Sequence[Difference], s: Snapshot, station: Station | None, clock: Callable[[], float]
    ) -> None:
        super().__init__()
        self._title, self._s, self._station, self._clock = title, s, station, clock
        self._rows = {row.name: row for row in rows}
        self._known = frozenset(row.name for row in rows if row.vehicle is not None)
        self.chosen = self._known
        self._sent: frozenset[str] = frozenset()
        self.table = RowList(lambda width: difference_heading(width, "file"), self._draw_row, id="differences")
        self._status = Static(id="difference-status", markup=False)

    def compose(self) -> ComposeResult:
        """Title, rows, the chosen row's state, keys."""
        with Vertical(classes="dialog comparison"):
            yield Label(self._title, id="question", markup=False)
            yield self.table
            yield self._status
            yield Static(KEYS, classes="hint", markup=False)

    def on_mount(self) -> None:
        """Fill the list."""
        self.table.show(tuple(self._rows))
        self._tell()

    def follow(self, s: Snapshot) -> None:
        """Show the vehicle as it is now."""
        is_same = (
            s.parameters.values is self._s.parameters.values and s.parameters.changes is self._s.parameters.changes
        )
        self._s = s
        if self.is_mounted and not is_same:
            self.table.redraw()
            self._tell()

    def on_row_list_moved(self) -> None:
        """Tell about the row under the cursor."""
        self._tell()

    def action_move(self, rows: int) -> None:
        """Move the cursor."""
        self.table.move(rows)

    def action_page(self, pages: int) -> None:
        """Move the cursor by pages."""
        self.table.move_page(pages)

    def action_choose(self) -> None:
        """Choose the row under the cursor, or no longer."""
        if self.table.key in self._known:
            self._choose(self.chosen ^ {self.table.key})

    def action_choose_all(self) -> None:
        """Choose all, or none if all are chosen."""
        self._choose(frozenset() if self.chosen == self._known else self._known)

    def action_load(self) -> None:
        """Set the chosen ones on the vehicle."""
        reason = why_unreachable(self._station, self._s) or ("" if self.chosen else "Nothing is chosen")
        if reason:
            self.app.notify(reason, severity="warning")
        elif self._station is not None:
            self._sent |= self.chosen
            self._station.set_parameters({name: self._rows[name].other for name in sorted(self.chosen)}, self._clock())
            self._choose(frozenset())

    def _choose(self, names: frozenset[str]) -> None:
        self.chosen = names
        self.table.redraw()
        self._tell()

    def _draw_row(self, name: str, width: int) -> StyledLine:
        return difference_row(self._s, self._rows[name], width, is_chosen=name in self.chosen)

    def _tell(self) -> None:
        changes = [self._s.parameters.changes[name] for name in self._sent if name in self._s.parameters.changes]
        counts = [(sum(change.state is state for change in changes), state.value) for state in ChangeState]
        parts = [f"{len(self.chosen)} of {len(self._rows)} chosen", *(f"{n} {word}" for n, word in counts if n)]
        under = self._s.parameters.changes.get(self.table.key or "") if self.table.key in self._sent else None
        about = "" if under is None else f"\n{self.table.key}: {under.words}"
        self._status.update(", ".join(parts) + about)


ANOTHER_NUMBER = "another number…"


class ChooseValueScreen(ChooseScreen):
    """One of an enumeration's values; the present one is under the cursor. Gives its place in the list.

    Args:
        title: Over the list.
        metadata: Of the parameter. If its range is longer than its list, the last choice is another number.
        value: The present one.
    """

    def __init__(self, title: str, metadata: ParameterMetadata, value: float) -> None:
        numbers = [number for number, _ in metadata.values]
        choices = [metadata.shown(number) + _notes(metadata, number, value) for number in numbers]
        super().__init__(title, choices if metadata.is_listed else [*choices, ANOTHER_NUMBER])
        self._start = numbers.index(value) if value in numbers else len(choices) - metadata.is_listed

    def on_mount(self) -> None:
        """Begin at the present value."""
        self.query_one(OptionList).highlighted = self._start


def _notes(metadata: ParameterMetadata, number: float, value: float) -> str:
    notes = ["now"] * (number == value) + ["default"] * (number == metadata.default)
    return f"  ← {', '.join(notes)}" if notes else ""


class ChooseBitsScreen(Dialog["int | None"]):
    """The bits of a mask, switched one by one. Bits without a name stay as they are.

    Args:
        title: Over the list.
        bits: Number and name of each.
        value: The present one.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "Cancel"),
        Binding("enter", "confirm", "Confirm", priority=True),
    ]

    def __init__(self, title: str, bits: Sequence[tuple[int, str]], value: int) -> None:
        super().__init__()
        self._title, self._bits, self._value = title, bits, value

    def compose(self) -> ComposeResult:
        """A switch per bit."""
        rows = [(f"{name} (bit {bit})", bit, bool(self._value >> bit & 1)) for bit, name in self._bits]
        with Vertical(classes="dialog"):
            yield Label(self._title, id="question", markup=False)
            yield SelectionList[int](*rows, compact=True)
            yield Static(id="mask", markup=False)
            yield Static("Space: switch    Enter: confirm    Esc: cancel", classes="hint")

    def on_mount(self) -> None:
        """Say the number."""
        self._tell()

    def on_selection_list_selected_changed(self) -> None:
        """Say the number again."""
        self._tell()

    @property
    def mask(self) -> int:
        """The number with the bits as they are switched."""
        known = sum(1 << bit for bit, _ in self._bits)
        switched: list[int] = self.query_one(SelectionList).selected
        return (self._value & ~known) | sum(1 << bit for bit in switched)

    def _tell(self) -> None:
        self.query_one("#mask", Static).update(f"{number_text(self._value)} becomes {self.mask}")

    def action_confirm(self) -> None:
        """Close with the number."""
        self.dismiss(self.mask)

    def action_cancel(self) -> None:
        """Close without a choice."""
        self.dismiss(None)
