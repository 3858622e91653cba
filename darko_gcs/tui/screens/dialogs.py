"""Small dialogs, among them one for a file's path, which completes itself. Telemetry continues beneath them."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Sequence
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

from rich.table import Table
from rich.text import Text
from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.suggester import Suggester
from textual.widgets import Button, Input, Label, OptionList, Static

from darko_gcs.state.number_ranges import number_problem
from darko_gcs.tui.containment import Dialog, on
from darko_gcs.tui.plan_draft import short_path
from protocol.ranges import ValueRange

MAX_MATCHES = 200  # of a folder's entries


def path_matches(text: str, suffixes: Collection[str] = ()) -> list[str]:
    """Paths that begin with a text: folders, with a slash at the end, and files with one of the suffixes.

    Args:
        text: As typed; ``~`` is the user's folder, and stays as typed.
        suffixes: Of the files that are wanted, ".plan"; empty: any file.
    """
    head, tail = os.path.split(text)
    try:
        entries = sorted(Path(head or ".").expanduser().iterdir(), key=lambda entry: entry.name.lower())
        found = [
            os.path.join(head, entry.name) + "/" * entry.is_dir()  # noqa: PTH118 - pathlib would drop a leading "./"
            for entry in entries
            if entry.name.startswith(tail)
            and (tail.startswith(".") or not entry.name.startswith("."))
            and (entry.is_dir() or not suffixes or entry.suffix in suffixes)
        ]
    except (OSError, RuntimeError):  # RuntimeError: nobody has this home folder
        return []
    return found[:MAX_MATCHES]


Matches = Callable[[str], list[str]]  # texts that a text may become


class CompletedInput(Input):
    """A field that completes what is typed; a Tab after a completion goes on to the next one.

    Args:
        value: At first.
        complete: Texts that begin with what is typed.
        id: Of the widget.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("tab", "complete", "Complete", show=False)]

    def __init__(self, value: str, complete: Matches, *, id: str | None = None) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(value, id=id, compact=True, suggester=_FirstMatch(complete))
        self._complete = complete
        self._offered: list[str] = []  # the completion that stands there, and those that were not shown yet

    @property
    def matches(self) -> list[str]:
        """Texts that the text may become."""
        return self._complete(self.value)

    def action_complete(self) -> None:
        """Complete to the first match, then to the others; with nothing more to complete, go to the next field.

        The matches are those of the text as it stands: the suggestion that is shown follows it later.
        """
        is_again = self._offered[:1] == [self.value]
        left = self._offered[1:] if is_again else []
        self._offered = left or [text for text in self.matches if text != self.value]
        self.take_completion(self._offered[0] if self._offered else "")

    def take_completion(self, text: str) -> None:
        """Put a text in the place of what is typed; an empty one: go to the next field."""
        if not text:
            self.screen.focus_next()
            return
        self.value = text
        self.cursor_position = len(text)


class PathInput(CompletedInput):
    """A field for a path.

    Args:
        value: At first.
        suffixes: Of the files that are wanted; empty: any.
        id: Of the widget.
    """

    def __init__(self, value: str = "", *, suffixes: Collection[str] = (), id: str | None = None) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(value, lambda text: path_matches(text, suffixes), id=id)

    def action_complete(self) -> None:
        """Complete as far as all paths agree: they are listed; with nothing to complete, go to the next field."""
        common = os.path.commonprefix(self.matches)  # noqa: RUF071 - of characters, as they are typed
        self.take_completion(common if len(common) > len(self.value) else "")


class _FirstMatch(Suggester):
    """The first match."""

    def __init__(self, complete: Matches) -> None:
        super().__init__(use_cache=False, case_sensitive=True)
        self._complete = complete

    async def get_suggestion(self, value: str) -> str | None:
        matches = self._complete(value) if value else []
        return matches[0] if matches else None


KEY_WIDTH = 12  # [cells]
Named = Callable[[str], str]  # a question, with the vehicle that it is about if there are several


class ConfirmScreen(Dialog[bool]):
    """A question with yes and no; no has the focus at first.

    Args:
        question: In words.
        yes: The key that agrees.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("n,escape", "answer(False)", "No"),
    ]

    def __init__(self, question: str, yes: str = "y") -> None:
        super().__init__()
        self._question, self._yes = question, yes
        self.shown_at = math.inf  # keys from before are no answer [s]

    def compose(self) -> ComposeResult:
        """Question and buttons."""
        with Vertical(classes="dialog"):
            yield Label(self._question, id="question", markup=False)
            with Horizontal(classes="buttons"):
                yield Button(f"Yes ({self._yes})", variant="error", id="yes")
                yield Button("No (n)", variant="primary", id="no")

    def on_mount(self, event: events.Mount) -> None:
        """Make the harmless answer the default."""
        self.shown_at = event.time
        self.query_one("#no").focus()

    def on_key(self, event: events.Key) -> None:
        """Agree by a key of its own."""
        if event.key == self._yes:
            event.stop()
            self.dismiss(True)

    def action_answer(self, answer: bool) -> None:
        """Close with an answer."""
        self.dismiss(answer)

    @on(Button.Pressed)
    def _pressed(self, event: Button.Pressed) -> None:
        self.dismiss(event.button.id == "yes")


def confirm(app: App[Any], question: str, then: Callable[[], object], yes: str = "y") -> None:
    """Ask a question that a key agrees to, and do something then."""

    def answered(yes: bool | None) -> None:
        if yes:
            then()

    app.push_screen(ConfirmScreen(question, yes), answered)


class QuitScreen(ConfirmScreen):
    """The question before the end; there is never more than one of it."""


NORTH_LABEL, EAST_LABEL = "North of home [m]", "East of home [m]"  # labels of a place, and their help
SOUTH_HELP, WEST_HELP = "Below 0: south of it", "Below 0: west of it"
SHORT_LABEL = 12  # that leaves more room for the text beside it [cells]
Check = Callable[[tuple[str, ...]], str | None]  # what is wrong with the texts, or None


class FormField(NamedTuple):
    """A field to fill in."""

    label: str  # with its unit in brackets
    value: str  # at first
    help: str  # one line, shown while the field has the focus


class AskScreen(Dialog["tuple[str, ...] | None"]):
    """A few fields to fill in; closes when nothing is wrong with them.

    Args:
        title: What is asked.
        fields: In their order.
        check: What is wrong with the texts, or None.
        ranges: Of the first fields, which are numbers; ``check`` gets such as lie in them.
        complete: Texts that a text may become, for Tab; None: Tab goes to the next field.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape", "cancel", "Cancel")]

    def __init__(
        self,
        title: str,
        fields: Sequence[FormField],
        check: Check | None = None,
        *,
        ranges: Sequence[ValueRange] = (),
        complete: Matches | None = None,
    ) -> None:
        super().__init__()
        self._title, self._fields, self._ranges, self._check = title, fields, ranges, check
        self._complete = complete

    def compose(self) -> ComposeResult:
        """A labelled input per field."""
        with Vertical(classes="dialog"):
            yield Label(self._title, id="question", markup=False)
            is_short = max(len(field.label) for field in self._fields) < SHORT_LABEL
            for index, field in enumerate(self._fields):
                with Horizontal(classes="field -short-label" if is_short else "field"):
                    yield Label(field.label, markup=False)
                    yield self._input(index, field.value)
            yield Static(self._fields[0].help, id="field-help", markup=False)
            yield Static("", id="problem", markup=False)
            tab = "Tab: complete    " if self._complete else "Tab: next field    " if len(self._fields) > 1 else ""
            yield Static(f"{tab}Enter: confirm    Esc: cancel", classes="hint")

    def _input(self, index: int, value: str) -> Input:
        name = f"field-{index}"
        return (
            Input(value, id=name, compact=True)
            if self._complete is None
            else CompletedInput(value, self._complete, id=name)
        )

    @on(events.DescendantFocus)
    def _explain(self) -> None:
        """Tell what the field with the focus is for."""
        helps = dict(zip(self.query(Input), (field.help for field in self._fields), strict=True))
        if isinstance(self.focused, Input):
            self.query_one("#field-help", Static).update(helps[self.focused])

    @on(Input.Submitted)
    def _submitted(self) -> None:
        values = tuple(field.value.strip() for field in self.query(Input))
        numbers = zip(self._fields, values, self._ranges, strict=False)
        problems = (number_problem(field.label, value, allowed) for field, value, allowed in numbers)
        problem = next(filter(None, problems), None)
        if problem is None and self._check is not None:
            problem = self._check(values)
        if problem is None:
            self.dismiss(values)
        else:
            self.query_one("#problem", Static).update(problem)

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


MAX_SHOWN = 12  # paths below the field


class FileDialog(Dialog["str | None"]):
    """Closes when ``check`` finds nothing wrong with the path.

    Args:
        title: What the file is for.
        value: Path at first.
        known: Paths that are offered until another one is typed: recent files first.
        suffixes: Of the files that are wanted.
        check: What is wrong with a path, or None.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "cancel", "Cancel"),
        Binding("down", "to_list", "List", show=False),
    ]

    def __init__(
        self,
        title: str,
        value: str,
        *,
        known: Sequence[str],
        suffixes: Collection[str],
        check: Callable[[str], str | None],
    ) -> None:
        super().__init__()
        self._title, self._first, self._suffixes, self._check = title, value, suffixes, check
        self._known = tuple(dict.fromkeys(map(short_path, known)))

    def compose(self) -> ComposeResult:
        """Field, list, what is wrong."""
        with Vertical(classes="dialog files"):
            yield Label(self._title, id="question", markup=False)
            yield PathInput(self._first, suffixes=self._suffixes, id="path")
            yield Static("", id="problem", markup=False)
            yield OptionList(*self._known[:MAX_SHOWN], markup=False, compact=True, id="paths")
            yield Static("Tab: complete    Down: list    Enter: confirm    Esc: cancel", classes="hint")

    @property
    def field(self) -> PathInput:
        """The field of the path."""
        return self.query_one("#path", PathInput)

    @property
    def paths(self) -> OptionList:
        """The paths that are offered."""
        return self.query_one("#paths", OptionList)

    @on(Input.Changed, "#path")
    def _typed(self, event: Input.Changed) -> None:
        offered = self._known if event.value in {"", self._first} else self.field.matches
        self.paths.clear_options()
        self.paths.add_options(list(offered)[:MAX_SHOWN])

    @on(Input.Submitted, "#path")
    def _submitted(self, event: Input.Submitted) -> None:
        self._answer(event.value.strip())

    @on(OptionList.OptionSelected)
    def _chosen(self, event: OptionList.OptionSelected) -> None:
        path = str(event.option.prompt)
        if not path.endswith("/"):
            self._answer(path)
            return
        self.field.value = path  # a folder: look into it
        self.field.cursor_position = len(path)
        self.field.focus()

    def _answer(self, path: str) -> None:
        problem = self._check(path) if path else "Type the path of a file"
        if problem is None:
            self.dismiss(path)
        else:
            self.query_one("#problem", Static).update(problem)

    def action_to_list(self) -> None:
        """From the field to the list."""
        if self.paths.option_count:
            self.paths.focus()
            self.paths.highlighted = 0

    def action_cancel(self) -> None:
        """Close without a path."""
        self.dismiss(None)
