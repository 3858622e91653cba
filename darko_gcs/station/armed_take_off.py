"""A take-off or mission that arms first: where the vehicle refuses it, no propellers are left turning.

DarkO checks either while it is disarmed, and then waits for arming: it is asked first, and armed only after its yes.
Others refuse both while they are disarmed: they are armed first, and disarmed again after a refusal.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import Enum, auto
from typing import Protocol

from protocol.dialect import mavlink
from protocol.events import CommandDone, Event

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
NOUNS = {mavlink.MAV_CMD_NAV_TAKEOFF: "Take-off", mavlink.MAV_CMD_MISSION_START: "Mission"}
REFUSED = "refused: disarming again"
UNANSWERED = "without an answer: the vehicle may be armed (d disarms)"
UNASKED = "without an answer: not armed"


class Commander(Protocol):
    """A station, as far as it is needed here."""

    def arm(self, now: float) -> None:
        """Start the motors at idle."""

    def disarm(self, now: float) -> None:
        """Stop the motors on the ground."""

    def add_line(self, now: float, text: str) -> None:
        """Tell the operator."""


class _Step(Enum):
    """Answers that are waited for."""

    NONE = auto()
    ARMED_FIRST = auto()  # to an arming, and then to the command
    ASKED_FIRST = auto()  # to the command, before the arming
    ARMED_LAST = auto()  # to the arming after it


class ArmedTakeOff:
    """Follows the answers to an arming and the command that it is for.

    Args:
        station: Arms and disarms.
    """

    def __init__(self, station: Commander) -> None:
        self._station = station
        self._step, self._command = _Step.NONE, mavlink.MAV_CMD_NAV_TAKEOFF

    def begin(self, command: int, send: Callable[[], None], now: float, *, waits_for_arming: bool) -> None:
        """Arm for a command, and have it carried out.

        Args:
            command: MAV_CMD, one of ``NOUNS``.
            send: Sends it.
            now: [s].
            waits_for_arming: Whether the vehicle checks it while it is disarmed, and begins when it is armed.
        """
        self._command = command
        self._step = _Step.ASKED_FIRST if waits_for_arming else _Step.ARMED_FIRST
        if not waits_for_arming:
            self._station.arm(now)
        send()

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint at a time [s]; an arming that is refused leaves nothing to stop."""
        if not isinstance(event, CommandDone) or self._step is _Step.NONE or event.command not in {ARM, self._command}:
            return
        is_accepted = event.result == mavlink.MAV_RESULT_ACCEPTED
        if self._step is _Step.ASKED_FIRST:
            if event.command == self._command:
                self._arm(event.result, now)
        elif self._step is _Step.ARMED_LAST:
            if event.command == ARM:
                self._end(event.result, now)
        elif event.command == ARM:
            self._step = _Step.ARMED_FIRST if is_accepted else _Step.NONE
        else:
            self._end(event.result, now)

    def _arm(self, result: int | None, now: float) -> None:
        """The command was answered while the vehicle is disarmed."""
        self._step = _Step.ARMED_LAST if result == mavlink.MAV_RESULT_ACCEPTED else _Step.NONE
        if self._step is _Step.ARMED_LAST:
            self._station.arm(now)
        elif result is None:
            self._station.add_line(now, f"{NOUNS[self._command]} {UNASKED}")

    def _end(self, result: int | None, now: float) -> None:
        """The last answer: nothing may be left that begins, or turns, by itself."""
        was_asked, words = self._step is _Step.ARMED_LAST, NOUNS[self._command]
        self._step = _Step.NONE
        if result is None:
            self._station.add_line(now, f"{words} {UNANSWERED}")
        elif result != mavlink.MAV_RESULT_ACCEPTED:
            if not was_asked:
                self._station.add_line(now, f"{words} {REFUSED}")
            self._station.disarm(now)  # what waits for arming is given up by it
