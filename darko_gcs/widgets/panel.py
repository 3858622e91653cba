"""What all panels share: draw once per change, colours from the stylesheet."""

from __future__ import annotations

from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from darko_gcs.snapshot import EMPTY, Snapshot

__all__ = ["Line", "Panel", "text_line"]

Line = list[tuple[str, str]]  # segments (text, style name)
STYLES = ("dim", "good", "warn", "bad", "accent", "mark", "track", "plan", "label")


def text_line(*segments: tuple[str, str] | str) -> Line:
    """A line from segments; plain strings have no style."""
    return [(segment, "") if isinstance(segment, str) else segment for segment in segments]


class Panel(Widget):
    """A bordered panel. Subclasses give ``draw``; equal snapshots cost nothing."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"panel--{name}" for name in STYLES}
    snapshot: reactive[Snapshot] = reactive(EMPTY)
    now: reactive[float] = reactive(0.0, repaint=False)  # for ages, which change without a snapshot

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id)
        self.border_title = title
        self._lines: list[Strip] = []
        self._drawn: tuple[object, ...] = ()

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """The panel's lines; missing cells and lines are filled, surplus ones cut.

        Raises:
            NotImplementedError: Always, here: each panel draws its own.
        """
        raise NotImplementedError

    def render_line(self, y: int) -> Strip:
        """One line of the content (Textual's line API)."""
        width, height = self.size
        key = (id(self.snapshot), width, height, self.app.theme)
        if key != self._drawn:
            self._drawn = key
            self._lines = [self._strip(line, width) for line in self.draw(self.snapshot, width, height)]
        return self._lines[y] if y < len(self._lines) else Strip.blank(width, self.rich_style)

    def _strip(self, line: Line, width: int) -> Strip:
        base = self.rich_style
        segments = [Segment(text, base + self._style(name)) for text, name in line]
        return Strip(segments).adjust_cell_length(width, base)

    def _style(self, name: str) -> Style:
        return self.get_component_rich_style(f"panel--{name}", partial=True) if name in STYLES else Style()
