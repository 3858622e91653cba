"""Has a simulation tell the truth (DARKO_TRUTH), which it sends only where it is asked for, as long as it is wanted."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.events import CommandDone, Event, VehicleFound, VehicleRestarted, VehicleReturned
from protocol.wire.message import Message

__all__ = ["TruthRequest"]

INTERVAL = 100_000.0  # between two messages [us]
DISABLED = -1.0  # as an interval
TRUTH_SILENCE = 3.0  # after which it is asked for again [s]


class TruthRequest:
    """Asks, asks again when the truth stops, and has it stopped when nobody looks at it any more.

    Args:
        endpoint: Sends the requests.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._wanted = self._speaks_darko = False
        self._due = math.inf  # when to ask next [s]
        self._sent: set[int] = set()  # numbers of requests without an answer

    def want(self, now: float, *, wanted: bool) -> None:
        """Begin or end."""
        if not wanted and self._wanted and self._endpoint.is_present:
            self._send(DISABLED, now)
        self._wanted, self._due = wanted, now

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle."""
        kind = message.get_type()
        self._speaks_darko = self._speaks_darko or kind == "DARKO_HYBRID_STATE"
        if kind == "DARKO_TRUTH":
            self._due = now + TRUTH_SILENCE

    def follow(self, event: Event, now: float) -> bool:
        """Take an event of the station; true if it answers a request from here, which nobody else waits for."""
        if isinstance(event, VehicleFound | VehicleReturned | VehicleRestarted):
            self._due = now
        if not isinstance(event, CommandDone) or event.request not in self._sent:
            return False
        self._sent.discard(event.request)
        if event.result in {mavlink.MAV_RESULT_UNSUPPORTED, mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_FAILED}:
            self._due = math.inf  # a vehicle that knows no truth
        return True

    def handle_timer(self, now: float) -> None:
        """Send the request that is due; none to a vehicle that does not speak our dialect."""
        if self._wanted and self._speaks_darko and now >= self._due and self._endpoint.is_present:
            self._due = now + TRUTH_SILENCE
            self._send(INTERVAL, now)

    def _send(self, interval: float, now: float) -> None:
        command = mavlink.MAV_CMD_SET_MESSAGE_INTERVAL
        number = float(mavlink.MAVLINK_MSG_ID_DARKO_TRUTH)
        self._sent.add(self._endpoint.command(command, number, interval, now=now))
