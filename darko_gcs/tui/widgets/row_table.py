"""A table of texts whose columns are as wide as their longest text so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from rich.cells import cell_len
from textual.widgets import DataTable


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

    def choose_row(self, row: int) -> None:
        """Put the cursor on a row, or the last one if there are fewer."""
        if self.row_count:
            self.move_cursor(row=min(row, self.row_count - 1))

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
