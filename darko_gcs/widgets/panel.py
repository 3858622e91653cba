"""What all panels share: only rows that changed are painted, colours come from the stylesheet."""

from __future__ import annotations

from typing import ClassVar

from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region, Size
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from darko_gcs.snapshot import EMPTY, Snapshot

__all__ = ["Line", "Panel", "text_line"]

Line = list[tuple[str, str]]  # segments (text, style name)
STYLES = ("dim", "good", "warn", "bad", "accent", "mark", "track", "plan", "fence", "label")


def text_line(*segments: tuple[str, str] | str) -> Line:
    """A line from segments; plain strings have no style, empty ones are left out."""
    line = [(segment, "") if isinstance(segment, str) else segment for segment in segments]
    return [segment for segment in line if segment[0]]


class Panel(Widget):
    """A bordered panel. Subclasses give ``draw``, which is pure; what it draws the same again is not painted."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"panel--{name}" for name in STYLES}
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)  # repainting is decided row by row
    now: reactive[float] = reactive(0.0, repaint=False)  # for ages, which change without a snapshot

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id)
        self.border_title = title
        self._lines: list[Line] = []
        self._drawn_for = Size(0, 0)
        self._named_styles: dict[str, Style] = {}

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:
        """The panel's lines; missing cells and lines are filled, surplus ones cut.

        Raises:
            NotImplementedError: Always, here: each panel draws its own.
        """
        raise NotImplementedError

    def watch_snapshot(self) -> None:
        """Follow the vehicle."""
        self.redraw()

    def on_resize(self) -> None:
        """Follow the screen, also where no snapshot comes: a title may count pages."""
        self.redraw()

    def redraw(self) -> None:
        """Draw again and ask for the rows that differ to be painted."""
        size = self.size
        if not size or not self.is_mounted:
            return
        old = self._lines if size == self._drawn_for else []
        self._lines, self._drawn_for = self.draw(self.snapshot, *size), size
        changed = [y for y in range(size.height) if _row(old, y) != _row(self._lines, y)] if old else range(size.height)
        regions = [Region(0, y, size.width, 1) for y in changed]
        if regions:
            self.refresh(*regions)

    def render_line(self, y: int) -> Strip:
        """One line of the content (Textual's line API)."""
        width, height = self.size
        if self._drawn_for != self.size:
            self._lines, self._drawn_for = self.draw(self.snapshot, width, height), self.size
        base = self._style("")
        segments = [Segment(text, self._style(name)) for text, name in _row(self._lines, y)]
        return Strip(segments).adjust_cell_length(width, base)

    def notify_style_update(self) -> None:
        """Colours changed: look them up again."""
        self._named_styles = {}
        super().notify_style_update()

    def _style(self, name: str) -> Style:
        # Looking a style up costs more than drawing the line.
        found = self._named_styles.get(name)
        if found is None:
            found = self.rich_style
            if name in STYLES:
                found += self.get_component_rich_style(f"panel--{name}", partial=True)
            self._named_styles[name] = found
        return found


def _row(lines: list[Line], y: int) -> Line:
    return lines[y] if y < len(lines) else []
