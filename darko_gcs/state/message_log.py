"""The operator's message log, and the tables by which messages find their handlers."""

from __future__ import annotations

import re
from collections.abc import Callable, Collection, Sequence

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable
from darko_gcs.state.values import LogLine, OpenText
from protocol.dialect import mavlink
from protocol.wire.message import Message, source_of

MAX_LINES = 300  # of the log; the oldest go first


def add_line(s: Snapshot, now: float, severity: int, text: str) -> Snapshot:
    """The snapshot with one more line in its log, without characters that could control a terminal.

    Args:
        s: The snapshot before.
        now: Time of the line, on the caller's clock [s].
        severity: MAV_SEVERITY.
        text: The line.
    """
    return s._replace(
        log=s.log._replace(lines=(*s.log.lines[-MAX_LINES + 1 :], LogLine(now, severity, printable(text))))
    )


BARE_ANSWER = re.compile(r": (temporarily rejected|denied|failed|invalid)$")  # ends a line of ours about a refusal
EXPLAINED = 1.0  # between it and the vehicle's reason [s]


def without_bare_answers(lines: Sequence[LogLine]) -> list[LogLine]:
    """The lines but for refusals whose reason the vehicle tells beside them: where there is little room, that is it."""
    warned = [line for line in lines if line.severity <= mavlink.MAV_SEVERITY_WARNING]
    reasons = [line.time for line in warned if not BARE_ANSWER.search(line.text)]
    bare = [line for line in warned if BARE_ANSWER.search(line.text)]
    explained = [line for line in bare if any(abs(line.time - time) < EXPLAINED for time in reasons)]
    return [line for line in lines if line not in explained]


def add_status_text(s: Snapshot, message: Message, now: float) -> Snapshot:
    """The snapshot after a STATUSTEXT: a new line, or the next chunk of the last line."""
    key, last = (source_of(message)[1], message.id, message.chunk_seq), s.log.open_text
    if message.id and last is not None and key == last[:3] and s.log.lines and s.log.lines[-1] is last.line:
        line = last.line._replace(text=last.line.text + printable(message.text))
        s = s._replace(log=s.log._replace(lines=(*s.log.lines[:-1], line)))
    else:
        s = add_line(s, now, message.severity, message.text)
    return s._replace(
        log=s.log._replace(open_text=OpenText(key[0], message.id, message.chunk_seq + 1, s.log.lines[-1]))
    )


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
