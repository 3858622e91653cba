"""A recorded flight as a timeline: its position, the next messages, and the state at any moment.

The caller has the clock: it decides on pauses and speed. Playing time starts at 0 with the first record and never runs
backwards, also if the recording clock did: where that clock was set back, playing continues from there, and a single
record with a time far from its neighbours' gets theirs.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.message import Message
from protocol.tlog import TlogReader, message_name

__all__ = ["Marker", "Timeline", "playing_times"]

_MAX_HISTORY = 100  # messages of each cumulative type that are returned to rebuild a state
_CUMULATIVE = ("STATUSTEXT", "DARKO_JUMP")  # each message adds to those before
_INSTANCES = {  # fields that distinguish instances of a message, where the dialect does not define them
    "COMMAND_ACK": "command",
    "MISSION_ITEM": "seq",
    "MISSION_ITEM_INT": "seq",
    "MISSION_ITEM_REACHED": "seq",
    "PARAM_VALUE": "param_id",
}


@dataclass(frozen=True, slots=True)
class Marker:
    """A remark about the recording itself: damage, or a step of its clock."""

    time: float  # playing time [s]
    what: str


def playing_times(times: NDArray[np.int64]) -> NDArray[np.float64]:
    """Seconds since the first record, ascending.

    Args:
        times: Times as recorded [us], shape (n,).
    """
    if not len(times):
        return np.zeros(0)
    before, now, after = times[:-2], times[1:-1], times[2:]
    steady = times.copy()
    odd = (before <= after) & ((now < before) | (now > after))
    steady[1:-1][odd] = before[odd]
    if len(times) > 2 and times[0] > times[1] and times[1] <= times[2]:
        steady[0] = times[1]
    return np.concatenate(([0.0], np.cumsum(np.maximum(np.diff(steady), 0)) / 1e6))


class Timeline:
    """Plays a log. Messages outside the dialect are left out, as on a link.

    Attributes:
        times: Playing time of each record [s], shape (n,).
        duration: Playing time of the last record [s].
        position: Playing time reached [s].
        markers: Damage and steps of the recording clock, by time.
    """

    def __init__(self, reader: TlogReader) -> None:
        self._reader = reader
        self.times = playing_times(reader.times)
        self.duration = float(self.times[-1]) if len(self.times) else 0.0
        self.position = 0.0
        self.markers = _markers(reader, self.times)
        self._next = 0  # first record not played yet
        self._keys = _keys(reader)

    @property
    def finished(self) -> bool:
        """Whether every record has been played."""
        return self._next == len(self._reader)

    @property
    def time_usec(self) -> int:
        """Recorded time of the last record played [us]; of the first record before the start."""
        return int(self._reader.times[max(self._next - 1, 0)]) if len(self._reader) else 0

    def seek(self, time: float) -> list[Message]:
        """Move to a playing time [s], clamped to the log; returns ``messages_until`` it, to rebuild the state."""
        self.position = min(max(time, 0.0), self.duration)
        self._next = self._count(self.position)
        return self.messages_until(self.position)

    def advance(self, dt: float) -> list[Message]:
        """Play ``dt`` seconds (>= 0): the messages in (position, position + dt], the very first one included."""
        self.position = min(self.position + dt, self.duration)
        begin, self._next = self._next, max(self._next, self._count(self.position))
        return self._decode(range(begin, self._next))

    def between(self, after: float, until: float) -> list[Message]:
        """Messages in (after, until], playing times [s]; the position stays."""
        return self._decode(range(self._count(after), self._count(until)))

    def messages_until(self, time: float) -> list[Message]:
        """The last message of each kind up to a playing time [s], in the order of the log; the position stays.

        A kind is one message type of one source and, for messages with instances (parameters, mission items,
        batteries, named values), of one instance. Of texts and jumps the last hundred messages are returned.
        """
        keys = self._keys[: self._count(time)]
        single, cumulative = np.flatnonzero(keys >= 0), np.flatnonzero(keys < 0)
        last = np.full(int(keys.max(initial=-1)) + 1, -1)
        last[keys[single]] = single  # the last of several assignments counts
        rows = [last[last >= 0]]
        rows += [cumulative[self._reader.ids[cumulative] == number][-_MAX_HISTORY:] for number in _cumulative_ids()]
        return self._decode(np.sort(np.concatenate(rows)).tolist())

    def _count(self, time: float) -> int:
        """Records up to and at a playing time."""
        return int(np.searchsorted(self.times, time, side="right"))

    def _decode(self, rows: range | list[int]) -> list[Message]:
        return [message for row in rows if (message := self._reader.decode(row)) is not None]


def _cumulative_ids() -> list[int]:
    return [number for number, known in mavlink.mavlink_map.items() if known.msgname in _CUMULATIVE]


def _keys(reader: TlogReader) -> NDArray[np.int64]:
    """A small number for each record's kind; -1 for cumulative messages."""
    sources = reader.ids << 16 | reader.systems.astype(np.int64) << 8 | reader.components
    instances = np.zeros(len(reader), dtype=np.int64)
    for number in np.unique(reader.ids[reader.known]).tolist():
        name = message_name(number)
        if (field := _INSTANCES.get(name, mavlink.mavlink_map[number].instance_field)) is not None:
            _, instances[reader.rows(name)] = np.unique(reader.columns(name)[field], return_inverse=True)
    kinds = np.unique(sources, return_inverse=True)[1] * (instances.max(initial=0) + 1) + instances
    keys: NDArray[np.int64] = np.unique(kinds, return_inverse=True)[1]
    keys[np.isin(reader.ids, _cumulative_ids())] = -1
    return keys


def _markers(reader: TlogReader, times: NDArray[np.float64]) -> tuple[Marker, ...]:
    markers = []
    for piece in reader.damage:
        before = int(np.searchsorted(reader.offsets, piece.offset)) - 1
        time = float(times[before]) if before >= 0 else 0.0
        markers.append(Marker(time, f"{piece.length} bytes damaged: {piece.what}"))
    for row in reader.backward.tolist():
        step = (int(reader.times[row]) - int(reader.times[row - 1])) / 1e6
        markers.append(Marker(float(times[row]), f"recording clock stepped by {step:.3f} s"))
    return tuple(sorted(markers, key=lambda marker: marker.time))
