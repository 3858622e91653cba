"""A decoded message: who sent it, whom it is for, and where an answer goes."""

from __future__ import annotations

from collections.abc import Hashable
from typing import Any, NamedTuple

from protocol.dialect import mavlink

Message = Any  # any class of the generated dialect
Source = tuple[int, int]  # (system, component)


class Peer(NamedTuple):
    """Sender of a message, and the address for an answer; only the transport interprets ``key``."""

    system: int
    component: int
    key: Hashable = None

    @classmethod
    def of(cls, message: Message, key: Hashable = None) -> Peer:
        """The sender of a decoded message."""
        return cls(*source_of(message), key)


def source_of(message: Message) -> Source:
    """(system, component) that sent a decoded message."""
    return message.get_srcSystem(), message.get_srcComponent()


def target_of(message: Message) -> Source:
    """(system, component) a message is for; 0 is everyone."""
    system = getattr(message, "target_system", 0)
    if message.get_msgId() == mavlink.MAVLINK_MSG_ID_MANUAL_CONTROL:
        system = message.target
    return system, getattr(message, "target_component", 0)


def target_fields(receiver: Source | Peer) -> dict[str, int]:
    """The fields that address a new message to a component."""
    return {"target_system": receiver[0], "target_component": receiver[1]}


def addressed_to(message: Message, system: int, component: int) -> bool:
    """True if a message names this component, its whole system, or no particular receiver (0 is everyone)."""
    target_system = getattr(message, "target_system", 0)
    target_component = getattr(message, "target_component", 0)
    return target_system in {0, system} and target_component in {0, component}
