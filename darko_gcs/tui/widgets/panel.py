"""Base of all panels: paints only rows that changed, takes its colours from the stylesheet. The panel of messages."""

from __future__ import annotations

import math
from collections.abc import Iterable
from itertools import zip_longest
from textwrap import wrap
from typing import ClassVar, Self

from rich.cells import cell_len
from rich.segment import Segment
from rich.style import Style
from textual.geometry import Region, Size, Spacing
from textual.reactive import reactive
from textual.strip import Strip
from textual.widget import Widget

from darko_gcs.state.message_log import without_bare_answers
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import format_age
from darko_gcs.tui.containment import ContainingPump, error_words, is_contained
from darko_gcs.tui.render.canvas import StyledLine

MAX_FRESH_AGE = 2.0  # of a value that needs no age beside it [s]

PANEL_STYLES = (  # component classes of the app, "panel--" before each
    "dim", "label", "good", "warn", "bad", "accent", "mark", "track", "plan", "now", "fence", "hover", "forward",
    "cursor", "jump", "sky", "ground", "ground-on-sky", "sky-on-ground", "symbol-on-sky", "symbol-on-ground",
)  # fmt: skip


def styled_line(*segments: tuple[str, str] | str) -> StyledLine:
    """A line from segments; plain strings have no style, empty ones are left out."""
    line = [(segment, "") if isinstance(segment, str) else segment for segment in segments]
    return [segment for segment in line if segment[0]]


class Panel(ContainingPump, Widget):
    """A bordered panel. Subclasses define ``draw``, a pure function; rows that stay the same are not painted again."""

    SOURCES: ClassVar[tuple[str, ...]] = ()  # messages that fill it; when all have stopped, the border says so
    FRAMES: ClassVar[int] = 1  # of the flight screen from one drawing to the next: nobody reads ten numbers a second
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # ``redraw`` repaints row by row
    now: reactive[float] = reactive(0.0, repaint=False)  # for ages, which change without a new snapshot

    def __init__(self, title: str, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id)
        self.border_title = title
        self._lines: list[StyledLine] = []
        self._drawn_size = Size(0, 0)
        self._rich_styles: dict[str, Style] = {}
        self._strips: list[Strip] = []  # all rows as painted, with borders; empty: paint everything
        self._edges: tuple[list[Segment], list[Segment]] = ([], [])  # what stands left and right of each row
        self._gutter: Spacing | None = None  # of borders and padding; None: look it up
        self._changed: set[int] = set()  # rows whose strips are old
        self._older_at = math.inf  # when an age in the panel changes [s]
        self._is_behind = False  # what is drawn is of an older snapshot

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The panel's lines; missing cells and lines are filled, surplus ones cut.

        Raises:
            NotImplementedError: Always, here: each panel draws its own.
        """
        raise NotImplementedError

    def show_snapshot(self, s: Snapshot, now: float, *, is_due: bool = True) -> None:
        """Take a snapshot at a time [s], without the cost of two reactive values for each panel and frame.

        Args:
            s: The snapshot.
            now: The time.
            is_due: Whether it is drawn in this frame.
        """
        self._is_behind = self._is_behind or s is not self.snapshot
        self.set_reactive(Panel.snapshot, s)
        self.set_reactive(Panel.now, now)
        if not is_due:
            return
        if self._is_behind:
            self._is_behind = False
            self.watch_snapshot()
        else:
            self.watch_now()

    def watch_snapshot(self) -> None:
        """Show a new snapshot; say so if it is old."""
        self._tell()
        self.redraw()

    def watch_now(self) -> None:
        """Say how old the values are, also without a new snapshot."""
        self._tell()
        if self.now >= self._older_at:
            self.redraw()

    def _tell(self) -> None:
        told = self.subtitle(self.snapshot)
        if self.border_subtitle != told:
            self.border_subtitle = told

    def subtitle(self, s: Snapshot) -> str:
        """Text of the lower border: that the values are old, because the vehicle or this message of it is silent."""
        if s.link.lost:
            return "old: link lost"
        old = self.age_text(s, *self.SOURCES)
        return f"stopped: {old}" if old else ""

    def age_text(self, s: Snapshot, *kinds: str) -> str:
        """Age of the newest message of some kinds, in words; empty while it is fresh, and if there never was one."""
        age = s.link.silence(self.now, kinds)
        if age is None:
            return ""
        self._older_at = min(self._older_at, self.now + (MAX_FRESH_AGE - age if age < MAX_FRESH_AGE else 1.0))
        return "" if age < MAX_FRESH_AGE else f"{format_age(age)} old"

    def on_resize(self) -> None:
        """Redraw in the new size, also without a new snapshot: a title may count pages."""
        self.redraw()

    def redraw(self) -> None:
        """Draw again and repaint the rows that changed."""
        size = self.size
        if not size or not self.is_mounted:
            return
        old = self._lines if size == self._drawn_size else []
        self._older_at = math.inf
        self._lines, self._drawn_size = self._drawn(size), size
        changed = _differing(old[: size.height], self._lines[: size.height]) if old else range(size.height)
        if changed:
            self._changed.update(changed)
            self.refresh(*(Region(0, y, size.width, 1) for y in changed))

    def _drawn(self, size: Size) -> list[StyledLine]:
        """Drawn lines for a size; an error of the drawing in their place."""
        if not size:
            return []
        try:
            return self.draw(self.snapshot, *size)
        except Exception as error:
            if not is_contained(self.app, error, f"panel {self.border_title or self.id}", is_drawing=True):
                raise
            return [styled_line((part, "bad")) for part in wrap(f"Not drawn: {error_words(error)}", max(size.width, 8))]

    def refresh(self, *regions: Region, repaint: bool = True, layout: bool = False, recompose: bool = False) -> Self:
        """Repaint some regions; without any, everything, because colours, borders or titles may have changed."""
        if repaint and not regions:
            self._forget()
        return super().refresh(*regions, repaint=repaint, layout=layout, recompose=recompose)

    def render_lines(self, crop: Region) -> list[Strip]:
        """The lines of a region, drawn in the present size.

        Textual would look up borders, filters and colours for each of them; here rows that stay the same are kept, and
        those that changed get the edges of the others.
        """
        size, whole = self.size, self.outer_size.region
        if not whole:
            return []
        if self._drawn_size != size:
            self._lines, self._drawn_size = self._drawn(size), size
            self._forget()
        gutter = self._known_gutter()
        if len(self._strips) != whole.height or self._strips[0].cell_length != whole.width:
            self._strips, self._changed = super().render_lines(whole), set()
            row = self._strips[min(gutter.top, whole.height - 1)]
            self._edges = (list(row.crop(0, gutter.left)), list(row.crop(whole.width - gutter.right)))
        left, right = self._edges
        for y in self._changed:
            self._strips[gutter.top + y] = Strip([*left, *self._segments(y), *right], whole.width)
        self._changed.clear()
        if crop == whole:
            return self._strips
        return [strip.crop(crop.x, crop.right) for strip in self._strips[crop.y : crop.bottom]]

    def render_line(self, y: int) -> Strip:
        """One line of the content (Textual's line API)."""
        return Strip(self._segments(y), self._drawn_size.width)

    def _segments(self, y: int) -> list[Segment]:
        """A line of the content, filled or cut to its width."""
        width, style = self._drawn_size.width, self._rich_style
        segments = [Segment(text, style(name)) for text, name in _row(self._lines, y)]
        surplus = sum(cell_len(text) for text, _, _ in segments) - width
        if surplus < 0:
            segments.append(Segment(" " * -surplus, style("")))
        return segments if surplus <= 0 else list(Strip(segments).crop(0, width))

    def notify_style_update(self) -> None:
        """Forget the styles that were looked up: colours changed."""
        self._forget()
        super().notify_style_update()

    def _forget(self) -> None:
        self._rich_styles, self._strips, self._gutter = {}, [], None

    def _known_gutter(self) -> Spacing:
        if self._gutter is None:
            self._gutter = self.gutter
        return self._gutter

    def _rich_style(self, name: str) -> Style:
        # Cached: looking a style up costs more than drawing the line.
        style = self._rich_styles.get(name)
        if style is None:
            style = self.rich_style
            if name in PANEL_STYLES:
                style += self.app.get_component_styles(f"panel--{name}").partial_rich_style
            for line_filter in self.get_line_filters():
                style = line_filter.apply([Segment("", style)], self.background_colors[1])[0].style or style
            self._rich_styles[name] = style
        return style


def _differing(old: list[StyledLine], new: list[StyledLine]) -> list[int]:
    """Rows that are not equal; those that one of them lacks are empty."""
    pairs: Iterable[tuple[int, tuple[StyledLine, StyledLine]]] = enumerate(zip_longest(old, new, fillvalue=[]))
    return [y for y, (before, after) in pairs if before is not after and before != after]


def _row(lines: list[StyledLine], y: int) -> StyledLine:
    return lines[y] if y < len(lines) else []


def table_number(value: float | None, digits: int, width: int) -> str:
    """A number of fixed width; dashes for None, NaN and infinity.

    Args:
        value: The number.
        digits: After the point.
        width: Cells.
    """
    if value is None or not math.isfinite(value):
        return "--".rjust(width)
    return f"{round(value, digits) + 0.0:{width}.{digits}f}"  # + 0.0 turns -0.0 into 0.0


SEVERITY_STYLES = ("bad", "bad", "bad", "bad", "warn", "accent", "", "dim")  # by MAV_SEVERITY
MIN_WRAP_WIDTH = 8  # [cells]


def severity_style(severity: int) -> str:
    """Style of a MAV_SEVERITY; a number above debug (7) has that of debug."""
    return SEVERITY_STYLES[min(severity, len(SEVERITY_STYLES) - 1)]


class MessagePanel(Panel):
    """The newest lines of the message log, newest last."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """As many lines as fit; long ones take several rows, and the newest one is shown from its beginning."""
        rows: list[StyledLine] = []
        newest: list[StyledLine] = []
        for line in without_bare_answers(s.log.lines[-2 * height :])[-height:]:
            room = max(width, MIN_WRAP_WIDTH)
            parts = wrap(line.text, room, subsequent_indent="  ", break_on_hyphens=False) or [""]
            newest = [styled_line((part, severity_style(line.severity))) for part in parts]
            rows += newest
        return newest[:height] if len(newest) > height else rows[-height:]
