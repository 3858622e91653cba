"""Small dialogs. Telemetry continues beneath them."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, ClassVar

from rich.table import Table
from rich.text import Text
from textual import events, on
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.widgets import Button, Input, Label, OptionList, Static

from darko_gcs.tui.screens.station_screen import Dialog

KEY_WIDTH = 12  # [cells]
Named = Callable[[str], str]  # a question, with the vehicle that it is about if there are several


class ConfirmScreen(Dialog[bool]):
    """A question with yes and no; no has the focus at first."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("y", "answer(True)", "Yes"),
        Binding("n,escape", "answer(False)", "No"),
    ]

    def __init__(self, question: str) -> None:
        super().__init__()
        self._question = question
        self.shown_at = math.inf  # keys from before are no answer [s]

    def compose(self) -> ComposeResult:
        """Question and buttons."""
        with Vertical(classes="dialog"):
            yield Label(self._question, id="question", markup=False)
            with Horizontal(classes="buttons"):
                yield Button("Yes (y)", variant="error", id="yes")
                yield Button("No (n)", variant="primary", id="no")

    def on_mount(self, event: events.Mount) -> None:
        """Make the harmless answer the default."""
        self.shown_at = event.time
        self.query_one("#no").focus()

    def action_answer(self, answer: bool) -> None:
        """Close with an answer."""
        self.dismiss(answer)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        self.dismiss(event.button.id == "yes")


def confirm(app: App[Any], question: str, then: Callable[[], object]) -> None:
    """Ask a question, and do something after a yes."""

    def answered(yes: bool | None) -> None:
        if yes:
            then()

    app.push_screen(ConfirmScreen(question), answered)


class QuitScreen(ConfirmScreen):
    """The question before the end; there is never more than one of it."""


Check = Callable[[tuple[str, ...]], str | None]  # what is wrong with the texts, or None


class AskScreen(Dialog["tuple[str, ...] | None"]):
    """A few fields to fill in; closes when ``check`` finds nothing wrong. Without ``check``, the fields are numbers."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Cancel")]

    def __init__(self, title: str, fields: Sequence[tuple[str, str]], check: Check | None = None) -> None:
        super().__init__()
        self._title, self._fields = title, fields
        self._check = check or self._check_numbers

    def compose(self) -> ComposeResult:
        """A labelled input per field."""
        with Vertical(classes="dialog"):
            yield Label(self._title, id="question", markup=False)
            for index, (label, value) in enumerate(self._fields):
                with Horizontal(classes="field"):
                    yield Label(label, markup=False)
                    yield Input(value, id=f"field-{index}", compact=True)
            yield Static("", id="problem", markup=False)
            next_field = "Tab: next field    " if len(self._fields) > 1 else ""
            yield Static(f"{next_field}Enter: confirm    Esc: cancel", classes="hint")

    @on(Input.Submitted)
    def _submitted(self) -> None:
        values = tuple(field.value.strip() for field in self.query(Input))
        problem = self._check(values)
        if problem is None:
            self.dismiss(values)
        else:
            self.query_one("#problem", Static).update(problem)

    def _check_numbers(self, values: tuple[str, ...]) -> str | None:
        for (label, _), value in zip(self._fields, values, strict=True):
            if parse_number(value) is None:
                return f"{label}: {value!r} is not a number"
        return None

    def action_cancel(self) -> None:
        """Close without an answer."""
        self.dismiss(None)


class ChooseScreen(Dialog["int | None"]):
    """One choice from a list."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Cancel")]

    def __init__(self, title: str, choices: Sequence[str]) -> None:
        super().__init__()
        self._title, self._choices = title, choices

    def compose(self) -> ComposeResult:
        """A list."""
        with Vertical(classes="dialog"):
            yield Label(self._title, id="question")
            yield OptionList(*self._choices, markup=False, compact=True)
            yield Static("Enter: choose    Esc: cancel", classes="hint")

    @on(OptionList.OptionSelected)
    def _chosen(self, event: OptionList.OptionSelected) -> None:
        self.dismiss(event.option_index)

    def action_cancel(self) -> None:
        """Close without a choice."""
        self.dismiss(None)


class HelpScreen(Dialog[None]):
    """Keys and colours, in sections; the arrows and page keys scroll.

    Args:
        sections: Title and rows (key, text) of each.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,question_mark,q", "dismiss", "Close")]

    def __init__(self, sections: Sequence[tuple[str, Sequence[tuple[str, str]]]]) -> None:
        super().__init__()
        self._sections = sections

    def compose(self) -> ComposeResult:
        """A line per row, or several where its text is long."""
        with Vertical(classes="dialog help"):
            with VerticalScroll():
                for title, rows in self._sections:
                    yield Static(title, markup=False)
                    yield Static(_table(rows))
                    yield Static("")
            yield Static("Up/Down/PgUp/PgDn: scroll    Ctrl+P: command palette    Esc: close", classes="hint")

    def on_mount(self) -> None:
        """Let the keys scroll."""
        self.query_one(VerticalScroll).focus()


def _table(rows: Sequence[tuple[str, str]]) -> Table:
    """Keys, and beside them texts that keep to their own column."""
    table = Table.grid(padding=(0, 1))
    table.add_column(width=KEY_WIDTH + 2)
    table.add_column(ratio=1)
    for key, text in rows:
        table.add_row(Text(f"  {key}"), Text(text))
    return table


def parse_number(text: str) -> float | None:
    """The finite number that a text spells, or None."""
    try:
        value = float(text)
    except ValueError:
        return None
    return value if math.isfinite(value) else None
