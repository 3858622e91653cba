"""Messages of vehicles that are not the station's own: a station alone only says that they are there."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from protocol.dialect import mavlink
from protocol.wire.message import Message, Source, source_of

MAX_OTHER_VEHICLES = 4  # beside the selected one that are reported


class OtherVehicles(Protocol):
    """Takes messages of other vehicles, and may have something to send to them."""

    def take(self, message: Message, now: float) -> None:
        """Take a message of another vehicle."""

    def tick(self, now: float) -> None:
        """Let time pass [s]."""

    def outgoing(self) -> list[bytes]:
        """Datagrams to send now."""


class UnshownVehicles:
    """Reports each other vehicle once.

    Args:
        report: Takes a time [s] and a text for the operator.
    """

    def __init__(self, report: Callable[[float, str], None]) -> None:
        self._report = report
        self._reported: set[Source] = set()

    def take(self, message: Message, now: float) -> None:
        """Report the sender if it is a vehicle that was not reported yet."""
        source = source_of(message)
        is_new = is_vehicle_heartbeat(message) and source not in self._reported
        if is_new and len(self._reported) < MAX_OTHER_VEHICLES:
            self._reported.add(source)
            self._report(now, f"Another vehicle, {source[0]}/{source[1]}, is on the link: it is not shown")

    def tick(self, now: float) -> None:
        """Nothing waits."""

    def outgoing(self) -> list[bytes]:
        """Nothing is sent to them."""
        return []


def is_vehicle_heartbeat(message: Message) -> bool:
    """True for the HEARTBEAT of an autopilot."""
    return bool(message.get_type() == "HEARTBEAT" and message.autopilot != mavlink.MAV_AUTOPILOT_INVALID)
