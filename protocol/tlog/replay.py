"""A recorded flight as a timeline: its position, and the records that come next.

The caller has the clock: it decides on pauses and speed. Playing time is that of ``recorder_clock``.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from protocol.tlog import TlogReader
from protocol.wire.message import Message

__all__ = ["Marker", "Timeline"]


@dataclass(frozen=True, slots=True)
class Marker:
    """A remark about the recording itself: damage, or a step of its clock."""

    time: float  # playing time [s]
    what: str


class Timeline:
    """Plays a log: a position in time, and the number of records played, which tells records of one time apart.

    Attributes:
        times: Playing time of each record [s], shape (n,).
        duration: Playing time of the last record [s].
        position: Playing time reached [s].
        played: Records played: the next one has this index.
        markers: Damage and steps of the recording clock, by time.
    """

    def __init__(self, reader: TlogReader) -> None:
        self._reader = reader
        self.times = reader.clock.playing
        self.duration = reader.clock.duration
        self.position = 0.0
        self.played = 0
        self.markers = _markers(reader, self.times)

    @property
    def finished(self) -> bool:
        """Whether every record has been played."""
        return self.played == len(self._reader)

    @property
    def time_usec(self) -> int:
        """Recorded time of the last record played [us]; of the first record before the start."""
        return int(self._reader.times[max(self.played - 1, 0)]) if len(self._reader) else 0

    def seek(self, time: float) -> None:
        """Move to a playing time [s], clamped to the log: after the records up to and at it."""
        self.position = min(max(time, 0.0), self.duration)
        self.played = self._count(self.position)

    def go_to(self, played: int) -> None:
        """Move to where so many records have been played."""
        self.played = min(max(played, min(1, len(self._reader))), len(self._reader))
        self.position = float(self.times[self.played - 1]) if self.played else 0.0

    def advance(self, dt: float) -> range:
        """Play ``dt`` seconds (>= 0): the records in (position, position + dt], the very first one included."""
        self.position = min(self.position + dt, self.duration)
        begin, self.played = self.played, max(self.played, self._count(self.position))
        return range(begin, self.played)

    def message(self, record: int) -> Message | None:
        """The message of a record; None outside the dialect, as on a link."""
        return self._reader.decode(record)

    def _count(self, time: float) -> int:
        """Records up to and at a playing time."""
        return int(np.searchsorted(self.times, time, side="right"))


def _markers(reader: TlogReader, times: NDArray[np.float64]) -> tuple[Marker, ...]:
    markers = []
    for piece in reader.damage:
        before = int(np.searchsorted(reader.offsets, piece.offset)) - 1
        time = float(times[before]) if before >= 0 else 0.0
        markers.append(Marker(time, f"{piece.length} bytes damaged: {piece.what}"))
    rows = np.concatenate((reader.clock.backward, reader.clock.forward))
    for row, step in zip(rows.tolist(), reader.clock.steps(rows).tolist(), strict=True):
        markers.append(Marker(float(times[row]), f"recording clock stepped by {step:.3f} s"))
    return tuple(sorted(markers, key=lambda marker: marker.time))
