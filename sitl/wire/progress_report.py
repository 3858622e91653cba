"""Answers in instalments: what a long running command tells the one who asked, until it has ended.

https://mavlink.io/en/services/command.html#long_running_commands
"""

from __future__ import annotations

import math
from collections.abc import Callable

from protocol.dialect import mavlink
from sitl.autopilot.progress import Transition

Acknowledge = Callable[[int, int, float, int], None]  # request, MAV_RESULT, now [s], progress [percent]

EVERY = 0.4  # link time between two of them: QGroundControl gives up after 1.2 s of silence, MAVSDK after 3 s [s]


class ProgressReport:
    """Tells how far the one long running command is. Call ``tell`` whenever something may be sent.

    Args:
        acknowledge: Sends the answer.
    """

    def __init__(self, acknowledge: Acknowledge) -> None:
        self._acknowledge = acknowledge
        self._request = 0
        self._transition: Transition | None = None
        self._due = math.inf

    def follow(self, request: int, transition: Transition, now: float) -> None:
        """A command was begun, and its first answer goes out."""
        self._request, self._transition, self._due = request, transition, now
        self.tell(now)

    def tell(self, now: float) -> None:
        """Answer if it is time for it, or over."""
        transition = self._transition
        if transition is None:
            return
        if transition.end is not None:
            self._transition, self._due = None, math.inf
            self._acknowledge(self._request, transition.end.result, now, 0)
        elif now >= self._due:
            self._due = now + EVERY
            self._acknowledge(self._request, mavlink.MAV_RESULT_IN_PROGRESS, now, transition.percent)
