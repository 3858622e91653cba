"""Two recorded flights on one clock."""

from __future__ import annotations

from enum import Enum
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from darko_gcs.errors import GroundError
from darko_gcs.feed.player import Player
from darko_gcs.feed.recorded_states import Series, height_series, take_off_row, v_series
from darko_gcs.feed.replay_feed import ReplayFeed

ROUNDING = 4e-7  # less than the microsecond of a recorder's clock [s]
NO_SERIES = Series(np.zeros(0, dtype=np.int64), np.zeros(0))


class Alignment(Enum):
    """Event at which the clocks of two flights are aligned."""

    TAKE_OFF = "takeoff"  # on the vehicles' clocks
    START = "start"  # the recordings' beginnings
    CLOCK = "clock"  # the date, as both recorders had it


class Place(Enum):
    """Position of a common time relative to a recording."""

    BEFORE = "not begun"
    INSIDE = "inside"
    BEHIND = "ended"


class RecordedFlight:
    """One of the two.

    Args:
        letter: Its name on the screen.
        feed: Its replay.

    Attributes:
        clock: Common time of each record [s], shape (n,), ascending.
        height: Height [m] over the records.
        v: V of the law in force over the records.
        place: Where the time sought last lies.
    """

    def __init__(self, letter: str, feed: ReplayFeed) -> None:
        self.letter, self.feed = letter, feed
        source, reader = feed.source, feed.reader
        self.height = NO_SERIES if source is None else height_series(reader, source)
        self.v = NO_SERIES if source is None else v_series(reader, source)
        self._take_off = 0 if source is None else take_off_row(reader, source)
        self.clock: NDArray[np.float64] = feed.timeline.times
        self.place = Place.INSIDE

    def align(self, alignment: Alignment, shift: float, epoch: int) -> None:
        """Set the common time of its records, later by a shift [s]; dates count from ``epoch`` [us]."""
        clock = self.feed.timeline.times
        if alignment is Alignment.TAKE_OFF:
            clock = self.feed.flight_times - self.feed.flight_times[self._take_off]
        elif alignment is Alignment.CLOCK:
            clock = clock + (self.feed.reader.clock.start_usec - epoch) / 1e6
        self.clock = clock + shift

    def seek(self, common: float) -> None:
        """Go to a common time [s]; before the beginning and behind the end it stands there."""
        outside = Place.BEFORE if common + ROUNDING < self.clock[0] else Place.BEHIND
        self.place = Place.INSIDE if self.clock[0] <= common + ROUNDING <= self.clock[-1] + 2 * ROUNDING else outside
        self.feed.seek(float(np.interp(common + ROUNDING, self.clock, self.feed.timeline.times)))

    def common_time(self, playing: float) -> float:
        """Common time [s] of a playing time of its own."""
        return float(np.interp(playing, self.feed.timeline.times, self.clock))


class _Ends(NamedTuple):
    begin: float  # common time of the first record of either [s]
    end: float


class PairFeed(Player):
    """Plays two flights side by side. The first one is what the other screens show.

    Args:
        first: One.
        second: The other.
        alignment: What is at the same time in both.
        shift: The second one is this much later [s].
        begin: Where to begin [s]; None: where the later of the two recordings begins.
        speed: Playing speed.

    Raises:
        GroundError: They are to be aligned by the date, and share no time.
    """

    def __init__(
        self,
        first: ReplayFeed,
        second: ReplayFeed,
        *,
        alignment: Alignment = Alignment.TAKE_OFF,
        shift: float = 0.0,
        begin: float | None = None,
        speed: float = 1.0,
    ) -> None:
        super().__init__(speed)
        self.flights = (RecordedFlight("A", first), RecordedFlight("B", second))
        self.owners = ("A", "B")
        self.alignment, self.shift = alignment, shift
        self._begin, self._now = begin, 0.0
        self.snapshot, self.traffic, self.history = first.snapshot, first.traffic, first.history
        if alignment is Alignment.CLOCK and not self._share_a_date:
            raise GroundError(f"{first.name} and {second.name} share no time by the date: align by takeoff or start")
        self._align()

    @property
    def now(self) -> float:
        """Time since the first record of either flight [s]."""
        return self._now

    @property
    def snapshot_now(self) -> float:
        """The first recording's own playing time [s]: the snapshot is its."""
        return self.flights[0].feed.now

    @property
    def duration(self) -> float:
        """From the first record of either flight to the last one of either [s]."""
        return self._ends.end - self._ends.begin

    @property
    def common(self) -> float:
        """Common time [s]: since take-off, or since the first recording's beginning."""
        return self._ends.begin + self._now

    @property
    def flight_time(self) -> float:
        """The first vehicle's time since its first message [s]."""
        return self.flights[0].feed.flight_time

    async def open(self) -> None:
        """Show the place where it begins."""
        both = max(float(flight.clock[0]) for flight in self.flights) - self._ends.begin
        self.seek(both if self._begin is None else self._begin)

    def seek(self, time: float) -> None:
        """Go to a time [s] in both."""
        self._now = min(max(time, 0.0), self.duration)
        for flight in self.flights:
            flight.seek(self.common)
        self.snapshot = self.flights[0].feed.snapshot

    def step(self, records: int) -> None:
        """Go on, or back, by some records of either flight, and stand still there."""
        self.playing = False
        at = int(np.searchsorted(self._record_times, self.common + ROUNDING, side="right")) - 1 + records
        self.seek(float(self._record_times[min(max(at, 0), len(self._record_times) - 1)]) - self._ends.begin)

    def next_alignment(self) -> None:
        """Align by the next rule that makes sense, without a shift; the first flight stays where it is."""
        rules = [rule for rule in Alignment if rule is not Alignment.CLOCK or self._share_a_date]
        self.alignment, self.shift = rules[(rules.index(self.alignment) + 1) % len(rules)], 0.0
        self._align()

    def move_second(self, step: float) -> None:
        """Shift the second flight by some more seconds; the first one stays where it is."""
        self.shift = round(self.shift + step, 6)
        self._align()

    @property
    def _share_a_date(self) -> bool:
        """Whether there is a moment that both have recorded."""
        clocks = [flight.feed.reader.clock for flight in self.flights]
        ends = [clock.start_usec + clock.duration * 1e6 for clock in clocks]
        return max(clock.start_usec for clock in clocks) <= min(ends)

    def _align(self) -> None:
        first, second = self.flights
        own = first.feed.now
        epoch = first.feed.reader.clock.start_usec
        first.align(self.alignment, 0.0, epoch)
        second.align(self.alignment, self.shift, epoch)
        clocks = [flight.clock for flight in self.flights]
        self._ends = _Ends(min(float(clock[0]) for clock in clocks), max(float(clock[-1]) for clock in clocks))
        self._record_times = np.unique(np.concatenate(clocks))
        self.marks = tuple(
            sorted(
                (
                    mark._replace(
                        time=flight.common_time(mark.time) - self._ends.begin,
                        text=f"{flight.letter}: {mark.text}",
                        owner=flight.letter,
                    )
                    for flight in self.flights
                    for mark in flight.feed.marks
                ),
                key=lambda mark: mark.time,
            )
        )
        self.seek(first.common_time(own) - self._ends.begin)
