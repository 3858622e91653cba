"""Rows under a heading: a list of any length with a cursor, and a table as wide as its texts.

Textual's DataTable measures its columns after a change; drawn before, it keeps the cells as it cut them then.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from rich.cells import cell_len
from textual import events
from textual.message import Message
from textual.widgets import DataTable

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel

WHEEL_ROWS = 3

DrawRow = Callable[[str, int], StyledLine]  # of a key, in so many cells


class RowList(Panel):
    """The list; ``Moved`` tells that another row is under the cursor.

    Args:
        heading: The first line, in so many cells.
        draw_row: The line of a row.
        id: Of the widget.
    """

    class Moved(Message):
        """Another row is under the cursor."""

    def __init__(self, heading: Callable[[int], StyledLine], draw_row: DrawRow, *, id: str) -> None:  # noqa: A002
        super().__init__("", id=id)
        self._heading, self._draw_row = heading, draw_row
        self.keys: tuple[str, ...] = ()
        self.cursor = 0
        self._first = 0  # row that is seen first
        self._is_moved = False  # by the operator; until then the cursor stays on the first row

    @property
    def key(self) -> str | None:
        """The key of the row under the cursor."""
        return self.keys[self.cursor] if self.keys else None

    def show(self, keys: Sequence[str]) -> None:
        """Show these rows; the cursor stays with the row that it was moved to, if that is still there."""
        before = self.key if self._is_moved else None
        self.keys = tuple(keys)
        if before in self.keys:
            self.cursor = self.keys.index(before)
        else:
            self.cursor = 0
            self.post_message(self.Moved())
        self.redraw()

    def move(self, rows: int) -> None:
        """Move the cursor."""
        self.move_to(self.cursor + rows)

    def move_to(self, row: int) -> None:
        """Put the cursor on a row, or the nearest there is."""
        self._is_moved = True
        wanted = max(0, min(row, len(self.keys) - 1))
        if wanted != self.cursor:
            self.cursor = wanted
            self.redraw()
            self.post_message(self.Moved())

    def move_page(self, pages: int) -> None:
        """Move the cursor by as many rows as are seen."""
        self.move(pages * max(1, self.size.height - 2))

    def draw(self, _s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The heading, and the rows about the cursor."""
        seen = max(1, height - 1)
        last_first = max(0, len(self.keys) - seen)
        self._first = min(max(min(self._first, self.cursor), self.cursor - seen + 1), last_first)
        lines = [self._heading(width)]
        for row in range(self._first, min(self._first + seen, len(self.keys))):
            line = self._draw_row(self.keys[row], width)
            lines.append([(text, "cursor") for text, _ in line] if row == self.cursor else line)
        return lines

    def on_click(self, event: events.Click) -> None:
        """Put the cursor on the row that was clicked."""
        row = self._first + event.y - 1
        if event.y > 0 and row < len(self.keys):
            self.move_to(row)

    def on_mouse_scroll_down(self) -> None:
        """The wheel moves the cursor."""
        self.move(WHEEL_ROWS)

    def on_mouse_scroll_up(self) -> None:
        """The wheel moves the cursor."""
        self.move(-WHEEL_ROWS)


def padded(text: str, width: int) -> str:
    """A text in exactly so many cells; a longer one ends in an ellipsis."""
    return f"{text:<{width}}" if len(text) <= width else text[: max(0, width - 1)] + "…"


class RowTable(DataTable[str]):
    """Rows by key, brought up to date cell by cell; the cursor keeps its row.

    The columns get their widths from here: Textual measures them after a change, and a table that is drawn before keeps
    the cells as it cut them then.

    Args:
        names: Of the columns.
        id: Of the widget.
        padding: On both sides of a cell [cells].
    """

    def __init__(self, names: Sequence[str], *, id: str, padding: int = 1) -> None:  # noqa: A002 - textual's own name
        super().__init__(id=id, cursor_type="row", zebra_stripes=True, cell_padding=padding)
        self._names = names
        self._widths: list[int] = []
        self.texts: Mapping[str, tuple[str, ...]] = {}

    def show_rows(self, rows: Mapping[str, tuple[str, ...]]) -> None:
        """Show these rows, in this order."""
        wide = self._widths or [cell_len(name) for name in self._names]
        texts = zip(*rows.values(), strict=True) if rows else ([] for _ in wide)
        widths = [max([width, *map(cell_len, column)]) for width, column in zip(wide, texts, strict=True)]
        if widths != self._widths or list(rows) != list(self.texts):
            self._widths = widths
            self._build(rows)
        else:
            self._update(rows)
        self.texts = rows

    def use_names(self, names: Sequence[str]) -> None:
        """Have other columns, without a row yet."""
        if names != self._names:
            self._names, self._widths, self.texts = names, [], {}
            self.clear(columns=True)

    def choose_row(self, row: int) -> None:
        """Put the cursor on a row, or the last one if there are fewer."""
        if self.row_count:
            self.move_cursor(row=min(row, self.row_count - 1))

    def action_scroll_home(self) -> None:
        """To the first row: the cursor is a whole row."""
        self.action_scroll_top()

    def action_scroll_end(self) -> None:
        """To the last row."""
        self.action_scroll_bottom()

    def _build(self, rows: Mapping[str, tuple[str, ...]]) -> None:
        row = self.cursor_row
        self.clear(columns=True)
        for name, width in zip(self._names, self._widths, strict=True):
            self.add_column(name, width=width, key=name)
        for key, cells in rows.items():
            self.add_row(*cells, key=key)
        self.choose_row(row)

    def _update(self, rows: Mapping[str, tuple[str, ...]]) -> None:
        for key, cells in rows.items():
            for name, before, cell in zip(self._names, self.texts[key], cells, strict=True):
                if before != cell:
                    self.update_cell(key, name, cell)
