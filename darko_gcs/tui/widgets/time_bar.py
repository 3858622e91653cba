"""Position of a replay: a bar with marks, its clocks, and the meanings of the marks."""

from __future__ import annotations

from textual import events

from darko_gcs.feed.player import Player
from darko_gcs.feed.recorded_marks import MarkKind
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import format_time
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import styled_line
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
        return f" {format_time(feed.now)} / {format_time(feed.duration)}  {feed.speed:g}x{looping} "

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
        flight = f" vehicle's clock {format_time(feed.flight_time)} " if len(feed.owners) == 1 else " "
        symbols: StyledLine = []
        for kind, (symbol, style) in SYMBOLS.items():
            symbols += [(f"  {symbol}", style), (f" {kind.value}", "")]
        past = [mark for mark in feed.marks if mark.time <= feed.now]
        last = f"   last: {past[-1].text}" if past and width >= LAST_MARK_WIDTH else ""
        return styled_line((flight, "accent"), *symbols, (last, "dim"))


def _cell(time: float, duration: float, room: int) -> int:
    return min(room - 1, int(room * time / duration)) if duration > 0.0 else 0
