"""Asks for what a vehicle sends only to stations that ask: DARKO_*, CONTROL_STATUS and the truth.

One message is requested of each family; the vehicle then sends the whole family. It forgets the request when it
restarts, and when other stations displace this one: a family that falls silent is requested again.
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.events import CommandDone, Event, VehicleFound, VehicleRestarted, VehicleReturned
from protocol.wire.message import Message

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


REQUESTED = (mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE, mavlink.MAVLINK_MSG_ID_CONTROL_STATUS)
SILENCE = 10.0  # after which a message is requested again [s]
APPEARANCES = (VehicleFound, VehicleReturned, VehicleRestarted)  # of a vehicle that remembers no request
FOR_NOW = frozenset({None, mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED})
"""Results after which it makes sense to ask again; None: no answer. A vehicle that has no such message says so."""


class FamilyRequests:
    """Keeps the families coming.

    Args:
        endpoint: Sends the requests.

    Attributes:
        truth: Keeps DARKO_TRUTH coming while it is wanted.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self.truth = TruthRequest(endpoint)
        self._due = dict.fromkeys(REQUESTED, math.inf)  # when each message is requested next [s]
        self._sent: dict[int, int] = {}  # message by number of the request

    def follow(self, event: Event, now: float) -> bool:
        """Take an event of the station; true if it answers a request from here, which nobody else waits for."""
        if self.truth.follow(event, now):
            return True
        if isinstance(event, APPEARANCES):
            self._due = dict.fromkeys(REQUESTED, now)
        if not isinstance(event, CommandDone) or event.request not in self._sent:
            return False
        message_id = self._sent.pop(event.request)
        if self._due[message_id] == math.inf:  # else the vehicle has appeared anew since
            self._due[message_id] = now + SILENCE if event.result in FOR_NOW else math.inf
        return True

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle."""
        self.truth.receive(message, now)
        message_id = message.get_msgId()
        if message_id in self._due and message_id not in self._sent.values():
            self._due[message_id] = now + SILENCE

    def handle_timer(self, now: float) -> None:
        """Send the requests that are due."""
        self.truth.handle_timer(now)
        if not self._endpoint.is_present:
            return
        for message_id in [number for number, due in self._due.items() if now >= due]:
            self._due[message_id] = math.inf
            request = self._endpoint.command(mavlink.MAV_CMD_REQUEST_MESSAGE, float(message_id), 0.0, now=now)
            self._sent[request] = message_id
