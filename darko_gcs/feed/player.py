"""Base of all players of recordings: direction, speed, and events of the flight as marks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Iterator
from enum import Enum
from typing import NamedTuple

import numpy as np

from darko_gcs.state.field_history import ChartSource
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable
from darko_gcs.state.traffic import Traffic
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.names import law_label, mode_name
from protocol.tlog import TlogReader
from protocol.tlog.reader import Timeline
from protocol.wire.message import Source

GAP = 2.0  # without a message of the vehicle [s]


class MarkKind(Enum):
    """Kinds of marks; a later one hides an earlier one at the same place of a drawing."""

    WAYPOINT = "waypoint"
    MODE = "mode"
    JUMP = "jump"
    WARNING = "warning"
    GAP = "gap"


class Mark(NamedTuple):
    """One event."""

    time: float  # playing time [s]
    kind: MarkKind
    text: str
    owner: str = ""  # letter of its flight, if there are several


def recorded_marks(reader: TlogReader, timeline: Timeline, source: Source | None) -> tuple[Mark, ...]:
    """The marks of a vehicle's flight, by time; of a log without a vehicle only damage and steps of its clock."""
    marks = [Mark(marker.time, MarkKind.GAP, marker.what) for marker in timeline.markers]
    if source is not None:
        for find in (_jumps, _modes, _warnings, _waypoints, _gaps):
            marks += find(reader, timeline, source)
    return tuple(sorted(marks, key=lambda mark: mark.time))


def _jumps(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("DARKO_JUMP", source)
    for row, law in zip(reader.rows("DARKO_JUMP", source), columns["law_to"].tolist(), strict=True):
        yield Mark(float(timeline.times[row]), MarkKind.JUMP, f"jump to {law_label(law)}")


def _modes(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("HEARTBEAT", source)
    modes = columns["custom_mode"].astype(np.int64)
    rows = reader.rows("HEARTBEAT", source)
    for index in (np.flatnonzero(np.diff(modes)) + 1).tolist():
        mode = int(modes[index])
        name = mode_name(int(columns["autopilot"][index]), int(columns["type"][index]), mode) or f"MODE {mode}"
        yield Mark(float(timeline.times[rows[index]]), MarkKind.MODE, f"mode {name}")


def _warnings(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    columns = reader.columns("STATUSTEXT", source)
    rows = reader.rows("STATUSTEXT", source)
    first = columns["chunk_seq"] == 0  # of a text in several messages
    severe = columns["severity"].astype(np.int64) <= mavlink.MAV_SEVERITY_WARNING
    for index in np.flatnonzero(severe & first).tolist():
        text = bytes(columns["text"][index]).decode(errors="replace")
        yield Mark(float(timeline.times[rows[index]]), MarkKind.WARNING, printable(text))


def _waypoints(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    items = reader.columns("MISSION_ITEM_REACHED", source)["seq"].tolist()
    for row, item in zip(reader.rows("MISSION_ITEM_REACHED", source), items, strict=True):
        yield Mark(float(timeline.times[row]), MarkKind.WAYPOINT, f"item {item} reached")


def _gaps(reader: TlogReader, timeline: Timeline, source: Source) -> Iterator[Mark]:
    own = np.flatnonzero((reader.systems == source[0]) & (reader.components == source[1]))
    silence = np.diff(timeline.times[own])
    for index in np.flatnonzero(silence > GAP).tolist():
        what = f"no message for {silence[index]:.1f} s"
        yield Mark(float(timeline.times[own[index]]), MarkKind.GAP, what)


SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


class Player(ABC):
    """A feed of one or more recordings.

    Attributes:
        snapshot: What the screens show.
        traffic: Every message that was played; of two recordings, of the first.
        history: What the vehicle said in the whole recording; of two, of the first.
        marks: What happened, by time.
        owners: Letters of the flights that the marks belong to.
        playing: False while it stands still.
        backwards: Whether it plays backwards.
        looping: Whether it begins anew at its end.
        speed: Playing speed, times real time.
    """

    snapshot: Snapshot
    traffic: Traffic
    history: ChartSource
    marks: tuple[Mark, ...]
    owners: tuple[str, ...] = ("",)

    def __init__(self, speed: float) -> None:
        self.station: Station | None = None
        self.playing, self.backwards, self.looping = True, False, False
        self.speed = speed

    @property
    @abstractmethod
    def now(self) -> float:
        """Playing time [s]."""

    @property
    def snapshot_now(self) -> float:
        """The same instant by the clock of the snapshot's times [s]."""
        return self.now

    @property
    @abstractmethod
    def duration(self) -> float:
        """Playing time of the last record [s]."""

    def log_time(self, playing: float) -> float:
        """The time that is shown for a playing time [s]: as the vehicle counts, which a simulation may do faster."""
        return playing

    def playing_at(self, shown: float) -> float:
        """The playing time of a time that is shown [s]."""
        return shown

    @property
    @abstractmethod
    def flight_time(self) -> float:
        """The vehicle's time since its first message [s]."""

    @abstractmethod
    def seek(self, time: float) -> None:
        """Go to a playing time [s]."""

    @abstractmethod
    def step(self, records: int) -> None:
        """Go on, or back, by some records, and stand still there."""

    @abstractmethod
    async def open(self) -> None:
        """Show the place where it begins."""

    def play(self, elapsed: float) -> None:
        """Play on by some playing time [s]."""
        self.seek(self.now + elapsed)

    @property
    def fleet(self) -> Fleet | None:
        """A recording is shown of one vehicle."""
        return None

    @property
    def restart(self) -> Callable[[], Awaitable[None]] | None:
        """A recording has no vehicle process."""
        return None

    async def close(self) -> None:  # noqa: B027 - the same for all
        """Nothing to release."""

    def note(self, text: str) -> None:  # noqa: B027
        """Nothing is recorded."""

    def advance(self, elapsed: float) -> None:
        """Play for some time [s]."""
        if not self.playing:
            return
        if self.backwards:
            self.seek(self.now - elapsed * self.speed)
            at_end = self.now <= 0.0
        else:
            self.play(elapsed * self.speed)
            at_end = self.now >= self.duration
        if at_end and self.looping:
            self.seek(self.duration if self.backwards else 0.0)
        elif at_end:
            self.playing = False

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
            self.seek(self.duration)
        elif not self.playing and not self.backwards and self.now >= self.duration:
            self.seek(0.0)
        self.playing = not self.playing

    def change_speed(self, steps: int) -> None:
        """Play faster or slower by some steps of the table of speeds."""
        index = min(range(len(SPEEDS)), key=lambda i: abs(SPEEDS[i] - self.speed))
        self.speed = SPEEDS[min(max(index + steps, 0), len(SPEEDS) - 1)]
