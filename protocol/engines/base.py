"""Base of all engines: outboxes, transition tables, and a limit on the memory that unknown peers can occupy."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, Generic, NamedTuple, TypeVar

from protocol.errors import LocalProtocolError
from protocol.wire.message import Message, Peer

__all__ = ["Engine", "Outgoing", "Server", "TransitionTable", "drop_oldest", "fire"]

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
