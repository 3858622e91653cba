"""What all engines share: peers, outboxes, state tables and resending."""

import math
from abc import ABC, abstractmethod
from collections.abc import Hashable, Mapping, Sequence
from typing import Any, Generic, NamedTuple, TypeVar

from protocol.codec import Message, source_of
from protocol.errors import LocalProtocolError

__all__ = ["Engine", "Outgoing", "Patience", "Peer", "Server", "Table", "addressed_to", "bound", "fire"]

T = TypeVar("T")
Table = Mapping[tuple[str, str], str]  # (state, trigger) -> state


class Peer(NamedTuple):
    """Who sent a message, and where an answer reaches it; ``key`` means something to the transport only."""

    system: int
    component: int
    key: Hashable = None

    @classmethod
    def of(cls, message: Message, key: Hashable = None) -> "Peer":
        """The sender of a decoded message."""
        return cls(*source_of(message), key)


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
        """What must go out now; the outbox is empty afterwards."""
        out, self._out = self._out, []
        return out

    def events(self) -> list[Any]:
        """What happened since the last call, in order."""
        events, self._events = self._events, []
        return events


class Server(Engine[Outgoing], ABC):
    """A vehicle's engine: it answers the peer that asked, or tells everyone."""

    handles: frozenset[str]  # the message types it takes

    @abstractmethod
    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a message; what is not for this engine is ignored."""

    def _reply(self, peer: Peer, message: Message) -> None:
        self._out.append(Outgoing(peer, message))

    def _broadcast(self, message: Message) -> None:
        self._out.append(Outgoing(None, message))


class Patience:
    """One wait after another, each as long as its table says, then none: when to resend, when to give up."""

    def __init__(self, waits: Sequence[float]) -> None:
        self._waits = tuple(waits)
        self._tries = 0
        self.deadline = math.inf

    def start(self, now: float) -> None:
        """The first transmission is on its way."""
        self._tries, self.deadline = 0, now + self._waits[0]

    def extend(self, until: float) -> None:
        """The other side is alive: wait until ``until``, then begin to count again."""
        self._tries, self.deadline = -1, until

    def renew(self) -> None:
        """The other side is alive: begin to count again, at the pace of before."""
        self._tries = 0

    def retry(self, now: float) -> bool:
        """A deadline passed: True when there is one more try, whose wait starts now."""
        self._tries += 1
        if self._tries >= len(self._waits):
            self.stop()
            return False
        self.deadline = now + self._waits[self._tries]
        return True

    def stop(self) -> None:
        """Nothing is waited for."""
        self.deadline = math.inf


def bound(table: dict[Any, Any], most: int) -> None:
    """Drop what was put into a table first until ``most`` entries are left: strangers must not fill the memory."""
    while len(table) > most:
        del table[next(iter(table))]


def fire(table: Table, state: str, trigger: str) -> str:
    """The state after ``trigger``.

    Raises:
        LocalProtocolError: The table has no such entry: this side asked for something out of turn.
    """
    try:
        return table[state, trigger]
    except KeyError:
        raise LocalProtocolError(f"{trigger!r} is not possible while {state}") from None


def addressed_to(message: Message, system: int, component: int) -> bool:
    """True when a message names this component, its whole system, or nobody in particular (0 is everyone)."""
    target_system = getattr(message, "target_system", 0)
    target_component = getattr(message, "target_component", 0)
    return target_system in {0, system} and target_component in {0, component}
