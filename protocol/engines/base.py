"""Base of all engines: outboxes, transition tables, limits on unknown peers, timers.

The time until an answer is measured, and the timeout follows it (RFC 6298). Only the answer to a message that was sent
once is measured: after a repetition it is unknown which copy was answered (Karn's algorithm). A timeout that was
doubled stays doubled until the next measurement. A transfer goes on as long as frames of the remote end arrive and the
transfer makes progress now and then, so a bad link is endured and a dead one is noticed.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any, Generic, NamedTuple, TypeVar

from protocol.errors import LocalProtocolError
from protocol.wire.message import Message, Peer

T = TypeVar("T")
TransitionTable = Mapping[tuple[str, str], str]  # (state, trigger) -> state


class Outgoing(NamedTuple):
    """A server's message and its destination; None: everyone."""

    peer: Peer | None
    message: Message


class Engine(Generic[T]):
    """The two outboxes of an engine."""

    def __init__(self) -> None:
        self._out: list[T] = []
        self._events: list[Any] = []

    def messages_to_send(self) -> list[T]:
        """Messages to send now; the outbox is empty afterwards."""
        out, self._out = self._out, []
        return out

    def events(self) -> list[Any]:
        """Events since the last call, in order."""
        events, self._events = self._events, []
        return events


class Server(Engine[Outgoing], ABC):
    """A vehicle's engine: it answers the peer that asked, or sends to everyone."""

    handles: frozenset[str]  # the message types it takes

    @abstractmethod
    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a message; one that is not for this engine is ignored."""

    def _reply(self, peer: Peer, message: Message) -> None:
        self._out.append(Outgoing(peer, message))

    def _broadcast(self, message: Message) -> None:
        self._out.append(Outgoing(None, message))


def drop_oldest(table: dict[Any, Any], limit: int) -> None:
    """Drop the entries that were added first until ``limit`` are left: unknown peers must not fill the memory."""
    while len(table) > limit:
        del table[next(iter(table))]


def fire(table: TransitionTable, state: str, trigger: str) -> str:
    """The state after ``trigger``.

    Raises:
        LocalProtocolError: The table has no such transition: this side asked for something out of turn.
    """
    try:
        return table[state, trigger]
    except KeyError:
        raise LocalProtocolError(f"{trigger!r} is not possible while {state}") from None


INITIAL_TIMEOUT = 1.0  # [s] before the first measurement
MIN_TIMEOUT = 0.25  # [s] the mission protocol recommends it for items,
MAX_TIMEOUT = 1.5  # [s] and this for all other messages
SILENCE_LIMIT = 10.0  # [s] without a single frame: the remote end is gone
STALL_LIMIT = 30.0  # [s] without progress: it is there, but does not answer any more
REORDER_WINDOW = 2.0  # [s] by which a frame may be late; sequence numbers wrap too soon to look further back
DUPLICATE_WINDOW = 0.5  # [s] in which a network may deliver one frame twice
LOSS_THRESHOLD = 3  # answers to later requests after which an earlier request counts as lost


class RttEstimator:
    """Round-trip times and the timeout that follows from them (RFC 6298).

    Args:
        initial: Timeout before the first measurement [s].
    """

    def __init__(self, initial: float = INITIAL_TIMEOUT) -> None:
        self.timeout = initial  # [s] to wait for an answer
        self._mean: float | None = None
        self._deviation = 0.0

    def measure(self, seconds: float) -> None:
        """An answer took this long."""
        if self._mean is None:
            self._mean, self._deviation = seconds, seconds / 2
        else:
            self._deviation += (abs(seconds - self._mean) - self._deviation) / 4
            self._mean += (seconds - self._mean) / 8
        self.timeout = min(max(self._mean + 4 * self._deviation, MIN_TIMEOUT), MAX_TIMEOUT)

    def miss(self) -> None:
        """An answer did not come in time."""
        self.timeout = min(2 * self.timeout, MAX_TIMEOUT)


class Mark(NamedTuple):
    """A moment in the sequence of frames of the remote end."""

    newest: int | None  # number of the last frame before it; None: there was none
    at: float  # [s]


class Remote:
    """The remote end: when its last frame came, in what order it sends, and how long its answers take.

    All engines of one end share it.

    Args:
        initial: Timeout before the first measurement [s].
    """

    def __init__(self, initial: float = INITIAL_TIMEOUT) -> None:
        self.rtt = RttEstimator(initial)
        self.heard = -math.inf  # when its last frame came [s]
        self.newest: int | None = None  # number of its newest frame, counted on beyond 255

    def hear(self, message: Message, now: float) -> None:
        """Any frame of it came."""
        self.heard = now
        number = self.number(message)
        self.newest = number if self.newest is None else max(self.newest, number)

    def number(self, message: Message) -> int:
        """Position of a frame among all it sent, if fewer than half of the 256 sequence numbers were lost in a row."""
        sequence = int(message.get_seq())
        if self.newest is None:
            return sequence
        ahead = (sequence - self.newest) & 0xFF
        return self.newest + ahead - (256 if ahead > 127 else 0)

    def mark(self, now: float) -> Mark:
        """This moment, to recognise later which frames were sent before it."""
        return Mark(self.newest, now)

    def was_sent_before(self, mark: Mark, message: Message, now: float) -> bool:
        """True for a frame sent before a moment: late or a duplicate, it cannot answer a later request."""
        return mark.newest is not None and now - mark.at < REORDER_WINDOW and self.number(message) <= mark.newest


class RetryPolicy:
    """A fixed sequence of waits: when to send again, and when to give up."""

    def __init__(self, waits: Sequence[float]) -> None:
        self._waits = tuple(waits)
        self._tries = 0
        self.deadline = math.inf

    def start(self, now: float) -> None:
        """The message is sent for the first time."""
        self._tries, self.deadline = 0, now + self._waits[0]

    def extend(self, until: float) -> None:
        """The remote end is alive: wait until ``until``, then start the sequence anew."""
        self._tries, self.deadline = -1, until

    def renew(self) -> None:
        """The remote end is alive: start the sequence anew, with the present deadline."""
        self._tries = 0

    def retry(self, now: float) -> bool:
        """The deadline passed: True if there is one more try; its wait starts now."""
        self._tries += 1
        if self._tries >= len(self._waits):
            self.stop()
            return False
        self.deadline = now + self._waits[self._tries]
        return True

    def stop(self) -> None:
        """No deadline any more."""
        self.deadline = math.inf


class _RetryLimit:
    """Lifetime of a transfer: it ends after too long a silence, or without progress."""

    def __init__(self, remote: Remote) -> None:
        self._remote, self._moved = remote, -math.inf

    def progress(self, now: float) -> None:
        self._moved = now

    def is_over(self, now: float) -> bool:
        return now - max(self._moved, self._remote.heard) >= SILENCE_LIMIT or now - self._moved >= STALL_LIMIT


class Retransmission:
    """One message that is repeated until the transfer reaches its next step."""

    def __init__(self, remote: Remote) -> None:
        self.deadline = math.inf  # when to send again
        self.times = 0  # how often the message was sent without an answer
        self._remote, self._limit = remote, _RetryLimit(remote)
        self._sent = 0.0

    def start(self, now: float) -> None:
        """The next step: its message is sent for the first time."""
        self._sent, self.times = now, 1
        self._limit.progress(now)
        self.deadline = now + self._remote.rtt.timeout

    def answer(self, now: float) -> None:
        """The message has been answered."""
        if self.times == 1:
            self._remote.rtt.measure(now - self._sent)
        self.times = 0

    def wait(self, now: float) -> None:
        """More data will come without another request."""
        self._limit.progress(now)
        self.deadline = now + self._remote.rtt.timeout

    def retry(self, now: float) -> bool:
        """The deadline passed: True: send again; False: give up."""
        if self._limit.is_over(now):
            self.stop()
            return False
        self.times += 1
        self._remote.rtt.miss()
        self.deadline = now + self._remote.rtt.timeout
        return True

    def stop(self) -> None:
        """No deadline any more."""
        self.deadline = math.inf


@dataclass(slots=True, kw_only=True)
class _Request:
    order: int  # its position among all requests
    at: float  # when it was last sent [s]
    until: float  # when it is sent again [s]
    times: int
    passed: int = 0  # answers to later requests


class RequestWindow:
    """Numbered parts that are requested several at a time; each is requested again if it does not come.

    Args:
        remote: The end that is asked.
        missing: Numbers of the parts wanted, in this order.
        size: How many requests may be open.
        now: Time [s].
    """

    def __init__(self, remote: Remote, missing: Iterable[int], size: int, now: float) -> None:
        self.missing = dict.fromkeys(missing)
        self._remote, self._limit, self._size = remote, _RetryLimit(remote), size
        self._limit.progress(now)
        self._open: dict[int, _Request] = {}
        self._asked = 0

    @property
    def deadline(self) -> float:
        """Link time at which a part must be requested again [s]."""
        return min((request.until for request in self._open.values()), default=math.inf)

    def take(self, number: int, now: float) -> bool:
        """A part came; False if it was not missing."""
        if number not in self.missing:
            return False
        del self.missing[number]
        self._limit.progress(now)
        request = self._open.pop(number, None)
        if request is not None:
            if request.times == 1:
                self._remote.rtt.measure(now - request.at)
            for other in self._open.values():
                other.passed += other.order < request.order
        return True

    def ask(self, now: float) -> list[int]:
        """Numbers of the parts to request now."""
        late = [number for number, request in self._open.items() if now >= request.until]
        if late:
            self._remote.rtt.miss()
        again = [n for n, request in self._open.items() if n in late or request.passed >= LOSS_THRESHOLD]
        room = max(self._size - len(self._open), 0)
        wanted = again + list(islice((n for n in self.missing if n not in self._open), room))
        for number in wanted:
            times = self._open[number].times if number in self._open else 0
            self._asked += 1
            self._open[number] = _Request(
                order=self._asked, at=now, until=now + self._remote.rtt.timeout, times=times + 1
            )
        return wanted

    def is_over(self, now: float) -> bool:
        """True if the remote end is silent, or answers without progress, for too long."""
        return self._limit.is_over(now)


def precedes(earlier: int, later: int) -> bool:
    """True if the first of two sequence numbers (0..255) of one sender was used before the second."""
    return 0 < (later - earlier) & 0xFF < 128
