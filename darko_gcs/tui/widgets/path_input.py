"""A text field for a path: Tab completes it, the rest of the only or first match is shown behind the cursor."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path
from typing import ClassVar

from textual.binding import Binding, BindingType
from textual.suggester import Suggester
from textual.widgets import Input

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


class PathInput(Input):
    """A field for a path.

    Args:
        value: At first.
        suffixes: Of the files that are wanted; empty: any.
        id: Of the widget.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("tab", "complete", "Complete", show=False)]

    def __init__(self, value: str = "", *, suffixes: Collection[str] = (), id: str | None = None) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(value, id=id, compact=True, suggester=_PathSuggester(suffixes))
        self._suffixes = tuple(suffixes)

    @property
    def matches(self) -> list[str]:
        """Paths that begin with what is typed."""
        return path_matches(self.value, self._suffixes)

    def action_complete(self) -> None:
        """Complete as far as all matches agree; with nothing to complete, go to the next field."""
        common = os.path.commonprefix(self.matches)  # noqa: RUF071 - of characters, as they are typed
        if len(common) > len(self.value):
            self.value = common
            self.cursor_position = len(common)
        else:
            self.screen.focus_next()


class _PathSuggester(Suggester):
    """The first match."""

    def __init__(self, suffixes: Collection[str]) -> None:
        super().__init__(use_cache=False, case_sensitive=True)
        self._suffixes = tuple(suffixes)

    async def get_suggestion(self, value: str) -> str | None:
        matches = path_matches(value, self._suffixes) if value else []
        return matches[0] if matches else None
