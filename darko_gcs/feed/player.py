"""Base of all players of recordings: direction, speed, marks."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable

from darko_gcs.feed.recorded_marks import Mark, MarkKind
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.fleet import Fleet
from darko_gcs.station.station import Station

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0)


class Player(ABC):
    """A feed of one or more recordings.

    Attributes:
        snapshot: What the screens show.
        marks: What happened, by time.
        owners: Letters of the flights that the marks belong to.
        playing: False while it stands still.
        backwards: Whether it plays backwards.
        looping: Whether it begins anew at its end.
        speed: Playing speed, times real time.
    """

    snapshot: Snapshot
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
