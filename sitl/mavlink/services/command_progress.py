"""Progress of a long running command: IN_PROGRESS again and again, then the result.

https://mavlink.io/en/services/command.html#long_running_commands
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from sitl.autopilot.guided import Transition

INTERVAL = 0.4  # QGroundControl gives up after 1.2 s of silence, MAVSDK after 3 s [s of the link's time]


class CommandProgressReporter:
    """Reports the progress of the one long running command. Call ``report`` whenever something may be sent.

    Args:
        endpoint: Sends the answers.
    """

    def __init__(self, endpoint: VehicleEndpoint) -> None:
        self._endpoint = endpoint
        self._request = 0
        self._transition: Transition | None = None
        self._due = math.inf

    def follow(self, request: int, transition: Transition, now: float) -> None:
        """A command has begun: send its first answer.

        Args:
            request: Number of the request.
            transition: What it began.
            now: The link's time [s].
        """
        self._request, self._transition, self._due = request, transition, now
        self.report(now)

    def report(self, now: float) -> None:
        """Send an answer if one is due or the command has ended."""
        transition = self._transition
        if transition is None:
            return
        if transition.end is not None:
            self._transition, self._due = None, math.inf
            self._endpoint.acknowledge(self._request, transition.end.result, now, progress=0)
        elif now >= self._due:
            self._due = now + INTERVAL
            self._endpoint.acknowledge(self._request, mavlink.MAV_RESULT_IN_PROGRESS, now, progress=transition.percent)
