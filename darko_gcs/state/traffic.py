"""Every message of every component: how often, how long ago, how large, how many were lost, and the last one."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterable, Mapping
from typing import NamedTuple, Protocol

from protocol.wire.codec import Codec, SourceStatistics
from protocol.wire.message import Message, Source, source_of

PRESENT = 5.0  # over which the present rate is counted [s]
MAX_COUNTED = 1024  # arrivals that are kept of a kind for its present rate
MAX_KINDS = 2000  # of messages, by component: a flood of invented senders must not take all memory


class MessageKind(NamedTuple):
    """A message of a component."""

    source: Source  # (system, component)
    name: str

    @property
    def key(self) -> str:
        """As a text: "1/1/ATTITUDE"."""
        return f"{self.source[0]}/{self.source[1]}/{self.name}"


class Heard(NamedTuple):
    """Counts and times of a kind of message."""

    kind: MessageKind
    total: int  # messages
    rate: float  # now [1/s]
    mean: float  # since the first one; NaN of a single one [1/s]
    age: float  # of the last one [s]
    size: int  # of the last frame [bytes]
    fields: tuple[str, ...]


class Traffic(Protocol):
    """The messages of a link, or of a recording up to where it is played."""

    def heard(self, now: float) -> Iterable[Heard]:
        """Every kind of message heard until a time [s], by component and name."""

    def losses(self) -> Mapping[Source, SourceStatistics]:
        """Frames by component, counted by their sequence numbers."""

    def last(self, kind: MessageKind) -> Message | None:
        """The last message of a kind."""

    @property
    def unread(self) -> int:
        """Whole frames of messages that no known dialect has."""


MIN_SPAN = 1.0  # from the first message to the last that a mean rate is told of: a burst has none [s]


def mean_rate(count: int, span: float) -> float:
    """Mean rate of some messages, ``span`` seconds from the first to the last [1/s]; NaN of a single one or a burst."""
    return (count - 1) / span if span >= MIN_SPAN else math.nan


class _Arrivals:
    """Of one kind of message."""

    __slots__ = ("count", "first", "last", "message", "times")

    def __init__(self, now: float) -> None:
        self.count, self.first, self.last = 0, now, now
        self.times: deque[float] = deque(maxlen=MAX_COUNTED)
        self.message: Message = None

    def rate(self, now: float) -> float:
        """Messages per second now; of the newest alone if more than are kept came in the window."""
        times = self.times
        while times and times[0] < now - PRESENT:
            times.popleft()
        if not times:
            return 0.0
        begin = times[0] if len(times) == MAX_COUNTED else max(self.first, now - PRESENT)
        return len(times) / max(now - begin, 1.0)


class LiveTraffic:
    """Counts what a link receives.

    Args:
        codec: Of the link: it counts frames that are lost, and those that no dialect knows.
    """

    def __init__(self, codec: Codec) -> None:
        self._codec = codec
        self._kinds: dict[tuple[int, int, str], _Arrivals] = {}

    def take(self, messages: Iterable[Message], now: float) -> None:
        """Take messages that arrived at a time [s]."""
        for message in messages:
            key = (*source_of(message), message.get_type())
            arrivals = self._kinds.get(key)
            if arrivals is None:
                if len(self._kinds) >= MAX_KINDS:
                    continue
                arrivals = self._kinds[key] = _Arrivals(now)
            arrivals.count, arrivals.last = arrivals.count + 1, now
            arrivals.times.append(now)
            arrivals.message = message

    def heard(self, now: float) -> list[Heard]:
        """Every kind of message heard until now [s], by component and name."""
        found = []
        for (system, component, name), arrivals in sorted(self._kinds.items()):
            message = arrivals.message
            found.append(
                Heard(
                    kind=MessageKind((system, component), name),
                    total=arrivals.count,
                    rate=arrivals.rate(now),
                    mean=mean_rate(arrivals.count, arrivals.last - arrivals.first),
                    age=max(0.0, now - arrivals.last),
                    size=len(message.get_msgbuf()),
                    fields=tuple(message.get_fieldnames()),
                )
            )
        return found

    def losses(self) -> Mapping[Source, SourceStatistics]:
        """Frames by component, counted by their sequence numbers."""
        return self._codec.statistics.sources

    def last(self, kind: MessageKind) -> Message | None:
        """The last message of a kind."""
        arrivals = self._kinds.get((*kind.source, kind.name))
        return None if arrivals is None else arrivals.message

    @property
    def unread(self) -> int:
        """Whole frames of messages that no known dialect has."""
        return self._codec.statistics.unknown_id
