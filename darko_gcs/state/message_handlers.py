"""Tables of message handlers: each handler registers itself beside its code."""

from __future__ import annotations

from collections.abc import Callable, Collection

from darko_gcs.state.snapshot import Snapshot
from protocol.wire.message import Message

MAX_LATITUDE_E7, MAX_LONGITUDE_E7 = 89_0000000, 180_0000000  # [1e-7 deg]


def is_on_map(latitude: int, longitude: int) -> bool:
    """True for a place that a map can show [1e-7 deg]."""
    return abs(latitude) <= MAX_LATITUDE_E7 and abs(longitude) <= MAX_LONGITUDE_E7


def is_fix(latitude: int, longitude: int) -> bool:
    """False for 0, 0, which vehicles tell until they know their place [1e-7 deg]."""
    return latitude != 0 or longitude != 0


Handler = Callable[[Snapshot, Message, float], Snapshot]  # snapshot before, message, arrival [s] -> snapshot after


class HandlerTable:
    """Handlers by message name."""

    def __init__(self) -> None:
        self._handlers: dict[str, Handler] = {}

    def handles(self, name: str) -> Callable[[Handler], Handler]:
        """Decorator: register a function as the handler of a message."""

        def register(handler: Handler) -> Handler:
            self._handlers[name] = handler
            return handler

        return register

    def add(self, other: HandlerTable) -> None:
        """Take over the handlers of another table."""
        self._handlers |= other._handlers

    @property
    def names(self) -> Collection[str]:
        """Messages that have a handler."""
        return self._handlers.keys()

    def get(self, name: str) -> Handler | None:
        """The handler of a message, or None."""
        return self._handlers.get(name)
