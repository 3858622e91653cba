"""The vehicle's side of the command protocol: COMMAND_LONG, COMMAND_INT and COMMAND_CANCEL.

https://mavlink.io/en/services/command.html

A repeated command is answered again, but not executed again. A command counts as repeated if it has the same content,
and either a confirmation above 0 soon afterwards, or an older (or the same) sequence number. The wire allows no better
test.

A command that takes time is answered with IN_PROGRESS until its end. Only one request for such a command runs at a
time: repetitions by its sender are answered with the progress, any other request for it is TEMPORARILY_REJECTED. Only
its sender may cancel it.
"""

from __future__ import annotations

import struct
from collections.abc import Callable, Container
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.engines.base import DUPLICATE_WINDOW, REORDER_WINDOW, Server, TransitionTable, drop_oldest, fire
from protocol.engines.server.replies import command_ack
from protocol.errors import LocalProtocolError
from protocol.events import CommandCancelRequested, CommandRefused, CommandRequested
from protocol.units import coordinates
from protocol.wire.message import Message, Peer, addressed_to

UNKNOWN_PROGRESS = 255
MAX_RETRY_INTERVAL = 1.5  # [s] clients wait at most this long before they repeat a command
ANSWER_LIFETIME = 30.0  # [s] answers are remembered for so long
MAX_ANSWERS = 256  # remembered

COMMAND_SERVER_TRANSITIONS: TransitionTable = {
    ("requested", "progress"): "working",
    ("requested", "final"): "answered",
    ("working", "progress"): "working",
    ("working", "cancel"): "cancelling",
    ("working", "final"): "answered",
    ("cancelling", "progress"): "cancelling",  # it cannot be stopped at once, or not at all
    ("cancelling", "cancel"): "cancelling",
    ("cancelling", "final"): "answered",
}
_UNFINISHED = frozenset({"working", "cancelling"})

Refuse = Callable[[int, int | None, tuple[float, ...]], str]
_Content = tuple[int, int, int, int | None, bytes]  # system, component, command, frame, parameters


@dataclass(slots=True, kw_only=True)
class _Record:
    number: int
    content: _Content
    peer: Peer
    sequence: int
    confirmation: int
    heard: float
    state: str = "requested"
    ack: Message | None = None
    was_in_progress: bool = False

    @property
    def command(self) -> int:
        return self.content[2]


class CommandServer(Server):
    """Turns commands into ``CommandRequested`` and acknowledgements into COMMAND_ACK for the requester.

    Commands that the engine refuses itself become ``CommandRefused``: the requester got its COMMAND_ACK, and the owner
    may add a text. After a ``CommandCancelRequested`` the owner acknowledges with CANCELLED, or with the result the
    command had.

    Args:
        system: Own system id.
        component: Own component id.
        supported: Known commands (MAV_CMD); all others are answered with UNSUPPORTED.
        repeatable: Those of them that are executed each time they arrive.
        refuse: Why a command in a MAV_FRAME (None: in none) cannot have its parameters, or nothing: it is DENIED.
    """

    handles = frozenset({"COMMAND_LONG", "COMMAND_INT", "COMMAND_CANCEL"})

    def __init__(
        self,
        system: int,
        component: int,
        supported: Container[int],
        repeatable: Container[int] = (),
        refuse: Refuse = lambda _command, _frame, _params: "",
    ) -> None:
        super().__init__()
        self._repeatable, self._refuse_parameters = repeatable, refuse
        self._system, self._component, self._supported = system, component, supported
        self._records: dict[_Content, _Record] = {}
        self._latest: dict[tuple[int, int], _Content] = {}
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
        if reason := self._refuse_parameters(message.command, message.frame if is_int else None, _params(message)):
            self._refuse(message.command, mavlink.MAV_RESULT_DENIED, peer, reason)
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
        record.state = fire(COMMAND_SERVER_TRANSITIONS, record.state, "progress" if working else "final")
        record.was_in_progress |= working
        record.heard = now
        record.ack = command_ack(
            record.peer, record.command, result, progress=progress if working else 0, detail=detail
        )
        self._reply(record.peer, record.ack)

    def _running(self, command: int) -> _Record | None:
        running = (r for r in self._records.values() if r.command == command and r.state in _UNFINISHED)
        return next(running, None)

    def _cancel(self, command: int, now: float, peer: Peer) -> None:
        self._forget(now)
        mine = [
            r for r in self._records.values() if r.command == command and r.peer[:2] == peer[:2] and r.was_in_progress
        ]
        record = max(mine, key=lambda r: r.number, default=None)
        if record is None:
            return
        record.peer = peer
        if record.state in _UNFINISHED:
            begun = record.state == "working"
            record.state = fire(COMMAND_SERVER_TRANSITIONS, record.state, "cancel")
            if begun:
                self._events.append(CommandCancelRequested(record.number, command, peer))
        elif record.ack is not None:
            self._reply(peer, record.ack)  # it is over, but its sender does not know yet

    def _refuse(self, command: int, result: int, peer: Peer, reason: str = "") -> None:
        self._reply(peer, command_ack(peer, command, result))
        self._events.append(CommandRefused(command, result, peer, reason))

    def _is_repeated(self, record: _Record, message: Message, now: float, *, is_int: bool) -> bool:
        age = now - record.heard
        if record.state != "answered":
            return True
        behind = (record.sequence - message.get_seq()) & 0xFF
        if behind < 128 and age < (REORDER_WINDOW if behind else DUPLICATE_WINDOW):
            return True
        if is_int:  # it has no confirmation field: only an immediate repetition is recognised
            return age < MAX_RETRY_INTERVAL and self._latest.get(record.peer[:2]) == record.content
        if message.confirmation == 0:
            return False
        lost = max(message.confirmation - record.confirmation, 1)
        return bool(age < MAX_RETRY_INTERVAL * (lost + 1))

    def _answer_again(self, record: _Record, message: Message, now: float, peer: Peer) -> None:
        record.peer, record.heard = peer, now
        if (message.get_seq() - record.sequence) & 0xFF < 128:
            record.sequence = message.get_seq()
        record.confirmation = max(record.confirmation, getattr(message, "confirmation", 0))
        if record.ack is not None:
            self._reply(peer, record.ack)

    def _request(self, content: _Content, message: Message, now: float, peer: Peer) -> None:
        self._count += 1
        confirmation = getattr(message, "confirmation", 0)
        self._records[content] = _Record(
            number=self._count,
            content=content,
            peer=peer,
            sequence=message.get_seq(),
            confirmation=confirmation,
            heard=now,
        )
        self._latest[peer[:2]] = content
        drop_oldest(self._latest, MAX_ANSWERS)
        request = CommandRequested(
            request=self._count, command=message.command, params=_params(message), frame=content[3], peer=peer
        )
        self._events.append(request)

    def _forget(self, now: float) -> None:
        answered = [(c, now - r.heard) for c, r in self._records.items() if r.state == "answered"]
        excess = [c for c, _ in answered[: max(len(self._records) - MAX_ANSWERS + 1, 0)]]
        for content in {*excess, *(c for c, age in answered if age > ANSWER_LIFETIME)}:
            del self._records[content]


def _content(message: Message, peer: Peer, *, is_int: bool) -> _Content:
    """Identity of a request; parameters are compared as bytes because NaN must equal NaN."""
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
