"""Dialogs of parameters: one of several values, the bits of a mask, and a file's name."""

from __future__ import annotations

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Label, OptionList, SelectionList, Static

from darko_gcs.state.parameter_metadata import ParameterMetadata, number_text
from darko_gcs.tui.screens.dialogs import ChooseScreen
from darko_gcs.tui.screens.station_screen import Dialog

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
