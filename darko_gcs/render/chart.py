"""A value over time on a logarithmic axis, with thresholds and marks."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

from darko_gcs.render.canvas import Braille, Line

__all__ = ["log_chart"]

Axis = Callable[[float], float]

LABELS = 5  # cells at the left
LOWEST, HIGHEST = -6, 6  # decades
SHOWN = 1e-6  # smaller values are drawn here


def log_chart(
    times: Sequence[float],
    *traces: tuple[Sequence[float], str],
    width: int,
    height: int,
    window: float,
    thresholds: Sequence[tuple[float, str]] = (),
    jumps: Sequence[tuple[float, str]] = (),
    now: float,
) -> list[Line]:
    """The last ``window`` seconds up to ``now``.

    Args:
        times: Time of each value, ascending [s].
        traces: Values at these times and their style; NaN leaves a gap. Later ones lie over earlier ones.
        width: Cells.
        height: Cells.
        window: Time shown [s].
        thresholds: Values drawn as dashed lines, with their words.
        jumps: Times marked by a vertical line.
        now: Time at the right edge [s].
    """
    thresholds = [(value, words) for value, words in thresholds if math.isfinite(value)]
    plot_width, plot_height = max(1, width - LABELS), max(1, height - 1)
    seen = [
        v
        for values, _ in traces
        for t, v in zip(times, values, strict=True)
        if now - window <= t <= now and math.isfinite(v)
    ]
    low, high = _decades([*seen, *(v for v, _ in thresholds)])
    canvas = Braille(plot_width, plot_height)

    def x(t: float) -> float:
        return (t - now + window) / window * (2 * plot_width - 1)

    def y(v: float) -> float:
        return (high - math.log10(max(v, SHOWN))) / (high - low) * (4 * plot_height - 1)

    for value, _ in thresholds:
        for dot in range(0, 2 * plot_width, 4):
            canvas.plot(dot, y(value), "warn")
    for time, _ in jumps:
        if now - window <= time <= now:
            canvas.line(x(time), 0, x(time), 4 * plot_height - 1, "mark")
    for values, style in traces:
        _trace(canvas, [(t, v) for t, v in zip(times, values, strict=True) if t >= now - window], x, y, style)
    _threshold_words(canvas, [(int(y(value)) // 4, words) for value, words in thresholds])
    if not seen:
        canvas.put(max(0, plot_width // 2 - 6), plot_height // 2, "no data yet", "dim")
    lines = [
        [(label, "dim"), *line] for label, line in zip(_labels(low, high, plot_height), canvas.lines(), strict=True)
    ]
    return [_cut(line, width) for line in (*lines, _time_axis(width, window))][:height]


def _decades(values: Sequence[float]) -> tuple[int, int]:
    """The decades that hold all values, at least two."""
    logs = [math.log10(max(v, SHOWN)) for v in values if math.isfinite(v)] or [0.0]
    low = max(LOWEST, math.floor(min(logs) - 0.01))
    high = min(HIGHEST, math.ceil(max(logs) + 0.01))
    low = max(low, high - 6)
    return min(low, high - 2), high


def _labels(low: int, high: int, rows: int) -> list[str]:
    labels = [" " * LABELS] * rows
    for decade in range(high, low - 1, -1):
        row = int((high - decade) / (high - low) * (4 * rows - 1)) // 4
        words = f"1e{decade}" if abs(decade) > 2 else f"{10.0**decade:g}"
        if not labels[row].strip():
            labels[row] = words.rjust(LABELS - 1) + " "
    return labels


def _trace(canvas: Braille, points: Sequence[tuple[float, float]], x: Axis, y: Axis, style: str) -> None:
    previous: tuple[float, float] | None = None
    for t, v in points:
        if not math.isfinite(v):
            previous = None
            continue
        point = (x(t), y(v))
        if previous is None or point[0] - previous[0] > 8.0:
            canvas.plot(*point, style)
        else:
            canvas.line(*previous, *point, style)
        previous = point


def _time_axis(width: int, window: float) -> Line:
    left, right = f"-{window:.0f} s", "now"
    return [(" " * LABELS + left + right.rjust(max(0, width - LABELS - len(left))), "dim")]


def _threshold_words(canvas: Braille, rows: Sequence[tuple[int, str]]) -> None:
    """Words at the right of each line; those of lines in one row stand side by side."""
    taken: dict[int, int] = {}
    for row, words in rows:
        end = taken.get(row, canvas.width)
        taken[row] = end - len(words) - 1
        canvas.put(max(0, end - len(words)), row, words, "warn")


def _cut(line: Line, width: int) -> Line:
    cut: Line = []
    for text, style in line:
        left = width - sum(len(t) for t, _ in cut)
        cut.append((text[:left], style))
    return cut
