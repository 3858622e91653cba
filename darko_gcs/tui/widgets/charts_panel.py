"""Charts under each other: expressions of the vehicle's messages over the same time, with a cursor."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from rich.cells import cell_len
from textual import events

from darko_gcs.state.chart_units import shared_units
from darko_gcs.state.chart_views import ChartView
from darko_gcs.state.field_history import ChartSource
from darko_gcs.state.message_fields import value_words
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.time_chart import AXIS_WIDTH, Sampling, TimeChart, TimeSpan, Trace, clock_text, value_at
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.row_list import padded
from protocol.errors import FileError
from protocol.flight_log.field_expressions import Curve, expression_unit, longest_step

CURVE_STYLES = ("hover", "forward", "warn", "plan", "now", "good", "accent", "bad")
LETTERS = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789"  # of all curves a view may have
WINDOWS = (5.0, 10.0, 20.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0, 7200.0)  # [s]
USUAL_WINDOW = 60.0  # [s]
LEGEND_BESIDE = 110  # cells from which names and values stand beside the curves
LEGEND = 42  # cells of them there
MIN_CHART = 5  # rows that a chart needs
MAX_LEGEND_ROWS = 2  # above a chart
RECENT = 200  # values that tell how often a curve has one
COLUMNS_BEFORE = 20.0  # columns of dots before the first one, whose values lines come from
VALUE_DIGITS = 5
NOTHING = 1e-5  # of the largest value, and by itself
NEWS_PERIOD = 1.0  # within which new values are drawn also where a cell takes longer [s]
RETRY = 1.0  # after which an expression that failed is tried again [s]
PAN = 0.25  # of the window


class _Layout(NamedTuple):
    """Measures that charts above each other share."""

    span: TimeSpan
    left: int  # cells before the curves
    legend: int  # cells beside them; 0: names stand above


class _Drawn(NamedTuple):
    """A curve, and the time between two of its values from which on there is a gap [s]."""

    curve: Curve
    longest_step: float


class _Failed(NamedTuple):
    """An expression that has no values."""

    reason: str
    retry_at: float  # on the vehicle's clock [s]


class ChartsPanel(Panel):
    """The charts of a view.

    Args:
        source: Where the curves come from.

    Attributes:
        view: What is drawn.
        chosen: Number of the chosen curve in the view.
        window: Time shown [s]; None: all that is known.
        end: Its last time [s]; None: the present.
        cursor: A time whose values are shown [s]; None: the newest ones.
    """

    def __init__(self, source: ChartSource, view: ChartView) -> None:
        super().__init__("", id="charts")
        self._source, self.view = source, view
        self.chosen = 0
        self.window: float | None = USUAL_WINDOW
        self.end: float | None = None
        self.cursor: float | None = None
        self._letters = _lettered(view, {})
        self._failed: dict[str, _Failed] = {}
        self._steps: dict[tuple[int, float], float] = {}  # longest steps of the curves [s], by their times
        self._key: tuple[object, ...] = ()  # what the lines were drawn for
        self._kept: list[StyledLine] = []
        self._span: TimeSpan | None = None  # as it was drawn
        self._left = 0  # cells before its curves

    # What is shown

    def show(self, view: ChartView) -> None:
        """Draw another view."""
        self.view, self.chosen = view, min(self.chosen, max(0, len(view.expressions) - 1))
        self._letters = _lettered(view, self._letters)
        self._failed.clear()
        self._draw_anew()

    def choose(self, step: int) -> None:
        """Choose another curve."""
        count = len(self.view.expressions)
        self.chosen = (self.chosen + step) % count if count else 0
        self._draw_anew()

    def place(self) -> tuple[int, int]:
        """Chart of the chosen curve, and its number there; of no curve, a chart behind the last one."""
        left = self.chosen
        for chart, texts in enumerate(self.view.charts):
            if left < len(texts):
                return chart, left
            left -= len(texts)
        return len(self.view.charts), 0

    def zoom(self, step: int) -> None:
        """Show less time (1), more (-1), or all that is known (0)."""
        if step == 0:
            self.window, self.end = None, None
        else:
            window = self._shown_window()
            there = [w for w in WINDOWS if (w < 0.99 * window if step > 0 else w > 1.01 * window)]
            middle = self.cursor
            if there:
                self.window = there[-1] if step > 0 else there[0]
            if middle is not None and (self.end is not None or middle < self._source.now - self._shown_window()):
                self.end = min(self._source.now, middle + self._shown_window() / 2.0)
        self._draw_anew()

    def pause(self) -> None:
        """Stand still, or follow the present again."""
        self.end = self._source.now if self.end is None else None
        self._draw_anew()

    def pan(self, step: int) -> None:
        """Show an earlier (-1) or later (1) time; at the present, follow it again."""
        window, now = self._shown_window(), self._source.now
        end = (now if self.end is None else self.end) + step * PAN * window
        self.end = None if end >= now else max(end, self._source.begin + 0.1 * window)
        self._draw_anew()

    def move_cursor(self, columns: int) -> None:
        """Move the cursor by some columns of cells; it begins in the middle of what is known."""
        if self._span is None:
            return
        cell = 2.0 * self._span.width
        middle = (max(self._span.begin, self._source.begin) + min(self._span.end, self._source.now)) / 2.0
        start = middle if self.cursor is None else self.cursor
        self._put_cursor(self._span, start + columns * cell)

    def _put_cursor(self, span: TimeSpan, time: float) -> None:
        """At a time that is shown, not before the first message."""
        self.cursor = min(max(time, span.begin, self._source.begin), span.end - 0.02 * span.width)
        self._draw_anew()

    def drop_cursor(self) -> None:
        """Show the newest values again."""
        self.cursor = None
        self._draw_anew()

    def on_click(self, event: events.Click) -> None:
        """Put the cursor there."""
        column = event.x - self.gutter.left - self._left
        if self._span is not None and 0 <= column < self._span.columns // 2:
            self._put_cursor(self._span, self._span.begin + (2 * column + 1) * self._span.width)

    def on_mouse_scroll_up(self) -> None:
        """The wheel zooms."""
        self.zoom(1)

    def on_mouse_scroll_down(self) -> None:
        """The wheel zooms."""
        self.zoom(-1)

    def watch_snapshot(self) -> None:
        """The time that is shown goes on with every snapshot: nothing is drawn twice."""
        self._tell()

    def watch_now(self) -> None:
        """Follow the vehicle."""
        self._tell()
        self.redraw()

    def subtitle(self, s: Snapshot) -> str:
        """Window, and whether it stands still."""
        window = "all" if self.window is None else f"{self.window:g} s"
        state = "paused" if self.end is not None else "old: link lost" if s.link.lost else ""
        at = "" if self.cursor is None else f"cursor {clock_text(self.cursor)}"
        return "  ".join(filter(None, (at, window, state)))

    def _draw_anew(self) -> None:
        self._key = ()
        self._tell()
        self.redraw()

    def _shown_window(self) -> float:
        if self.window is not None:
            return self.window
        return max(1.0, self._source.now - self._source.begin)

    # Drawing

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the history alone
        """The charts that there is room for, with the chosen curve among them."""
        if not self.view.charts:
            return [[("No chart yet: a adds an expression, o opens a view, E finds fields", "dim")]]
        legend = LEGEND if width >= LEGEND_BESIDE else 0
        shown = self._shown_charts(height)
        left = AXIS_WIDTH * max(len(self._units(chart)) for chart in shown)
        now = self._source.now
        end = now if self.end is None else self.end
        span = TimeSpan.until(end, self._shown_window(), max(4, width - left - legend))
        news = math.floor(end / min(NEWS_PERIOD, 2.0 * span.width)) if math.isfinite(end) else 0
        key = (span, news, height, shown, len(self._source.marks))
        if key != self._key:
            since = span.begin - COLUMNS_BEFORE * span.width
            self._steps.clear()
            curves = {text: self._curve(text, since) for chart in shown for text in self.view.charts[chart]}
            self._key, self._span, self._left = key, span, left
            known: dict[object, Sampling] = {}
            heights = _shares(height, len(shown))
            self._kept = []
            layout = _Layout(span, left, legend)
            for chart, rows in zip(shown, heights, strict=True):
                marks = [(time, text if chart == shown[0] else "") for time, text in self._source.marks]
                drawn = TimeChart(
                    traces=self._traces(chart, curves),
                    marks=marks,
                    cursor=self.cursor,
                    has_times=chart == shown[-1],
                    chosen="label",
                    known=known,
                )
                self._kept += _with_legend(drawn, self._entries(chart, curves, span), rows, layout)
        return self._kept

    def _units(self, chart: int) -> set[str]:
        """The units of a chart's axes."""
        return {axis for axis, _ in shared_units(map(_unit, self.view.charts[chart])).values()}

    def _shown_charts(self, height: int) -> tuple[int, ...]:
        """Numbers of the charts that there is room for."""
        count, total = max(1, height // MIN_CHART), len(self.view.charts)
        chosen = self.place()[0]
        first = min(max(0, chosen - count // 2), max(0, total - count))
        return tuple(range(first, min(total, first + count)))

    def _curve(self, text: str, since: float) -> _Drawn | None:
        """The values of an expression; None if it has none, or had none a moment ago."""
        now, failed = self._source.now, self._failed.get(text)
        if failed is not None and abs(now - (failed.retry_at - RETRY)) < RETRY:
            return None
        try:
            found = self._source.curve(text, since)
        except FileError as error:
            self._failed[text] = _Failed(str(error).removeprefix(f"{text}: "), now + RETRY)
            return None
        self._failed.pop(text, None)
        recent = found.times[-RECENT:]
        key = (len(recent), float(recent.sum()))  # most curves are of a few kinds of messages
        step = self._steps.get(key)
        if step is None:
            step = self._steps[key] = longest_step(recent)
        return _Drawn(found, step)

    def _traces(self, chart: int, curves: dict[str, _Drawn | None]) -> list[Trace]:
        traces = []
        axes = shared_units(map(_unit, self.view.charts[chart]))
        for number, text in enumerate(self.view.charts[chart]):
            found = curves[text]
            if found is not None:
                unit, factor = axes.get(found.curve.unit, (found.curve.unit, 1.0))
                traces.append(
                    Trace(
                        times=found.curve.times,
                        values=found.curve.values if factor == 1.0 else found.curve.values * factor,
                        unit=unit,
                        style=CURVE_STYLES[number % len(CURVE_STYLES)],
                        letter=self._letters[text],
                        longest_step=found.longest_step,
                    )
                )
        return traces

    def _entries(self, chart: int, curves: dict[str, _Drawn | None], span: TimeSpan) -> list[StyledLine]:
        """Letter, name and value of each curve of a chart."""
        first = sum(map(len, self.view.charts[:chart]))
        entries = []
        for number, text in enumerate(self.view.charts[chart]):
            found, is_chosen = curves[text], first + number == self.chosen
            style = CURVE_STYLES[number % len(CURVE_STYLES)]
            name = (text, "accent" if is_chosen else "")
            head = [(">" if is_chosen else " ", "accent"), (self._letters[text], style), (" ", ""), name]
            if found is None:
                reason = self._failed[text].reason if text in self._failed else ""
                entries.append([*head, (f" {reason}", "warn")])
                continue
            time = min(span.end, self._source.now) if self.cursor is None else self.cursor + span.width
            value = value_at(found.curve.times, found.curve.values, time, found.longest_step)
            words = value_words(text, value) or _number(value, found.curve)
            entries.append(styled_line(*head, "  ", (words, style)))
        return entries


def _lettered(view: ChartView, before: Mapping[str, str]) -> dict[str, str]:
    """A letter for each expression: one that had a letter keeps it while the view is edited."""
    kept = {text: before[text] for text in view.expressions if text in before}
    free = (letter for letter in LETTERS if letter not in kept.values())
    return {text: kept.get(text) or next(free) for text in dict.fromkeys(view.expressions)}


def _number(value: float, curve: Curve) -> str:
    """A value of a curve with its unit; what is lost in the others' rounding is 0."""
    if not math.isfinite(value):
        return "no value"
    is_nothing = abs(value) < NOTHING and abs(value) < NOTHING * float(np.nanmax(np.abs(curve.values)))
    number = "0" if is_nothing else f"{value:.{VALUE_DIGITS}g}"
    return f"{number} {curve.unit}".rstrip()


def _unit(text: str) -> str:
    """The unit of an expression; none of what is no expression."""
    try:
        return expression_unit(text)
    except FileError:
        return ""


def _with_legend(drawn: TimeChart, entries: list[StyledLine], rows: int, layout: _Layout) -> list[StyledLine]:
    """A chart with the names and values of its curves beside or above it."""
    span, left, legend = layout
    if legend:
        lines = drawn.lines(span, rows, left)
        beside = [entries[row] if row < len(entries) else [] for row in range(rows)]
        if len(entries) > rows:
            beside[-1] = [(f"  +{len(entries) - rows + 1}", "dim")]
        return [[*line, (" ", ""), *_fitted(entry, legend - 1)] for line, entry in zip(lines, beside, strict=True)]
    above = _flowed(entries, left + span.columns // 2, min(MAX_LEGEND_ROWS, max(1, rows - 3)))
    return [*above, *drawn.lines(span, max(1, rows - len(above)), left)]


def _shares(height: int, count: int) -> list[int]:
    """Rows of each chart; the last one has those that are left over, for its times."""
    share = height // count
    return [*[share] * (count - 1), height - share * (count - 1)]


def _width(line: StyledLine) -> int:
    return sum(cell_len(text) for text, _ in line)


def _fitted(entry: StyledLine, width: int) -> StyledLine:
    """An entry in so many cells: its name is cut, its value is not."""
    surplus = _width(entry) - width
    if surplus <= 0 or len(entry) < 4:
        return entry
    name, style = entry[3]
    return [*entry[:3], (padded(name, max(1, len(name) - surplus)), style), *entry[4:]]


def _flowed(entries: list[StyledLine], width: int, rows: int) -> list[StyledLine]:
    """Entries beside each other in some rows; the last one says how many have no room."""
    lines: list[StyledLine] = [[]]
    for number, entry in enumerate(entries):
        if lines[-1] and _width(lines[-1]) + 2 + _width(entry) > width:
            if len(lines) == rows:
                lines[-1] = _with_rest(lines[-1], f"  +{len(entries) - number}", width)
                break
            lines.append([])
        lines[-1] = [*lines[-1], *([("  ", "")] if lines[-1] else []), *_fitted(entry, width)]
    return lines


def _with_rest(line: StyledLine, rest: str, width: int) -> StyledLine:
    """A line of entries with the number of those left out; without it where it has no room."""
    return [*line, (rest, "dim")] if _width(line) + len(rest) <= width else line
