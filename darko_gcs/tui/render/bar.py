"""Horizontal bars in eighths of a cell."""

from __future__ import annotations

import math

from darko_gcs.tui.render.canvas import StyledLine

EIGHTH_BLOCKS = " ▏▎▍▌▋▊▉█"
COMMAND_MARK = "│"


def bar(
    value: float | None,
    low: float,
    high: float,
    *,
    width: int,
    command: float | None = None,
    saturated: bool = False,
    centre: float | None = None,
) -> StyledLine:
    """A value between its limits, filled from ``low`` or from ``centre``.

    Args:
        value: None or NaN gives dashes.
        low: At the left edge.
        high: At the right edge.
        width: Cells.
        command: Shown by a mark.
        saturated: Use the style "bad".
        centre: Where the bar begins, for values of both signs.
    """
    if value is None or not math.isfinite(value) or not high > low:
        return [("-" * width, "dim")]
    end = _share(value, low, high)
    begin = 0.0 if centre is None else _share(centre, low, high)
    cells = _fill(min(end, begin) * width, max(end, begin) * width, width)
    style = "bad" if saturated else "track"
    if command is None or not math.isfinite(command):
        return [("".join(cells), style)]
    mark = min(width - 1, int(_share(command, low, high) * width))
    return [("".join(cells[:mark]), style), (COMMAND_MARK, "accent"), ("".join(cells[mark + 1 :]), style)]


def _share(value: float, low: float, high: float) -> float:
    return min(max((value - low) / (high - low), 0.0), 1.0)


def _fill(begin: float, end: float, width: int) -> list[str]:
    cells = []
    for cell in range(width):
        filled = max(0.0, min(end, cell + 1.0) - max(begin, float(cell)))
        if begin > cell and filled > 0.0:  # blocks fill from the left: the left end of a bar is a whole or half cell
            cells.append("▐" if filled < 0.75 else "█")
        else:
            cells.append(EIGHTH_BLOCKS[round(8 * filled)])
    return cells
