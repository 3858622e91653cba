"""Values over time on a linear axis."""

from __future__ import annotations

import math
from collections.abc import Sequence

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine

NUMBER_WIDTH = 6  # of the vertical axis [cells]
MIN_RANGE = 1.0  # of the vertical axis


def line_chart(*traces: tuple[Sequence[float], str, str], width: int, height: int) -> list[StyledLine]:
    """Traces from the left edge to the right one.

    Args:
        traces: Values at equal steps of time, their style, and a letter that marks the newest of them; NaN leaves a
            gap. Later traces cover earlier ones.
        width: Cells.
        height: Cells.
    """
    seen = [value for values, _, _ in traces for value in values if math.isfinite(value)]
    low, high = (min(seen), max(seen)) if seen else (0.0, 0.0)
    middle, half = (low + high) / 2, max(high - low, MIN_RANGE) / 2
    low, high = middle - half, middle + half
    plot_width = max(1, width - NUMBER_WIDTH)
    canvas = BrailleCanvas(plot_width, max(1, height))
    for values, style, letter in traces:
        _trace(canvas, values, (low, high), style, letter)
    if not seen:
        canvas.put(max(0, plot_width // 2 - 6), height // 2, "no data here", "dim")
    labels = [" " * NUMBER_WIDTH] * canvas.height
    if seen:
        labels[0], labels[-1] = (f"{value:.1f} ".rjust(NUMBER_WIDTH)[:NUMBER_WIDTH] for value in (high, low))
    return [[(label, "dim"), *line] for label, line in zip(labels, canvas.lines(), strict=True)]


def _trace(canvas: BrailleCanvas, values: Sequence[float], ends: tuple[float, float], style: str, letter: str) -> None:
    low, high = ends
    previous: tuple[float, float] | None = None
    for number, value in enumerate(values):
        if not math.isfinite(value):
            previous = None
            continue
        x = number / max(1, len(values) - 1) * (2 * canvas.width - 1)
        point = (x, (high - value) / (high - low) * (4 * canvas.height - 1))
        if previous is None:
            canvas.plot(*point, style)
        else:
            canvas.line(previous, point, style)
        previous = point
    if previous is not None:
        canvas.put(min(canvas.width - 1, int(previous[0]) // 2), int(previous[1]) // 4, letter, style)
