"""Events of commands, on both sides, and of operator control, the right to send them."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.events.event import Event
from protocol.wire.message import Peer

__all__ = [
    "CommandCancelRequested",
    "CommandDone",
    "CommandProgress",
    "CommandRefused",
    "CommandRequested",
    "ControlRequested",
    "OperatorChanged",
    "OperatorRefused",
    "OperatorRequested",
]


@dataclass(frozen=True, slots=True)
class CommandProgress(Event):
    """The vehicle is executing a command; ``progress`` in percent, 255 if unknown."""

    request: int
    command: int
    progress: int


@dataclass(frozen=True, slots=True)
class CommandDone(Event):
    """A command has ended; ``result`` is a MAV_RESULT, None if no answer came."""

    request: int
    command: int
    result: int | None
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class CommandRequested(Event):
    """A ground station sent the vehicle a command: answer with ``acknowledge(request, result)``.

    ``params`` are param1..param7. Those of a COMMAND_INT have x and y in degrees (global frames) or metres (local
    frames). ``frame`` is its MAV_FRAME, None for a COMMAND_LONG.
    """

    request: int
    command: int
    params: tuple[float, ...]
    frame: int | None
    peer: Peer

    def param(self, number: int, default: float = math.nan) -> float:
        """Parameter 1..7. Clients leave a parameter out as NaN or as 0: both mean the default."""
        value = self.params[number - 1]
        return default if math.isnan(value) or value == 0.0 else value


@dataclass(frozen=True, slots=True)
class CommandCancelRequested(Event):
    """The sender of a command in progress cancels it: answer ``acknowledge(request, CANCELLED)`` once it is stopped."""

    request: int
    command: int
    peer: Peer


@dataclass(frozen=True, slots=True)
class CommandRefused(Event):
    """The engine refused a command with ``result`` (MAV_RESULT): it is unknown, already running, or too frequent.

    Or a parameter is out of its range; then ``reason`` is a sentence about it.
    """

    command: int
    result: int
    peer: Peer
    reason: str = ""


@dataclass(frozen=True, slots=True)
class OperatorChanged(Event):
    """Another ground station (system id) controls the vehicle now; 0: every station may."""

    system: int
    why: str


@dataclass(frozen=True, slots=True)
class OperatorRefused(Event):
    """A peer tried to control the vehicle while ground station ``holder`` is in control; it was answered."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class OperatorRequested(Event):
    """A peer asks for control; the ground station ``holder``, which has it, was notified."""

    peer: Peer
    holder: int


@dataclass(frozen=True, slots=True)
class ControlRequested(Event):
    """The vehicle notifies this ground station, which is in control, that another one asks for control."""

    system: int
