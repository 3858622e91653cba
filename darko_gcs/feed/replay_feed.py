"""Snapshots of a recorded flight: played, forwards or backwards, sought, and stepped through."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import replace

import numpy as np

from darko_gcs.feed.recorded_marks import Mark, MarkKind, recorded_marks
from darko_gcs.feed.recorded_states import RecordedStates
from darko_gcs.state.message_log import add_line
from darko_gcs.state.reduce import reduce
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.flight_log.flight_clock import flight_times
from protocol.tlog import TlogReader
from protocol.tlog.replay import Timeline

__all__ = ["ReplayFeed"]

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)
MAX_PLAYED = 500  # records that are played one by one; beyond, the state is looked up


class ReplayFeed:
    """A recorded flight.

    Args:
        reader: The log.
        name: Its name, for the message log.
        begin: Where to begin [s].
        speed: Playing speed, times real time.

    Attributes:
        marks: What happened, by time.
        playing: False while it stands still.
        backwards: Whether it plays backwards.
        looping: Whether it begins anew at its end.
    """

    def __init__(self, reader: TlogReader, name: str, *, begin: float = 0.0, speed: float = 1.0) -> None:
        self.timeline, self.name = Timeline(reader), name
        first = add_line(replace(EMPTY_SNAPSHOT, is_replay=True), 0.0, mavlink.MAV_SEVERITY_NOTICE, f"Replay of {name}")
        self._states = RecordedStates(reader, self.timeline, first)
        source = self._states.last.source
        self._flight_times = self.timeline.times if source is None else flight_times(reader, source)
        self.marks: tuple[Mark, ...] = recorded_marks(reader, self.timeline, source)
        self.snapshot: Snapshot = first
        self.station: Station | None = None
        self.playing, self.backwards, self.looping = True, False, False
        self.speed = speed
        self._begin = begin

    @property
    def now(self) -> float:
        """Playing time [s]."""
        return self.timeline.position

    @property
    def flight_time(self) -> float:
        """The vehicle's time since its first message [s]."""
        if not len(self._flight_times):
            return 0.0
        return float(np.interp(self.now, self.timeline.times, self._flight_times))

    @property
    def fleet(self) -> Fleet | None:
        """A recording is shown of one vehicle."""
        return None

    @property
    def restart(self) -> Callable[[], Awaitable[None]] | None:
        """A recording has no vehicle process."""
        return None

    async def open(self) -> None:
        """Show the place where it begins."""
        self.seek(self._begin)

    async def close(self) -> None:
        """Nothing to release."""

    def note(self, text: str) -> None:
        """Nothing is recorded."""

    def advance(self, elapsed: float) -> None:
        """Play for some time [s]."""
        if not self.playing:
            return
        if self.backwards:
            self.seek(self.now - elapsed * self.speed)
            at_end = self.now <= 0.0
        else:
            self._play(elapsed * self.speed)
            at_end = self.now >= self.timeline.duration
        if at_end and self.looping:
            self.seek(self.timeline.duration if self.backwards else 0.0)
        elif at_end:
            self.playing = False

    def seek(self, time: float) -> None:
        """Go to a playing time [s]."""
        self.timeline.seek(time)
        self.snapshot = self._states.at(self.timeline.played)

    def step(self, records: int) -> None:
        """Go on, or back, by some records, and stand still there."""
        self.playing = False
        self.timeline.go_to(self.timeline.played + records)
        self.snapshot = self._states.at(self.timeline.played)

    def seek_mark(self, kind: MarkKind | None, direction: int) -> Mark | None:
        """Go to the next (1) or previous (-1) mark of a kind, or of any; returns it, or None if there is none."""
        there = [mark for mark in self.marks if kind in {None, mark.kind} and (mark.time - self.now) * direction > 0.0]
        if not there:
            return None
        mark = there[0] if direction > 0 else there[-1]
        self.seek(mark.time)
        return mark

    def toggle(self) -> None:
        """Pause or play; at the end, play again from the other one."""
        if not self.playing and self.backwards and self.now <= 0.0:
            self.seek(self.timeline.duration)
        elif not self.playing and not self.backwards and self.now >= self.timeline.duration:
            self.seek(0.0)
        self.playing = not self.playing

    def change_speed(self, steps: int) -> None:
        """Play faster or slower by some steps of the table of speeds."""
        index = min(range(len(SPEEDS)), key=lambda i: abs(SPEEDS[i] - self.speed))
        self.speed = SPEEDS[min(max(index + steps, 0), len(SPEEDS) - 1)]

    def _play(self, elapsed: float) -> None:
        rows = self.timeline.advance(elapsed)
        if len(rows) > MAX_PLAYED or self._states.has_remark(rows):
            self.snapshot = self._states.at(self.timeline.played)
            return
        for row in rows:
            message = self.timeline.message(row)
            if message is not None:
                self.snapshot = reduce(self.snapshot, message, float(self.timeline.times[row]))
