"""The messages of a recording up to where it is played."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.traffic import PRESENT, Heard, MessageKind, mean_rate
from protocol.tlog import TlogReader
from protocol.tlog.message_set import message_class, message_name
from protocol.tlog.reader import Timeline
from protocol.wire.codec import SourceStatistics
from protocol.wire.message import Message, Source

HALF_RANGE = 128  # of sequence numbers: nearer ones are ahead, the others arrived late


class RecordedTraffic:
    """Counts records, by component and message.

    Args:
        reader: The log.
        timeline: Where it is.
    """

    def __init__(self, reader: TlogReader, timeline: Timeline) -> None:
        self._reader, self._timeline = reader, timeline
        self._kinds: dict[MessageKind, tuple[NDArray[np.int64], NDArray[np.float64]]] = {}  # records, times [s]
        self._sources: dict[Source, tuple[NDArray[np.int64], NDArray[np.int64]]] = {}  # records, lost before each
        self._is_indexed = False

    def heard(self, now: float) -> list[Heard]:
        """Every kind of message that was played until now [s], by component and name."""
        self._index()
        played = self._timeline.played
        found = []
        for kind, (rows, times) in self._kinds.items():
            count = int(np.searchsorted(rows, played))
            if not count:
                continue
            first, last = float(times[0]), float(times[count - 1])
            begin = min(count, int(np.searchsorted(times, now - PRESENT)))
            found.append(
                Heard(
                    kind=kind,
                    total=count,
                    rate=(count - begin) / max(1.0, min(PRESENT, now - first)),
                    mean=mean_rate(count, last - first),
                    age=max(0.0, now - last),
                    size=len(self._reader.frame(int(rows[count - 1]))),
                    fields=_fields(int(self._reader.ids[rows[0]])),
                )
            )
        return found

    def losses(self) -> Mapping[Source, SourceStatistics]:
        """Frames by component, counted by their sequence numbers."""
        self._index()
        counted = {}
        for source, (rows, lost) in self._sources.items():
            count = int(np.searchsorted(rows, self._timeline.played))
            if count:
                counted[source] = SourceStatistics(received=count, lost=max(0, int(lost[count - 1])))
        return counted

    def last(self, kind: MessageKind) -> Message | None:
        """The last message of a kind that was played."""
        self._index()
        if kind not in self._kinds:
            return None
        rows, _ = self._kinds[kind]
        count = int(np.searchsorted(rows, self._timeline.played))
        return self._reader.decode(int(rows[count - 1])) if count else None

    @property
    def unread(self) -> int:
        """Frames played of messages that no known dialect has."""
        return int((~self._reader.known[: self._timeline.played]).sum())

    def _index(self) -> None:
        """Sort the records by kind, once: a replay without an inspector need not wait for it."""
        if self._is_indexed:
            return
        self._is_indexed = True
        reader = self._reader
        source = reader.systems.astype(np.int64) << 8 | reader.components
        for number in np.unique(source).tolist():
            rows = np.flatnonzero(source == number)
            self._sources[number >> 8, number & 0xFF] = rows, _lost(reader.sequences[rows])
            kinds = reader.ids[rows]
            known = [n for n in np.unique(kinds).tolist() if message_class(n) is not None]
            for name, identity in sorted((message_name(n), n) for n in known):
                own = rows[kinds == identity]
                self._kinds[MessageKind((number >> 8, number & 0xFF), name)] = own, self._timeline.times[own]


def _lost(sequence: NDArray[np.uint8]) -> NDArray[np.int64]:
    """Frames lost until each record of a component, shape (n,); one that arrives late is no longer lost."""
    numbers = sequence.astype(np.int64)
    step = np.zeros_like(numbers)
    step[1:] = (numbers[1:] - numbers[:-1] + HALF_RANGE & 0xFF) - HALF_RANGE
    place = np.cumsum(step)  # from the first one
    is_new = np.zeros(len(place), dtype=bool)
    is_new[np.unique(place, return_index=True)[1]] = True  # one that came again was not lost
    return np.maximum.accumulate(place) + 1 - np.cumsum(is_new & (place >= 0))


def _fields(number: int) -> tuple[str, ...]:
    known = message_class(number)
    return () if known is None else tuple(known.fieldnames)
