"""Asks for a file: a path that completes itself, and below it recent files and those that match."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Input, Label, OptionList, Static

from darko_gcs.tui.recent_files import short_path
from darko_gcs.tui.screens.station_screen import Dialog
from darko_gcs.tui.widgets.path_input import PathInput

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
