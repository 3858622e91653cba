"""A take-off that arms first: where the vehicle refuses to take off, its propellers are stopped again."""

from __future__ import annotations

from typing import Protocol

from protocol.dialect import mavlink
from protocol.events import CommandDone, Event

REFUSED = "Take-off refused: disarming again"
UNANSWERED = "Take-off without an answer: the vehicle may be armed (d disarms)"


class Commander(Protocol):
    """A station, as far as the take-off needs it."""

    def disarm(self, now: float) -> None:
        """Stop the motors on the ground."""

    def add_line(self, now: float, text: str) -> None:
        """Tell the operator."""


class ArmedTakeOff:
    """Follows the answers to an arming and a take-off that were sent together.

    Args:
        station: Disarms.
    """

    def __init__(self, station: Commander) -> None:
        self._station = station
        self._is_open = False

    def begin(self) -> None:
        """Both were sent."""
        self._is_open = True

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint at a time [s]; an arming that is refused leaves nothing to stop."""
        if not (self._is_open and isinstance(event, CommandDone)):
            return
        is_accepted = event.result == mavlink.MAV_RESULT_ACCEPTED
        if event.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self._is_open = is_accepted
        elif event.command == mavlink.MAV_CMD_NAV_TAKEOFF:
            self._is_open = False
            if event.result is None:
                self._station.add_line(now, UNANSWERED)
            elif not is_accepted:
                self._station.add_line(now, REFUSED)
                self._station.disarm(now)
