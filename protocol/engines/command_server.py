"""COMMAND_LONG, COMMAND_INT and COMMAND_CANCEL from the answering side.

https://mavlink.io/en/services/command.html

A command that arrives again is answered again, not executed again. What counts as "again" is all the wire
allows to know: the same content, and either a confirmation above 0 soon after, or an older (or the same)
sequence number.

A command that takes time is answered with IN_PROGRESS until its end. Of each such command one runs at a time:
its sender's repetitions are told how far it is, any other request for it is TEMPORARILY_REJECTED. Its sender, and
nobody else, may cancel it.
"""

import struct
from collections.abc import Container
from dataclasses import dataclass

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Peer, Server, Table, addressed_to, bound, fire
from protocol.errors import LocalProtocolError
from protocol.events import CommandCancelRequested, CommandRefused, CommandRequested
from protocol.units import coordinates

__all__ = ["TRANSITIONS", "CommandServer"]

UNKNOWN_PROGRESS = 255
RETRY_SPACING = 1.5  # [s] clients wait at most this long before they repeat a command
OVERTAKEN = 2.0  # [s] a frame may be late by; sequence numbers wrap too soon to look further back
SAME_FRAME = 0.5  # [s] in which a network may deliver one frame twice
KEPT, MOST_KEPT = 30.0, 256  # answers are remembered for that long [s], and no more of them [-]

TRANSITIONS: Table = {
    ("requested", "progress"): "working",
    ("requested", "final"): "answered",
    ("working", "progress"): "working",
    ("working", "cancel"): "cancelling",
    ("working", "final"): "answered",
    ("cancelling", "progress"): "cancelling",  # it cannot be stopped at once, or not at all
    ("cancelling", "cancel"): "cancelling",
    ("cancelling", "final"): "answered",
}
UNFINISHED = frozenset({"working", "cancelling"})

Content = tuple[int, int, int, int | None, bytes]  # system, component, command, frame, parameters


@dataclass(slots=True)
class _Record:
    number: int
    content: Content
    peer: Peer
    sequence: int
    confirmation: int
    heard: float
    state: str = "requested"
    ack: Message | None = None
    took_time: bool = False  # was in progress

    @property
    def command(self) -> int:
        return self.content[2]


class CommandServer(Server):
    """Turns commands into ``CommandRequested`` and acknowledgements into COMMAND_ACK for the requester.

    What it refuses by itself is a ``CommandRefused``: the requester has its COMMAND_ACK, words are the owner's. After
    a ``CommandCancelRequested`` the owner acknowledges with CANCELLED, or goes on to the end it comes to.

    Args:
        system: Own system id.
        component: Own component id.
        supported: Commands (MAV_CMD) that are known; all others are answered with UNSUPPORTED.
        repeatable: Of these, the ones that may be executed again whenever they arrive again.
    """

    handles = frozenset({"COMMAND_LONG", "COMMAND_INT", "COMMAND_CANCEL"})

    def __init__(self, system: int, component: int, supported: Container[int], repeatable: Container[int] = ()) -> None:
        super().__init__()
        self._repeatable = repeatable
        self._system, self._component, self._supported = system, component, supported
        self._records: dict[Content, _Record] = {}
        self._latest: dict[tuple[int, int], Content] = {}
        self._count = 0

    def receive(self, message: Message, now: float, peer: Peer) -> None:
        """Take a COMMAND_LONG, COMMAND_INT or COMMAND_CANCEL; other components' commands get no answer."""
        if message.get_type() not in self.handles or not addressed_to(message, self._system, self._component):
            return
        if message.get_type() == "COMMAND_CANCEL":
            self._cancel(message.command, now, peer)
            return
        is_int = message.get_type() == "COMMAND_INT"
        if message.command not in self._supported:
            self._refuse(message.command, mavlink.MAV_RESULT_UNSUPPORTED, peer)
            return
        content = _content(message, peer, is_int=is_int)
        self._forget(now)
        record = self._records.get(content)
        running = self._running(message.command)
        if running is not None and running is not record:
            self._refuse(message.command, mavlink.MAV_RESULT_TEMPORARILY_REJECTED, peer)
            return
        once = record is not None and message.command not in self._repeatable
        if record is not None and once and self._is_repeated(record, message, now, is_int=is_int):
            self._answer_again(record, message, now, peer)
        else:
            self._request(content, message, now, peer)

    def acknowledge(
        self, number: int, result: int, now: float, *, progress: int = UNKNOWN_PROGRESS, detail: int = 0
    ) -> None:
        """Answer request ``number`` with a MAV_RESULT; IN_PROGRESS may be followed by others.

        Raises:
            LocalProtocolError: There is no such request, or it has its final answer.
        """
        record = next((r for r in self._records.values() if r.number == number), None)
        if record is None:
            raise LocalProtocolError(f"no command request {number}")
        working = result == mavlink.MAV_RESULT_IN_PROGRESS
        record.state = fire(TRANSITIONS, record.state, "progress" if working else "final")
        record.took_time |= working
        record.heard = now
        record.ack = _ack(record.command, result, record.peer, progress if working else 0, detail)
        self._reply(record.peer, record.ack)

    def _running(self, command: int) -> _Record | None:
        running = (r for r in self._records.values() if r.command == command and r.state in UNFINISHED)
        return next(running, None)

    def _cancel(self, command: int, now: float, peer: Peer) -> None:
        self._forget(now)
        mine = [r for r in self._records.values() if r.command == command and r.peer[:2] == peer[:2] and r.took_time]
        record = max(mine, key=lambda r: r.number, default=None)
        if record is None:
            return
        record.peer = peer
        if record.state in UNFINISHED:
            begun = record.state == "working"
            record.state = fire(TRANSITIONS, record.state, "cancel")
            if begun:
                self._events.append(CommandCancelRequested(record.number, command, peer))
        elif record.ack is not None:
            self._reply(peer, record.ack)  # it is over, and that is what its sender has not heard

    def _refuse(self, command: int, result: int, peer: Peer) -> None:
        self._reply(peer, _ack(command, result, peer))
        self._events.append(CommandRefused(command, result, peer))

    def _is_repeated(self, record: _Record, message: Message, now: float, *, is_int: bool) -> bool:
        age = now - record.heard
        if record.state != "answered":
            return True
        behind = (record.sequence - message.get_seq()) & 0xFF
        if behind < 128 and age < (OVERTAKEN if behind else SAME_FRAME):
            return True
        if is_int:  # it carries no confirmation: only an immediate repetition can be told
            return age < RETRY_SPACING and self._latest.get(record.peer[:2]) == record.content
        if message.confirmation == 0:
            return False
        lost = max(message.confirmation - record.confirmation, 1)
        return bool(age < RETRY_SPACING * (lost + 1))

    def _answer_again(self, record: _Record, message: Message, now: float, peer: Peer) -> None:
        record.peer, record.heard = peer, now
        if (message.get_seq() - record.sequence) & 0xFF < 128:
            record.sequence = message.get_seq()
        record.confirmation = max(record.confirmation, getattr(message, "confirmation", 0))
        if record.ack is not None:
            self._reply(peer, record.ack)

    def _request(self, content: Content, message: Message, now: float, peer: Peer) -> None:
        self._count += 1
        confirmation = getattr(message, "confirmation", 0)
        self._records[content] = _Record(self._count, content, peer, message.get_seq(), confirmation, now)
        self._latest[peer[:2]] = content
        bound(self._latest, MOST_KEPT)
        frame = content[3]
        self._events.append(CommandRequested(self._count, message.command, _params(message), frame, peer))

    def _forget(self, now: float) -> None:
        answered = [(c, now - r.heard) for c, r in self._records.items() if r.state == "answered"]
        surplus = [c for c, _ in answered[: max(len(self._records) - MOST_KEPT + 1, 0)]]
        for content in {*surplus, *(c for c, age in answered if age > KEPT)}:
            del self._records[content]


def _content(message: Message, peer: Peer, *, is_int: bool) -> Content:
    """What makes two requests the same; NaN equals NaN, so parameters are compared as bytes."""
    fifth, sixth = (message.x, message.y) if is_int else (message.param5, message.param6)
    last = message.z if is_int else message.param7
    first = (message.param1, message.param2, message.param3, message.param4)
    body = struct.pack("<7d", *first, fifth, sixth, last)
    return (peer.system, peer.component, message.command, message.frame if is_int else None, body)


def _params(message: Message) -> tuple[float, ...]:
    first = (message.param1, message.param2, message.param3, message.param4)
    if message.get_type() == "COMMAND_INT":
        return (*first, *coordinates(message.frame, message.x, message.y), message.z)
    return (*first, message.param5, message.param6, message.param7)


def _ack(command: int, result: int, peer: Peer, progress: int = 0, detail: int = 0) -> Message:
    return mavlink.MAVLink_command_ack_message(command, result, progress, detail, peer.system, peer.component)
