"""The ground station's side of the command protocol: COMMAND_LONG, COMMAND_INT and COMMAND_CANCEL.

https://mavlink.io/en/services/command.html
"""

from __future__ import annotations

import copy
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.engines.base import Engine, RetryPolicy, TransitionTable, fire
from protocol.events import CommandDone, CommandProgress
from protocol.names import enum_name
from protocol.wire.message import Message, addressed_to

COMMAND_TIMEOUT = 0.7  # [s] until a command is sent again
MAX_RETRIES = 5
PROGRESS_TIMEOUT = 3.0  # [s] until a command is sent again after IN_PROGRESS

COMMAND_CLIENT_TRANSITIONS: TransitionTable = {
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
    retry: RetryPolicy
    state: str = "queued"


class CommandClient(Engine[Message]):
    """Sends commands with retries, and cancels them.

    Different commands run side by side. Of one command number only one request runs at a time, because COMMAND_ACK
    contains only that number: further requests for it wait in a queue.
    """

    def __init__(
        self, system: int, component: int, *, timeout: float = COMMAND_TIMEOUT, retries: int = MAX_RETRIES
    ) -> None:
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
        """Send a COMMAND_LONG or COMMAND_INT until it is answered; returns the request's number in events."""
        self._count += 1
        waits = self._waits if timeout is None else (timeout,) * len(self._waits)
        self._requests.append(_Request(self._count, message, RetryPolicy(waits)))
        self._send_queued(now)
        return self._count

    def request_cancel(self, number: int, now: float) -> None:
        """Ask the vehicle to stop a command: send COMMAND_CANCEL until the command has its final answer.

        That answer is CANCELLED, or the result if the command ended earlier. A command that waits in the queue is
        removed from it. Nothing happens if the command is over.
        """
        request = next((r for r in self._requests if r.number == number), None)
        if request is None:
            return
        if request.state == "queued":
            self._finish(request, "cancel", mavlink.MAV_RESULT_CANCELLED, "CANCELLED", now)
        elif request.state != "cancelling":
            request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, "cancel")
            request.retry.start(now)
            self._out.append(_cancel(request.message))

    def cancel(self, reason: str) -> None:
        """End all requests without a message to the vehicle, for example because it is lost."""
        for request in self._requests:
            request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, "abandon")
            self._events.append(CommandDone(request.number, request.message.command, None, reason))
        self._requests.clear()

    def receive(self, message: Message, now: float) -> None:
        """Take a COMMAND_ACK; one without a request is ignored."""
        if message.get_type() != "COMMAND_ACK" or not addressed_to(message, self._system, self._component):
            return
        request = self._running(message.command)
        if request is None:
            return
        if message.result == mavlink.MAV_RESULT_IN_PROGRESS:
            request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, "progress")
            if request.state == "cancelling":
                request.retry.renew()
            else:
                request.retry.extend(now + PROGRESS_TIMEOUT)
            self._events.append(CommandProgress(request.number, message.command, message.progress))
            return
        self._finish(request, "ack", message.result, enum_name("MAV_RESULT", message.result), now)

    def next_deadline(self) -> float:
        """Link time at which the next command must be sent again, or fails [s]."""
        return min((r.retry.deadline for r in self._requests), default=float("inf"))

    def handle_timer(self, now: float) -> None:
        """Send unanswered commands again; their confirmation field counts the repetitions."""
        for request in [r for r in self._requests if now >= r.retry.deadline]:
            if not request.retry.retry(now):
                self._finish(request, "give_up", None, "no answer", now)
                continue
            request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, "retry")
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
                request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, "send")
                request.retry.start(now)
                self._out.append(request.message)

    def _finish(self, request: _Request, trigger: str, result: int | None, reason: str, now: float) -> None:
        request.state = fire(COMMAND_CLIENT_TRANSITIONS, request.state, trigger)
        self._requests.remove(request)
        self._events.append(CommandDone(request.number, request.message.command, result, reason))
        self._send_queued(now)


def _cancel(message: Message) -> Message:
    return mavlink.MAVLink_command_cancel_message(message.target_system, message.target_component, message.command)
