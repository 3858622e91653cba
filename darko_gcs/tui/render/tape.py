"""A vertical tape: a scale that moves past the value in its middle."""

from __future__ import annotations

import math

from darko_gcs.tui.render.canvas import StyledLine

ROWS_PER_NUMBER = 4  # of the scale
MAX_ON_TAPE = 1e5  # larger ones are not shown


def tape(
    value: float | None, *, title: str, per_row: float, width: int, height: int, least: float = -math.inf
) -> list[StyledLine]:
    """The rows of a tape, larger values above.

    Args:
        value: Stands in the middle row; dashes for None and NaN.
        title: In the first row.
        per_row: What a row adds to the value.
        width: Cells.
        height: Cells.
        least: Smallest value of the scale.
    """
    middle = height // 2
    at = math.nan if value is None else value
    values = [at + (middle - row) * per_row for row in range(height)]
    rows: list[StyledLine] = [[(_scale_text(v, per_row, width, least), "dim")] for v in values]
    number = f"{at + 0.0:.1f}" if abs(at) < MAX_ON_TAPE else "--"
    rows[middle] = [(f"▶{number:>{width - 2}} "[:width], "accent")]
    rows[0] = [(f"{title:>{width - 1}} "[:width], "label")]
    return rows


def _scale_text(value: float, per_row: float, width: int, least: float) -> str:
    """A number where a round one lies in the row, else a mark; nothing below the scale."""
    if not abs(value) < MAX_ON_TAPE or value < least - per_row / 2:
        return " " * width
    step = ROWS_PER_NUMBER * per_row
    nearest = round(value / step) * step
    is_number = -per_row / 2 <= nearest - value < per_row / 2
    return (f"{nearest + 0.0:g} ─" if is_number else "·").rjust(width)
