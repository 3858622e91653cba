"""Panels of replays: the time bar with its marks, and two flights side by side."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import takewhile

import numpy as np
from numpy.typing import NDArray
from textual import events

from darko_gcs.feed.pair_feed import PairFeed, Place, RecordedFlight
from darko_gcs.feed.player import MarkKind, Player
from darko_gcs.feed.recorded_states import Series
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import format_time, v_text
from darko_gcs.tui.map_content import PlacedOverlay
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.render.chart import line_chart, log_chart
from darko_gcs.tui.render.map_drawing import MapFlight, NorthEast, draw_pair_map
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.status_bar import StatusBar

SYMBOLS = {
    MarkKind.WAYPOINT: ("◆", "plan"),
    MarkKind.MODE: ("M", "accent"),
    MarkKind.JUMP: ("J", "jump"),
    MarkKind.WARNING: ("!", "warn"),
    MarkKind.GAP: ("░", "dim"),
}
STATE_WIDTH = 3  # of the symbol before the bar [cells]
LAST_MARK_WIDTH = 100  # of the screen that has room for the last mark's text [cells]


class TimeBar(StatusBar):
    """Position in the recording, playing speed, marks and their legend. A click on the bar seeks."""

    def __init__(self, feed: Player) -> None:
        super().__init__("replay-bar")
        self._feed = feed

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - from the feed
        """State, bar and times, a bar for each flight; then the vehicle's own clock, if it is one, and the legend."""
        return [*(self._bar(owner, width) for owner in self._feed.owners), self._legend(width)]

    def on_click(self, event: events.Click) -> None:
        """Go to the place of the bar that was clicked."""
        room = self._room(self.size.width)
        if event.y < len(self._feed.owners) and STATE_WIDTH <= event.x < STATE_WIDTH + room:
            self._feed.seek((event.x - STATE_WIDTH) / max(1, room - 1) * self._feed.duration)
            self.redraw()

    def _times(self) -> str:
        feed = self._feed
        looping = " loop" if feed.looping else ""
        now, end = (format_time(feed.log_time(time)) for time in (feed.now, feed.duration))
        return f" {now} / {end}  {feed.speed:g}x{looping} "

    def _room(self, width: int) -> int:
        return max(1, width - len(self._times()) - STATE_WIDTH)

    def _bar(self, owner: str, width: int) -> StyledLine:
        """The bar with the marks of a flight; the first one has the player's state and the times."""
        feed, room = self._feed, self._room(width)
        is_first = owner == feed.owners[0]
        state = " " if not is_first else ("◀" if feed.backwards else "▶") if feed.playing else "⏸"
        at = _cell(feed.now, feed.duration, room)
        cells = [("─", "plan" if cell < at else "dim") for cell in range(room)]
        for kind, symbol in SYMBOLS.items():
            for mark in feed.marks:
                if mark.kind is kind and mark.owner == owner:
                    cells[_cell(mark.time, feed.duration, room)] = symbol
        cells[at] = ("●", "accent")
        head = f"{state} {owner}" if owner else f" {state} "
        return [(head, "accent"), *cells, *styled_line(self._times() if is_first else "")]

    def _legend(self, width: int) -> StyledLine:
        feed = self._feed
        flight = f" since boot {format_time(feed.flight_time)} " if len(feed.owners) == 1 else " "
        symbols: StyledLine = []
        for kind, (symbol, style) in SYMBOLS.items():
            symbols += [(f"  {symbol}", style), (f" {kind.value}", "")]
        past = [mark for mark in feed.marks if mark.time <= feed.now]
        last = f"   last: {past[-1].text}" if past and width >= LAST_MARK_WIDTH else ""
        return styled_line((flight, "accent"), *symbols, (last, "dim"))


def _cell(time: float, duration: float, room: int) -> int:
    return min(room - 1, int(room * time / duration)) if duration > 0.0 else 0


Floats = NDArray[np.float64]
STYLES = ("hover", "forward")  # of A and of B, in every panel
WINDOW = 60.0  # of the charts [s]
FRESH_FOR = 2.0  # of a value that a chart still shows [s]
MAX_DISTANCE = 5000.0  # between homes that one map shows where they are [m]
NAME_WIDTH, MIN_COLUMN = 9, 8  # [cells]


class PairPanel(Panel):
    """Redrawn as time passes: it shows the feed, not one snapshot."""

    def __init__(self, title: str, feed: PairFeed, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(title, id=id)
        self.feed = feed

    def watch_now(self) -> None:
        """Show the new place, or the new alignment."""
        self.watch_snapshot()


@dataclass(frozen=True)
class _Row:
    """A value of the table: text, or a number that has a difference."""

    label: str
    value: Callable[[Snapshot], str | float | None]
    digits: int = 1
    text: Callable[[float], str] | None = None  # of a number that has a notation of its own


ROWS = (
    _Row("mode", lambda s: s.status.mode),
    _Row("law", lambda s: s.hybrid.law),
    _Row("height m", lambda s: None if s.position.from_home is None else -s.position.from_home[2]),
    _Row("speed m/s", lambda s: None if s.position.v is None else math.hypot(s.position.v[0], s.position.v[1])),
    _Row("air m/s", lambda s: s.estimates.airspeed),
    _Row("V", lambda s: None if s.hybrid.state is None else s.hybrid.state.v, text=v_text),
    _Row("north m", lambda s: None if s.position.from_home is None else s.position.from_home[0]),
    _Row("east m", lambda s: None if s.position.from_home is None else s.position.from_home[1]),
    _Row("climb m/s", lambda s: None if s.position.v is None else -s.position.v[2]),
    _Row("to go m", lambda s: None if s.goal is None or s.position.p is None else math.dist(s.position.p, s.goal)),
    _Row("track m", lambda s: None if s.guidance.navigation is None else s.guidance.navigation.cross_track),
    _Row("power W", lambda s: s.battery.power if s.battery.energy is None else s.battery.energy.power, 0),
    _Row("used kJ", lambda s: None if s.battery.energy is None else s.battery.energy.total / 1e3, 2),
    _Row("battery %", lambda s: None if s.battery.charge_left is None else 100.0 * s.battery.charge_left, 0),
    _Row(
        "wind m/s", lambda s: None if s.estimates.wind is None else math.hypot(s.estimates.wind[0], s.estimates.wind[1])
    ),
    _Row("jumps", lambda s: None if s.hybrid.state is None else float(s.hybrid.state.jumps), 0),
    _Row("item", lambda s: None if s.mission.current is None else float(s.mission.current), 0),
    _Row("armed", lambda s: None if s.status.armed is None else ("yes" if s.status.armed else "no")),
)


class PairStatus(PairPanel):
    """The top line: both vehicles, their modes, whether they are armed, and which recording has not begun or ended."""

    def __init__(self, feed: PairFeed) -> None:
        super().__init__("", feed, id="pair-status")

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the feed
        """One line."""
        halves = [_state(flight, style) for flight, style in zip(self.feed.flights, STYLES, strict=True)]
        return [[*halves[0], *halves[1], (" REPLAY ", "accent")]]

    def subtitle(self, s: Snapshot) -> str:  # noqa: ARG002 - it has no border
        """None."""
        return ""


def _state(flight: RecordedFlight, style: str) -> StyledLine:
    s = flight.feed.snapshot
    if flight.place is Place.BEFORE:
        return styled_line((f" {flight.letter} ", style), (flight.place.value, "warn"), " ")
    armed = (" ARMED", "bad") if s.status.armed else (" disarmed", "dim")
    when = (f" {flight.place.value}", "warn") if flight.place is Place.BEHIND else ("", "")
    return styled_line((f" {flight.letter} ", style), (s.status.mode or "no vehicle", "accent"), armed, when, " ")


class PairTable(PairPanel):
    """Values of both flights, and B less A. The lower border tells how they are aligned."""

    def subtitle(self, s: Snapshot) -> str:  # noqa: ARG002 - of the feed
        """Alignment and common time of both flights."""
        shift = f" {self.feed.shift:+g} s" if self.feed.shift else ""
        return f"by {self.feed.alignment.value}{shift}, t = {self.feed.common:.1f} s"

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the feed
        """One line a value, the most important ones first."""
        column = max(MIN_COLUMN, (width - NAME_WIDTH) // 3)
        names = distinct_names([flight.feed.name for flight in self.feed.flights], column - len(" A "))
        flights = zip(self.feed.flights, names, STYLES, strict=True)
        heads = [(_fitted(f"{flight.letter} {name}", column), style) for flight, name, style in flights]
        head = styled_line((" " * NAME_WIDTH, ""), *heads, (_fitted("B - A", column), "label"))
        first, second = (flight.feed.snapshot for flight in self.feed.flights)
        return [head, *(_table_line(row, first, second, column) for row in ROWS)][:height]


def distinct_names(names: Sequence[str], width: int) -> list[str]:
    """Names of files in a width [cells]: without what all begin or end with, as far as there is no room for it."""
    shared = _shared_length(names)
    if len(set(names)) == 1 or all(len(name) <= width for name in names):
        return [name[:width] for name in names]
    end = _shared_length([name[shared:][::-1] for name in names])
    stems = [name[: len(name) - end] for name in names]
    cut = min(shared, max(0, max(map(len, stems)) - width + 1))
    return [("…" + stem[cut:] if cut else stem)[:width] for stem in stems]


def _shared_length(names: Sequence[str]) -> int:
    """Length of the beginning that all names share [characters]."""
    return sum(1 for _ in takewhile(lambda column: len(set(column)) == 1, zip(*names, strict=False)))


def _table_line(row: _Row, first: Snapshot, second: Snapshot, column: int) -> StyledLine:
    values = row.value(first), row.value(second)
    difference, style = "", ""
    if all(isinstance(value, float | int) and math.isfinite(value) for value in values):
        apart = float(values[1] or 0.0) - float(values[0] or 0.0)
        sign = "-" if apart < 0.0 else "+"
        difference = f"{apart:+.{row.digits}f}" if row.text is None else f"{sign}{row.text(abs(apart))}"
    elif None not in values and isinstance(values[0], str) and values[0] != values[1]:
        difference, style = "differs", "warn"
    texts = [(_fitted(_text(value, row), column), "") for value in values]
    return styled_line((row.label.ljust(NAME_WIDTH), "label"), *texts, (_fitted(difference, column), style))


def _text(value: str | float | None, row: _Row) -> str:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return "--"
    if isinstance(value, str):
        return value
    return f"{value:.{row.digits}f}" if row.text is None else row.text(value)


def _fitted(text: str, width: int) -> str:
    """The text at the right of a column, with a space before it."""
    return f" {text[: width - 1]:>{width - 1}}"


class PairMapPanel(PairPanel):
    """Both tracks and vehicles; in one place if their homes are near each other, else both around their homes."""

    _overlay = PlacedOverlay()

    def on_mount(self) -> None:
        """Take the shapes that the pilot laid over all maps."""
        self._overlay = PlacedOverlay(getattr(self.app, "overlay", ()))

    def subtitle(self, s: Snapshot) -> str:  # noqa: ARG002 - of the feed
        """Says if the places are not the true ones."""
        return "" if self._between() is not None else "each around its own home"

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the feed
        """The map fills the panel."""
        first, second = (flight.feed.snapshot for flight in self.feed.flights)
        shift, overlay = self._between(), self._overlay.shapes(first)
        if shift is None:
            overlay = []  # its places are true ones
            shift = (
                first.position.home_p[0] - second.position.home_p[0],
                first.position.home_p[1] - second.position.home_p[1],
            )
        both = [_map_flight(first, 0, (0.0, 0.0)), _map_flight(second, 1, shift)]
        return draw_pair_map(both, width, height, overlay)

    def _between(self) -> NorthEast | None:
        """From the second flight's local frame to the first one's [m]; None if they are far apart or not known."""
        first, second = (flight.feed.snapshot for flight in self.feed.flights)
        place = None if second.position.home is None else first.position.local(second.position.home)
        if place is None or math.hypot(place[0], place[1]) > MAX_DISTANCE:
            return None
        return place[0] - second.position.home_p[0], place[1] - second.position.home_p[1]


def _map_flight(s: Snapshot, number: int, shift: NorthEast) -> MapFlight:
    north, east = shift
    vehicle = (
        None if s.position.p is None else (s.position.p[0] + north, s.position.p[1] + east, s.attitude.heading or 0.0)
    )
    return MapFlight("AB"[number], STYLES[number], [(n + north, e + east) for n, e in s.position.track], vehicle)


class PairVPanel(PairPanel):
    """V of the law in force in both flights, over the last minute."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the feed
        """The chart fills the panel."""
        times = _times(self.feed, width)
        traces = _traces(self.feed, times, lambda flight: flight.v)
        return log_chart(times.tolist(), *traces, width=width, height=height, window=WINDOW, now=self.feed.common)


class HeightPanel(PairPanel):
    """Height of both flights, over the last minute."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - of the feed
        """The chart fills the panel."""
        traces = _traces(self.feed, _times(self.feed, width), lambda flight: flight.height)
        return line_chart(*traces, width=width, height=height)


def _traces(
    feed: PairFeed, times: Floats, series: Callable[[RecordedFlight], Series]
) -> list[tuple[list[float], str, str]]:
    """A quantity of both flights for a chart: values, style and letter."""
    return [
        (_sampled(flight, series(flight), times).tolist(), style, flight.letter)
        for flight, style in zip(feed.flights, STYLES, strict=True)
    ]


def _times(feed: PairFeed, width: int) -> Floats:
    """Two common times for each cell of a chart, the last one now."""
    return np.linspace(feed.common - WINDOW, feed.common, max(2, 2 * width))


def _sampled(flight: RecordedFlight, series: Series, times: Floats) -> Floats:
    """The last value before each time; NaN where there is none or it is old."""
    clock = flight.clock[series.rows]
    before = np.searchsorted(clock, times, side="right") - 1
    if not len(clock):
        return np.full(len(times), math.nan)
    is_fresh = (before >= 0) & (times - clock[before] <= FRESH_FOR)
    return np.where(is_fresh, series.values[before], math.nan)
