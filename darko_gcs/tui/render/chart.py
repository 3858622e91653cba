"""Values over time: on a logarithmic axis with thresholds and marks, or on a linear one."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Collection, Sequence

from darko_gcs.tui.render.canvas import BrailleCanvas, StyledLine

Axis = Callable[[float], float]

LABEL_WIDTH = 5  # of the vertical axis [cells]
MIN_DECADE, MAX_DECADE = -6, 6
MAX_JOINED_DOTS = 8.0  # points farther apart in time are not joined by a line
MIN_VALUE = 1e-6  # smaller values are drawn as this


def log_chart(
    times: Sequence[float],
    *traces: tuple[Sequence[float], str, str],
    width: int,
    height: int,
    window: float,
    thresholds: Sequence[tuple[float, str, str]] = (),
    jumps: Sequence[tuple[float, str]] = (),
    now: float,
) -> list[StyledLine]:
    """The last ``window`` seconds up to ``now``.

    Args:
        times: Time of each value, ascending [s].
        traces: Values at these times, their style, and a letter that marks the newest of them; NaN leaves a gap. Later
            traces cover earlier ones.
        width: Cells.
        height: Cells.
        window: Time shown [s].
        thresholds: Values drawn as dashed lines, with their labels and styles.
        jumps: Times marked by a vertical line, and their names, which stand above where there is room.
        now: Time at the right edge [s].
    """
    thresholds = [threshold for threshold in thresholds if math.isfinite(threshold[0])]
    first = bisect_left(times, now - window)
    times, traces = times[first:], tuple((values[first:], style, letter) for values, style, letter in traces)
    plot_width, plot_height = max(1, width - LABEL_WIDTH), max(1, height - 1)
    seen = [v for values, _, _ in traces for t, v in zip(times, values, strict=True) if t <= now and math.isfinite(v)]
    low, high = _decades([*seen, *(v for v, _, _ in thresholds)])
    canvas = BrailleCanvas(plot_width, plot_height)
    last, edge = 2 * plot_width - 1, chart_edge(now, width, window)

    def x(t: float) -> float:
        return math.floor(t * last / window) - edge + last

    def y(v: float) -> float:
        return (high - math.log10(max(v, MIN_VALUE))) / (high - low) * (4 * plot_height - 1)

    for value, _, style in thresholds:
        for dot in range(0, 2 * plot_width, 4):
            canvas.plot(dot, y(value), style)
    shown = [(x(time), name) for time, name in jumps if now - window <= time <= now]
    for at, _ in shown:
        canvas.line((at, 0), (at, 4 * plot_height - 1), "jump")
    for values, style, letter in traces:
        points = list(zip(times, values, strict=True))
        _trace(canvas, points, x, y, style)
        _put_letter(canvas, points, x, y, (letter, style))
    labels = [(int(y(value)) // 4, label, style) for value, label, style in thresholds]
    free = _put_threshold_labels(canvas, labels)
    _put_jump_names(canvas, shown, free.get(0, (0, plot_width)))
    if not seen:
        _put_no_data(canvas, free)
    lines = [
        [(label, "dim"), *line] for label, line in zip(_labels(low, high, plot_height), canvas.lines(), strict=True)
    ]
    return [_cut(line, width) for line in (*lines, _time_axis(width, window))][:height]


def chart_edge(now: float, width: int, window: float) -> int:
    """Number of the dot at the right edge: a chart moves by whole dots, or every row would change every time.

    Args:
        now: Time there [s].
        width: Of the chart [cells].
        window: Time shown [s].
    """
    return math.ceil(now * (2 * max(1, width - LABEL_WIDTH) - 1) / window) if math.isfinite(now) else 0


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
    left, right, room = f"-{window:.0f} s", "now", max(0, width - LABEL_WIDTH)
    left = left if len(left) + 1 + len(right) <= room else ""
    right = right if len(right) <= room else ""
    return [(" " * LABEL_WIDTH + left + right.rjust(room - len(left)), "dim")]


def _put_letter(
    canvas: BrailleCanvas, points: Sequence[tuple[float, float]], x: Axis, y: Axis, letter: tuple[str, str]
) -> None:
    """A letter at the newest point, which tells the trace without its colour."""
    last = next(((t, v) for t, v in reversed(points) if math.isfinite(v)), None)
    if last is not None:
        canvas.put(min(canvas.width - 1, int(x(last[0])) // 2), int(y(last[1])) // 4, *letter)


def _put_jump_names(canvas: BrailleCanvas, jumps: Sequence[tuple[float, str]], free: tuple[int, int]) -> None:
    """Names at the top, right of their lines, if they end before the next one and within the free columns."""
    columns = [int(at) // 2 for at, _ in jumps]
    for (_, name), begin, end in zip(jumps, columns, [*columns[1:], canvas.width], strict=False):
        if begin + 1 >= free[0] and begin + 1 + len(name) <= min(end, free[1]):
            canvas.put(begin + 1, 0, name, "jump")


def _put_threshold_labels(canvas: BrailleCanvas, rows: Sequence[tuple[int, str, str]]) -> dict[int, tuple[int, int]]:
    """Labels at the right end of their lines, a second one in the same row at the left end; gives free columns there.

    What has no room is left out, but for the first label's number.
    """
    free: dict[int, tuple[int, int]] = {}
    for row, full, style in rows:
        begin, end = free.get(row, (0, canvas.width))
        if row in free:
            short = full.partition(" ")[2]  # without the law, which the first one names
            label = full if len(full) < end else short
            if begin == 0 and len(label) < end:
                canvas.put(0, row, label, style)
                free[row] = (len(label) + 1, end)
            continue
        label = full if len(full) <= end else full.rsplit(" ", 1)[-1]  # its number alone
        if len(label) <= end:
            free[row] = (0, end - len(label) - 1)
            canvas.put(end - len(label), row, label, style)
    return free


def _put_no_data(canvas: BrailleCanvas, labelled: Collection[int]) -> None:
    """Says so in the row nearest the middle that has no label."""
    text, middle = "no data", canvas.height // 2
    rows = sorted(set(range(canvas.height)) - set(labelled), key=lambda row: abs(row - middle))
    if rows:
        canvas.put(max(0, (canvas.width - len(text)) // 2), rows[0], text, "dim")


def _cut(line: StyledLine, width: int) -> StyledLine:
    cut: StyledLine = []
    for text, style in line:
        left = width - sum(len(t) for t, _ in cut)
        cut.append((text[:left], style))
    return cut


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
        _linear_trace(canvas, values, (low, high), style, letter)
    if not seen:
        canvas.put(max(0, plot_width // 2 - 6), height // 2, "no data here", "dim")
    labels = [" " * NUMBER_WIDTH] * canvas.height
    if seen:
        labels[0], labels[-1] = (_short_number(value) for value in (high, low))
    return [[(label, "dim"), *line] for label, line in zip(labels, canvas.lines(), strict=True)]


def _short_number(value: float) -> str:
    """A number at the axis, with as many digits as there is room for."""
    texts = (f"{value:.1f} ", f"{value:.0f} ", f"{value:.0e} ".replace("e+0", "e"))
    return next((text for text in texts if len(text) <= NUMBER_WIDTH), "").rjust(NUMBER_WIDTH)


def _linear_trace(
    canvas: BrailleCanvas, values: Sequence[float], ends: tuple[float, float], style: str, letter: str
) -> None:
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
