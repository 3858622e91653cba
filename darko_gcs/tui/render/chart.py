"""Values over time on a logarithmic axis, with thresholds and marks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine

__all__ = ["log_chart"]

Axis = Callable[[float], float]

LABEL_WIDTH = 5  # of the vertical axis [cells]
MIN_DECADE, MAX_DECADE = -6, 6
MAX_JOINED_DOTS = 8.0  # points farther apart in time are not joined by a line
MIN_VALUE = 1e-6  # smaller values are drawn as this


def log_chart(
    times: Sequence[float],
    *traces: tuple[Sequence[float], str],
    width: int,
    height: int,
    window: float,
    thresholds: Sequence[tuple[float, str]] = (),
    jumps: Sequence[tuple[float, str]] = (),
    now: float,
) -> list[StyledLine]:
    """The last ``window`` seconds up to ``now``.

    Args:
        times: Time of each value, ascending [s].
        traces: Values at these times, and their style; NaN leaves a gap. Later traces cover earlier ones.
        width: Cells.
        height: Cells.
        window: Time shown [s].
        thresholds: Values drawn as dashed lines, with their labels.
        jumps: Times marked by a vertical line.
        now: Time at the right edge [s].
    """
    thresholds = [(value, label) for value, label in thresholds if math.isfinite(value)]
    plot_width, plot_height = max(1, width - LABEL_WIDTH), max(1, height - 1)
    seen = [
        v
        for values, _ in traces
        for t, v in zip(times, values, strict=True)
        if now - window <= t <= now and math.isfinite(v)
    ]
    low, high = _decades([*seen, *(v for v, _ in thresholds)])
    canvas = BrailleCanvas(plot_width, plot_height)

    def x(t: float) -> float:
        return (t - now + window) / window * (2 * plot_width - 1)

    def y(v: float) -> float:
        return (high - math.log10(max(v, MIN_VALUE))) / (high - low) * (4 * plot_height - 1)

    for value, _ in thresholds:
        for dot in range(0, 2 * plot_width, 4):
            canvas.plot(dot, y(value), "warn")
    for time, _ in jumps:
        if now - window <= time <= now:
            canvas.line((x(time), 0), (x(time), 4 * plot_height - 1), "mark")
    for values, style in traces:
        _trace(canvas, [(t, v) for t, v in zip(times, values, strict=True) if t >= now - window], x, y, style)
    _put_threshold_labels(canvas, [(int(y(value)) // 4, label) for value, label in thresholds])
    if not seen:
        canvas.put(max(0, plot_width // 2 - 6), plot_height // 2, "no data yet", "dim")
    lines = [
        [(label, "dim"), *line] for label, line in zip(_labels(low, high, plot_height), canvas.lines(), strict=True)
    ]
    return [_cut(line, width) for line in (*lines, _time_axis(width, window))][:height]


def _decades(values: Sequence[float]) -> tuple[int, int]:
    """First and last decade of a range that holds all values; at least two decades."""
    logs = [math.log10(max(v, MIN_VALUE)) for v in values if math.isfinite(v)] or [0.0]
    low = max(MIN_DECADE, math.floor(min(logs) - 0.01))
    high = min(MAX_DECADE, math.ceil(max(logs) + 0.01))
    low = max(low, high - 6)
    return min(low, high - 2), high


def _labels(low: int, high: int, rows: int) -> list[str]:
    labels = [" " * LABEL_WIDTH] * rows
    for decade in range(high, low - 1, -1):
        row = int((high - decade) / (high - low) * (4 * rows - 1)) // 4
        text = f"1e{decade}" if abs(decade) > 2 else f"{10.0**decade:g}"
        if not labels[row].strip():
            labels[row] = text.rjust(LABEL_WIDTH - 1) + " "
    return labels


def _trace(canvas: BrailleCanvas, points: Sequence[tuple[float, float]], x: Axis, y: Axis, style: str) -> None:
    previous: tuple[float, float] | None = None
    for t, v in points:
        if not math.isfinite(v):
            previous = None
            continue
        point = (x(t), y(v))
        if previous is None or point[0] - previous[0] > MAX_JOINED_DOTS:
            canvas.plot(*point, style)
        else:
            canvas.line(previous, point, style)
        previous = point


def _time_axis(width: int, window: float) -> StyledLine:
    left, right = f"-{window:.0f} s", "now"
    return [(" " * LABEL_WIDTH + left + right.rjust(max(0, width - LABEL_WIDTH - len(left))), "dim")]


def _put_threshold_labels(canvas: BrailleCanvas, rows: Sequence[tuple[int, str]]) -> None:
    """Labels at the right end of their lines; labels in one row stand side by side."""
    free: dict[int, int] = {}  # columns up to which a row is free
    for row, label in rows:
        end = free.get(row, canvas.width)
        free[row] = end - len(label) - 1
        canvas.put(max(0, end - len(label)), row, label, "warn")


def _cut(line: StyledLine, width: int) -> StyledLine:
    cut: StyledLine = []
    for text, style in line:
        left = width - sum(len(t) for t, _ in cut)
        cut.append((text[:left], style))
    return cut
