"""The same screens on a recording, with a time bar."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType

from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import format_time
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.widgets.panel import styled_line
from darko_gcs.tui.widgets.status_bar import StatusBar

__all__ = ["ReplayApp", "ReplayScreen", "TimeBar"]


class ReplayApp(GroundStationApp):
    """A ground station whose vehicle is a log."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "pause", "Pause", priority=True),
        Binding("left", "seek(-5)", "-5 s"),
        Binding("right", "seek(5)", "+5 s"),
        Binding("shift+left", "seek(-30)", "", show=False),
        Binding("shift+right", "seek(30)", "", show=False),
        Binding("home", "go(0)", "", show=False),
        Binding("end", "go(1)", "", show=False),
        Binding("left_square_bracket", "speed(-1)", "Slower"),
        Binding("right_square_bracket", "speed(1)", "Faster"),
        *(Binding(str(n), f"go({n / 10})", "", show=False) for n in range(1, 10)),
    ]

    def __init__(self, feed: ReplayFeed) -> None:
        super().__init__(feed)
        self.replay = feed

    def first_screen(self) -> FlightScreen:
        """The flight screen with a time bar."""
        return ReplayScreen(self.replay)

    def extra_keys(self) -> list[tuple[str, str]]:
        """The player's keys."""
        return [
            ("space", "Pause or play"),
            ("left right", "Seek 5 s; with shift 30 s"),
            ("home end 1-9", "Go to the beginning, the end, tenths of the flight"),
            ("[ ]", "Slower, faster"),
        ]

    def action_pause(self) -> None:
        """Pause or play."""
        self.replay.toggle()

    def action_seek(self, step: float) -> None:
        """Move by some seconds."""
        self.replay.seek(self.replay.timeline.position + step)

    def action_go(self, share: float) -> None:
        """Go to a share (0..1) of the flight."""
        self.replay.seek(share * self.replay.timeline.duration)

    def action_speed(self, steps: int) -> None:
        """Play slower or faster."""
        self.replay.change_speed(steps)


class ReplayScreen(FlightScreen):
    """The flight screen with a time bar above the footer."""

    def __init__(self, feed: ReplayFeed) -> None:
        super().__init__()
        self._feed = feed

    def compose(self) -> ComposeResult:
        """The flight screen's widgets, then the bar."""
        yield from super().compose()
        yield TimeBar(self._feed).data_bind(ReplayScreen.snapshot, ReplayScreen.now)


class TimeBar(StatusBar):
    """Position in the flight, playing speed, damaged places of the log."""

    def __init__(self, feed: ReplayFeed) -> None:
        super().__init__("replay-bar")
        self._feed = feed

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - from the feed
        """State, bar, times."""
        timeline = self._feed.timeline
        state = "▶" if self._feed.playing else "⏸"
        times = f" {format_time(timeline.position)} / {format_time(timeline.duration)}  {self._feed.speed:g}x "
        room = max(1, width - len(times) - 3)
        cells = ["─"] * room
        for marker in timeline.markers:
            cells[_cell(marker.time, timeline.duration, room)] = "!"
        at = _cell(timeline.position, timeline.duration, room)
        line: StyledLine = [(f" {state} ", "accent"), ("".join(cells[:at]), "plan"), ("●", "accent")]
        return [[*line, ("".join(cells[at + 1 :]), "dim"), *styled_line(times)]]


def _cell(time: float, duration: float, room: int) -> int:
    return min(room - 1, int(room * time / duration)) if duration > 0.0 else 0
