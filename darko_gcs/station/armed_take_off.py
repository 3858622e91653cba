"""A take-off or mission that arms first: where the vehicle refuses it, its propellers are stopped again."""

from __future__ import annotations

from typing import Protocol

from protocol.dialect import mavlink
from protocol.events import CommandDone, Event

NOUNS = {mavlink.MAV_CMD_NAV_TAKEOFF: "Take-off", mavlink.MAV_CMD_MISSION_START: "Mission"}
REFUSED = "refused: disarming again"
UNANSWERED = "without an answer: the vehicle may be armed (d disarms)"


class Commander(Protocol):
    """A station, as far as it is needed here."""

    def disarm(self, now: float) -> None:
        """Stop the motors on the ground."""

    def add_line(self, now: float, text: str) -> None:
        """Tell the operator."""


class ArmedTakeOff:
    """Follows the answers to an arming and the command that was sent with it.

    Args:
        station: Disarms.
    """

    def __init__(self, station: Commander) -> None:
        self._station = station
        self._is_open, self._command = False, mavlink.MAV_CMD_NAV_TAKEOFF

    def begin(self, command: int = mavlink.MAV_CMD_NAV_TAKEOFF) -> None:
        """Both were sent: the arming, and this MAV_CMD, one of ``NOUNS``."""
        self._is_open, self._command = True, command

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint at a time [s]; an arming that is refused leaves nothing to stop."""
        if not (self._is_open and isinstance(event, CommandDone)):
            return
        is_accepted = event.result == mavlink.MAV_RESULT_ACCEPTED
        if event.command == mavlink.MAV_CMD_COMPONENT_ARM_DISARM:
            self._is_open = is_accepted
        elif event.command == self._command:
            self._is_open, words = False, NOUNS[self._command]
            if event.result is None:
                self._station.add_line(now, f"{words} {UNANSWERED}")
            elif not is_accepted:
                self._station.add_line(now, f"{words} {REFUSED}")
                self._station.disarm(now)
