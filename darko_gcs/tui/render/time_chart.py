"""A chart of many curves over time, an axis for each unit, drawn as arrays: fifty curves at once.

Charts move by whole cells, so that a curve that stands still keeps its characters.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from darko_gcs.tui.render.canvas import DOT_BITS, FIRST_BRAILLE, StyledLine

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

AXIS_WIDTH = 9  # of the numbers of a vertical axis, with a blank [cells]
ROWS_A_TICK = 4  # fewest rows between two numbers of an axis
ROUND_STEPS = (1.0, 2.0, 5.0, 10.0)  # between numbers of an axis, times a power of ten
GRAINS = 5  # of a step: an axis ends at a multiple of one, and seldom changes its ends
TIME_CELLS = 12  # fewest cells between two times
TIME_STEPS = (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 30, 60, 120, 300, 600, 1200, 1800, 3600, 7200, 14400, 43200, 86400)
BLANK, MARK_LINE, CURSOR_LINE = ord(" "), ord("┊"), ord("│")
NO_TIMES = np.zeros(0)
_BITS = np.array(DOT_BITS, dtype=np.uint32)  # shape (4, 2)


@dataclass(frozen=True, kw_only=True)
class Trace:
    """A curve.

    Attributes:
        times: Ascending [s], shape (n,).
        values: Shape (n,); NaN where there is none.
        unit: Traces of one unit share an axis.
        style: Of its dots.
        letter: At its newest point: no colour is the only sign.
        longest_step: Time between two values from which on they are not joined [s].
    """

    times: Floats
    values: Floats
    unit: str
    style: str
    letter: str
    longest_step: float = math.inf


@dataclass(frozen=True, kw_only=True)
class TimeSpan:
    """The columns of dots of a chart.

    Attributes:
        first: Number of the first column: times are counted in columns.
        columns: How many.
        width: Time that one takes [s].
    """

    first: int
    columns: int
    width: float

    @classmethod
    def until(cls, end: float, window: float, cells: int) -> TimeSpan:
        """The span of a window that ends at a time [s], in so many cells."""
        columns = 2 * max(1, cells)
        width = max(window, 1e-3) / columns
        return cls(
            first=2 * math.floor(end / width / 2.0) - columns + 2 if math.isfinite(end) else 0,
            columns=columns,
            width=width,
        )

    @property
    def centres(self) -> Floats:
        """Times in the middles of the columns [s]."""
        columns = np.arange(self.columns, dtype=np.float64)
        return (self.first + columns + 0.5) * self.width

    @property
    def begin(self) -> float:
        """Its first time [s]."""
        return self.first * self.width

    @property
    def end(self) -> float:
        """Its last time [s]."""
        return (self.first + self.columns) * self.width

    def cell(self, time: float) -> int:
        """The cell of a time [s]."""
        return (math.floor(time / self.width) - self.first) // 2


class Sampling:
    """Places of values at some times in the columns of a span: the same for all curves of one kind of message.

    Args:
        span: The columns.
        times: Ascending [s], shape (n,).
        longest: Time between two values from which on they are not joined [s].
        lost: Times of values that lack, which part the line as a gap does [s].
    """

    def __init__(self, span: TimeSpan, times: Floats, longest: float, lost: Floats = NO_TIMES) -> None:
        self._columns, self._is_empty = span.columns, not len(times)
        if self._is_empty:
            return
        column = np.floor(times / span.width).astype(np.int64) - span.first
        inside = np.flatnonzero((column >= 0) & (column < span.columns))
        self._inside = slice(int(inside[0]), int(inside[-1]) + 1) if len(inside) else slice(0, 0)
        column = column[self._inside]
        self._starts = np.flatnonzero(np.diff(column, prepend=-1))
        self._at = column[self._starts]
        centres = span.centres
        after = np.searchsorted(times, centres)
        right = np.clip(after, min(1, len(times) - 1), len(times) - 1)
        left = np.maximum(right - 1, 0)
        step = times[right] - times[left]
        self._left, self._right = left, right
        self._share = (centres - times[left]) / np.where(step > 0.0, step, 1.0)
        self._unknown = (centres < times[0]) | (centres > times[-1]) | (step > longest)
        if len(lost):
            self._unknown |= np.searchsorted(lost, times[right]) > np.searchsorted(lost, times[left])

    def covered(self, values: Floats) -> tuple[Floats, Floats]:
        """The least and the greatest value in each column, of shape (columns,), lines between values included.

        Args:
            values: At these times, none of them NaN.
        """
        if self._is_empty:
            return np.full(self._columns, np.nan), np.full(self._columns, np.nan)
        before = values[self._left]
        line = before + (values[self._right] - before) * self._share
        line[self._unknown] = math.nan
        values, at, starts = values[self._inside], self._at, self._starts
        line[at] = np.where(np.isnan(line[at]), values[starts], line[at])  # before a gap's middle, or the first value
        middle = (line[1:] + line[:-1]) / 2.0
        low, high = line.copy(), line
        np.fmin(low[1:], middle, out=low[1:])
        np.fmin(low[:-1], middle, out=low[:-1])
        np.fmax(high[1:], middle, out=high[1:])
        np.fmax(high[:-1], middle, out=high[:-1])
        if len(at):
            low[at] = np.fmin(low[at], np.minimum.reduceat(values, starts))
            high[at] = np.fmax(high[at], np.maximum.reduceat(values, starts))
        return low, high


def covered(trace: Trace, span: TimeSpan, known: dict[object, Sampling] | None = None) -> tuple[Floats, Floats]:
    """The least and the greatest value of a trace in each column, lines between values included; NaN without any.

    Args:
        trace: The curve.
        span: The columns.
        known: Where values of other curves lie, by their times; it is added to.

    Returns:
        Both of shape (columns,); neighbours touch.
    """
    first = max(0, int(np.searchsorted(trace.times, span.begin)) - 1)
    last = int(np.searchsorted(trace.times, span.end, side="right")) + 1
    times, values, longest = trace.times[first:last], trace.values[first:last], trace.longest_step
    is_known = np.isfinite(values)
    if not is_known.all():
        return Sampling(span, times[is_known], longest, times[~is_known]).covered(values[is_known])
    key = (span, first, last, longest, float(times.sum()))  # as good as all of them
    known = {} if known is None else known
    sampling = known.get(key)
    if sampling is None:
        sampling = known[key] = Sampling(span, times, longest)
    return sampling.covered(values)


def value_at(times: Floats, values: Floats, time: float, longest: float) -> float:
    """The newest value at a time [s]; NaN if it is older than the longest step [s], or there is none yet."""
    at = int(np.searchsorted(times, time, side="right")) - 1
    return float(values[at]) if at >= 0 and time - times[at] <= longest else math.nan


@dataclass(frozen=True)
class Axis:
    """A vertical axis.

    Attributes:
        low: Its lower end.
        high: Its upper one.
        step: Between two numbers.
    """

    low: float
    high: float
    step: float

    @classmethod
    def around(cls, low: float, high: float, rows: int) -> Axis:
        """An axis that holds a range, with round numbers."""
        if not (math.isfinite(low) and math.isfinite(high)):
            low, high = 0.0, 1.0
        spread = high - low
        least = max(abs(low), abs(high)) * 1e-6
        if spread <= least:
            half = max(0.5 * least, 0.5 if low == 0.0 else 0.05 * abs(low))
            low, high = low - half, high + half
        step = _round_step((high - low) / max(2, rows // ROWS_A_TICK))
        while math.floor(high / step) - math.ceil(low / step) < 1:  # a single number tells no scale
            step = _round_step(step / 2.5)  # 5, 2, 1, 0.5: never the same again
        grain = step / GRAINS
        return cls(math.floor(low / grain + 1e-9) * grain, math.ceil(high / grain - 1e-9) * grain, step)

    def rows(self, values: Floats, dots: int) -> Floats:
        """Rows of dots of values, from the top."""
        return (self.high - values) / (self.high - self.low) * (dots - 1)

    def labels(self, rows: int) -> list[str]:
        """Its numbers in the rows where they stand, empty texts between."""
        labels = [""] * rows
        digits = max(0, -math.floor(math.log10(self.step) + 1e-9))
        first = math.ceil(self.low / self.step - 1e-9)
        for number in range(first, math.floor(self.high / self.step + 1e-9) + 1):
            value = number * self.step
            row = int((self.high - value) / (self.high - self.low) * (4 * rows - 1)) // 4
            text = f"{value:.{digits}f}" if abs(value) < 1e6 and digits <= 4 else f"{value:.3g}"
            labels[row] = labels[row] or ("0" if float(text) == 0.0 else text)
        return labels


def _round_step(step: float) -> float:
    power = 10.0 ** math.floor(math.log10(step))
    return next(factor for factor in ROUND_STEPS if factor * power >= step * (1.0 - 1e-9)) * power


@dataclass(frozen=True, kw_only=True)
class TimeChart:
    """A chart.

    Attributes:
        traces: Its curves; later ones cover earlier ones.
        marks: Times [s] and words.
        cursor: A time [s] marked by a line; None: none.
        has_times: Whether the times stand below.
        chosen: Style of the axes' numbers.
        known: Where values lie in the columns, by their times: for charts above each other.
    """

    traces: Sequence[Trace]
    marks: Sequence[tuple[float, str]] = ()
    cursor: float | None = None
    has_times: bool = True
    chosen: str = "dim"
    known: dict[object, Sampling] = field(default_factory=dict)
    units: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "units", tuple(dict.fromkeys(trace.unit for trace in self.traces)) or ("",))

    def axes_width(self) -> int:
        """Cells of all its axes."""
        return AXIS_WIDTH * len(self.units)

    def lines(self, span: TimeSpan, height: int, axes_width: int) -> list[StyledLine]:
        """Its lines.

        Args:
            span: The times that are shown.
            height: Lines.
            axes_width: Cells left of the curves, at least its own: charts above each other share it.
        """
        rows = max(1, height - self.has_times)
        grid = _Grid(rows, span.columns // 2)
        ranges = [covered(trace, span, self.known) for trace in self.traces]
        axes = {unit: self._axis(unit, ranges, rows) for unit in self.units}
        if ranges:
            own = [axes[trace.unit] for trace in self.traces]
            ends = np.array(ranges).transpose(1, 0, 2)  # the least and the greatest value
            bottoms, tops = (
                np.array([axis.rows(end, 4 * rows) for axis, end in zip(own, of, strict=True)]) for of in ends
            )
            grid.fill(tops, bottoms, [trace.style for trace in self.traces])
        for number, (trace, (low, high)) in enumerate(zip(self.traces, ranges, strict=True)):
            grid.put_letter(axes[trace.unit], low + (high - low) / 2.0, trace, number)
        marks = [(span.cell(time), text) for time, text in self.marks if span.begin <= time < span.end]
        for cell, _ in marks:
            grid.column(cell, MARK_LINE, "jump")
        grid.put_marks(marks)
        if self.cursor is not None:
            grid.column(span.cell(self.cursor), CURSOR_LINE, "now")
        pad = " " * (axes_width - self.axes_width())
        labels = self._labels(axes, rows)
        lines = [[(pad + label, self.chosen), *line] for label, line in zip(labels, grid.lines(), strict=True)]
        return [*lines, time_axis(span, axes_width)][:height] if self.has_times else lines[:height]

    def _axis(self, unit: str, ranges: Sequence[tuple[Floats, Floats]], rows: int) -> Axis:
        own = [both for trace, both in zip(self.traces, ranges, strict=True) if trace.unit == unit]
        ends = [float(end) for low, high in own for end in (np.fmin.reduce(low), np.fmax.reduce(high))]
        known = list(filter(math.isfinite, ends))
        low, high = (min(known), max(known)) if known else (math.nan, math.nan)
        return Axis.around(low, high, rows)

    def _labels(self, axes: dict[str, Axis], rows: int) -> list[str]:
        columns = []
        for unit, axis in axes.items():
            numbers = axis.labels(rows)
            if unit and rows > 1:
                place = next((row for row in (*range(1, rows), 0) if not numbers[row]), 1)
                left = sum(map(bool, numbers)) - bool(numbers[place])
                if left > (len(axes) == 1):  # two numbers tell the scale; one of several axes must say which it is
                    numbers[place] = f"[{unit}]"
            room = AXIS_WIDTH - 1
            columns.append([f"{number if len(number) <= room else '':>{room}} " for number in numbers])
        return ["".join(parts) for parts in zip(*columns, strict=True)]


def time_axis(span: TimeSpan, left: int) -> StyledLine:
    """Round times under a chart [s since the vehicle was switched on], behind so many cells."""
    cells = span.columns // 2
    least = TIME_CELLS * 2 * span.width
    step = next((step for step in TIME_STEPS if step >= least), TIME_STEPS[-1])
    text = [" "] * cells
    number = math.ceil(span.begin / step)
    while (time := number * step) < span.end:
        cell, label = span.cell(time), f"'{clock_text(time, step)}"
        if cell + len(label) <= cells and time > -0.5 * step:  # before it was switched on there is nothing
            text[cell : cell + len(label)] = label
        number += 1
    return [(" " * left + "".join(text), "dim")]


def clock_text(time: float, step: float = 0.1) -> str:
    """A time [s] as "1:23", with tenths if the step [s] is below a second."""
    tenths = round(time * 10.0)
    minutes, rest = divmod(abs(tenths), 600)
    seconds = f"{rest / 10:04.1f}" if step < 1.0 else f"{rest // 10:02d}"
    return f"{'-' * (tenths < 0)}{minutes}:{seconds}"


class _Grid:
    """Cells of a chart: dots, characters on top of them, and styles."""

    def __init__(self, rows: int, cells: int) -> None:
        self._dots = np.zeros((4 * rows, 2 * cells), dtype=bool)
        self._over = np.zeros((rows, cells), dtype=np.uint32)
        self._style = np.zeros((rows, cells), dtype=np.intp)
        self._styles = [""]
        self._rows, self._cells = rows, cells

    def _number(self, style: str) -> int:
        if style not in self._styles:
            self._styles.append(style)
        return self._styles.index(style)

    def fill(self, tops: Floats, bottoms: Floats, styles: Sequence[str]) -> None:
        """The dots of all curves, which lines and words stand behind or above; later curves have their cells.

        Args:
            tops: Rows of dots of the greatest values, shape (curves, columns); NaN without one.
            bottoms: Those of the least values.
            styles: Of the curves.
        """
        dots, is_known = len(self._dots), np.isfinite(bottoms)
        top, bottom = (np.clip(np.rint(rows), 0, dots - 1) for rows in (tops, bottoms))
        first = np.where(is_known, top, dots).astype(np.int16)[:, np.newaxis]
        last = np.where(is_known, bottom, -1).astype(np.int16)[:, np.newaxis]
        row = np.arange(dots, dtype=np.int16)[:, np.newaxis]
        self._dots = np.any((first <= row) & (row <= last), axis=0)
        line = row[: self._rows]
        is_inside = (first // 4 <= line) & (line <= last // 4)
        is_inside = is_inside[..., ::2] | is_inside[..., 1::2]  # of shape (curves, rows, cells)
        latest = len(styles) - 1 - is_inside[::-1].argmax(axis=0)
        numbers = np.array([self._number(style) for style in styles])
        self._style = np.where(is_inside.any(axis=0), numbers[latest], 0)

    def put_letter(self, axis: Axis, line: Floats, trace: Trace, number: int) -> None:
        """The letter of a curve at its newest point; those of several curves stand beside each other."""
        known = np.flatnonzero(np.isfinite(line))
        if not len(known):
            return
        column = int(known[-1])
        row = int(np.clip(axis.rows(line[column], len(self._dots)), 0, len(self._dots) - 1)) // 4
        cell = max(0, column // 2 - number % 3)
        self._over[row, cell], self._style[row, cell] = ord(trace.letter), self._number(trace.style)

    def column(self, cell: int, character: int, style: str) -> None:
        """A line from top to bottom, behind curves."""
        if not 0 <= cell < self._cells:
            return
        free = ~self._dots[:, 2 * cell : 2 * cell + 2].reshape(self._rows, -1).any(axis=1) & (self._over[:, cell] == 0)
        self._over[free, cell], self._style[free, cell] = character, self._number(style)

    def put_marks(self, marks: Sequence[tuple[int, str]]) -> None:
        """Words at the top, right of their lines, where they end before the next one."""
        ends = [*(cell for cell, _ in marks), self._cells][1:]
        for (cell, text), end in zip(marks, ends, strict=True):
            if text and cell + 1 + len(text) <= end:
                self._over[0, cell + 1 : cell + 1 + len(text)] = [ord(character) for character in text]
                self._style[0, cell + 1 : cell + 1 + len(text)] = self._number("jump")

    def lines(self) -> list[StyledLine]:
        """All rows."""
        bits = (self._dots.reshape(self._rows, 4, self._cells, 2) * _BITS[:, np.newaxis, :]).sum(axis=(1, 3))
        characters = np.where(bits > 0, bits + FIRST_BRAILLE, BLANK).astype("<u4")
        characters = np.where(self._over > 0, self._over, characters).astype("<u4")
        is_drawn = characters != BLANK
        place = np.maximum.accumulate(np.where(is_drawn, np.arange(self._cells), 0), axis=1)
        styles = np.take_along_axis(self._style, place, axis=1)  # a blank has no colour: fewer segments
        return [self._line(characters[row], styles[row]) for row in range(self._rows)]

    def _line(self, characters: NDArray[np.uint32], styles: NDArray[np.intp]) -> StyledLine:
        text = characters.tobytes().decode("utf-32-le")
        cuts = [0, *(np.flatnonzero(np.diff(styles)) + 1).tolist(), self._cells]
        return [(text[begin:end], self._styles[styles[begin]]) for begin, end in pairwise(cuts)]
