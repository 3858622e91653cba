"""COMMAND_LONG, COMMAND_INT and COMMAND_CANCEL from the asking side.

https://mavlink.io/en/services/command.html
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.base import Engine, Patience, Table, addressed_to, fire
from protocol.events import CommandDone, CommandProgress

__all__ = ["TRANSITIONS", "CommandClient"]

TIMEOUT = 0.7  # [s] until a command is sent again
RETRIES = 5
PROGRESS_TIMEOUT = 3.0  # [s] an IN_PROGRESS buys

TRANSITIONS: Table = {
    ("queued", "send"): "waiting",
    ("waiting", "retry"): "waiting",
    ("waiting", "progress"): "working",
    ("waiting", "ack"): "done",
    ("waiting", "give_up"): "done",
    ("working", "progress"): "working",
    ("working", "retry"): "waiting",
    ("working", "ack"): "done",
    ("queued", "cancel"): "done",
    ("waiting", "cancel"): "cancelling",
    ("working", "cancel"): "cancelling",
    ("cancelling", "retry"): "cancelling",
    ("cancelling", "progress"): "cancelling",
    ("cancelling", "ack"): "done",
    ("cancelling", "give_up"): "done",
    ("queued", "abandon"): "done",
    ("waiting", "abandon"): "done",
    ("working", "abandon"): "done",
    ("cancelling", "abandon"): "done",
}


@dataclass(slots=True)
class _Request:
    number: int
    message: Message
    patience: Patience
    state: str = "queued"


class CommandClient(Engine[Message]):
    """Commands with retries, and their cancelling.

    Different commands run side by side. One command number runs once at a time, because COMMAND_ACK names
    nothing but that number: further requests for it queue up.
    """

    def __init__(self, system: int, component: int, *, timeout: float = TIMEOUT, retries: int = RETRIES) -> None:
        super().__init__()
        self._system, self._component = system, component
        self._waits: Sequence[float] = (timeout,) * (retries + 1)
        self._requests: list[_Request] = []
        self._count = 0

    @property
    def is_busy(self) -> bool:
        """True while a command has no final answer."""
        return bool(self._requests)

    def send(self, message: Message, now: float, *, timeout: float | None = None) -> int:
        """Send a COMMAND_LONG or COMMAND_INT until it is answered; returns its number in events."""
        self._count += 1
        waits = self._waits if timeout is None else (timeout,) * len(self._waits)
        self._requests.append(_Request(self._count, message, Patience(waits)))
        self._send_queued(now)
        return self._count

    def request_cancel(self, number: int, now: float) -> None:
        """Have the vehicle stop what a command began: COMMAND_CANCEL until the command has its final answer.

        That answer is CANCELLED, or what it ended with before it could be stopped. One that was not sent yet never
        is. Nothing happens if the command is over.
        """
        request = next((r for r in self._requests if r.number == number), None)
        if request is None:
            return
        if request.state == "queued":
            self._finish(request, "cancel", mavlink.MAV_RESULT_CANCELLED, "CANCELLED", now)
        elif request.state != "cancelling":
            request.state = fire(TRANSITIONS, request.state, "cancel")
            request.patience.start(now)
            self._out.append(_cancel(request.message))

    def cancel(self, reason: str) -> None:
        """Give up on everything, for example because the vehicle is lost; it is told nothing."""
        for request in self._requests:
            request.state = fire(TRANSITIONS, request.state, "abandon")
            self._events.append(CommandDone(request.number, request.message.command, None, reason))
        self._requests.clear()

    def receive(self, message: Message, now: float) -> None:
        """Take a COMMAND_ACK; one that answers nothing asked here is ignored."""
        if message.get_type() != "COMMAND_ACK" or not addressed_to(message, self._system, self._component):
            return
        request = self._running(message.command)
        if request is None:
            return
        if message.result == mavlink.MAV_RESULT_IN_PROGRESS:
            request.state = fire(TRANSITIONS, request.state, "progress")
            if request.state == "cancelling":
                request.patience.renew()
            else:
                request.patience.extend(now + PROGRESS_TIMEOUT)
            self._events.append(CommandProgress(request.number, message.command, message.progress))
            return
        self._finish(request, "ack", message.result, _result_name(message.result), now)

    def next_deadline(self) -> float:
        """When the next command must be sent again or given up."""
        return min((r.patience.deadline for r in self._requests), default=float("inf"))

    def handle_timer(self, now: float) -> None:
        """Send again what was not answered; confirmation counts the repetitions."""
        for request in [r for r in self._requests if now >= r.patience.deadline]:
            if not request.patience.retry(now):
                self._finish(request, "give_up", None, "no answer", now)
                continue
            request.state = fire(TRANSITIONS, request.state, "retry")
            if request.state == "cancelling":
                self._out.append(_cancel(request.message))
                continue
            request.message = copy.copy(request.message)
            if request.message.get_type() == "COMMAND_LONG":
                request.message.confirmation = min(request.message.confirmation + 1, 255)
            self._out.append(request.message)

    def _running(self, command: int) -> _Request | None:
        running = (r for r in self._requests if r.state != "queued" and r.message.command == command)
        return next(running, None)

    def _send_queued(self, now: float) -> None:
        for request in self._requests:
            if request.state == "queued" and self._running(request.message.command) is None:
                request.state = fire(TRANSITIONS, request.state, "send")
                request.patience.start(now)
                self._out.append(request.message)

    def _finish(self, request: _Request, trigger: str, result: int | None, reason: str, now: float) -> None:
        request.state = fire(TRANSITIONS, request.state, trigger)
        self._requests.remove(request)
        self._events.append(CommandDone(request.number, request.message.command, result, reason))
        self._send_queued(now)


def _cancel(message: Message) -> Message:
    return mavlink.MAVLink_command_cancel_message(message.target_system, message.target_component, message.command)


def _result_name(result: int) -> str:
    entry = mavlink.enums["MAV_RESULT"].get(result)
    return entry.name.removeprefix("MAV_RESULT_") if entry else f"MAV_RESULT {result}"
