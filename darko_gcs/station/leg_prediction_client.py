"""Asks the vehicle what legs would take: one DARKO_LEGS_REQUEST at a time, again if there is no answer.

Only this project's vehicles answer. One that does not is asked again after a rest, in case it is busy.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from darko_gcs.state.values import LegChain, LegPrediction
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.ranges import LEGS_AHEAD
from protocol.wire.message import Message, Source, target_fields

PREDICTION_TIMEOUT = 0.5  # after which a request is repeated [s]
MAX_REPETITIONS = 3
REST = 10.0  # after a vehicle did not answer [s]
FRESH_TIME = 10.0  # of an answer: the wind changes [s]


class LegPredictionClient:
    """Keeps the predictions that are wanted.

    Args:
        endpoint: Sends the requests.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._wanted: tuple[LegChain, ...] = ()
        self._answered: dict[LegChain, float] = {}  # and when [s]
        self._request = 0
        self._asked: LegChain | None = None
        self._deadline, self._repetitions = -math.inf, 0
        self.known: Mapping[LegChain, tuple[LegPrediction, ...]] = {}

    def want(self, chains: Sequence[LegChain], now: float) -> None:
        """Have these answered, and no others; an answer that is known stays until there is a newer one."""
        self._wanted = tuple(dict.fromkeys(chains))
        if any(chain not in self._wanted for chain in self.known):
            self.known = {chain: self.known[chain] for chain in self._wanted if chain in self.known}
            self._answered = {chain: self._answered[chain] for chain in self.known}
        self.handle_timer(now)

    def forget(self) -> None:
        """The vehicle restarted: what it said may hold no more."""
        self.known, self._answered, self._asked, self._deadline = {}, {}, None, -math.inf

    def receive(self, message: Message, now: float) -> None:
        """Take a message of the vehicle."""
        chain = self._asked
        if message.get_type() != "DARKO_LEGS_PREDICTION" or chain is None or message.request != self._request:
            return
        if message.count != len(chain.asked):
            return
        columns = (message.hover_time, message.hover_energy, message.forward_time, message.forward_energy)
        legs = zip(*columns, message.way, message.reason, strict=True)
        self._asked, self._deadline = None, -math.inf
        self._answered[chain] = now
        self.known = {**self.known, chain: tuple(LegPrediction(*leg) for leg in legs)[: message.count]}
        self.handle_timer(now)

    def handle_timer(self, now: float) -> None:
        """Ask what is not known or old, or again."""
        if now < self._deadline or not self._endpoint.is_present or self._endpoint.vehicle is None:
            return
        if self._asked is not None:
            if self._asked in self._wanted and self._repetitions < MAX_REPETITIONS:
                self._repetitions += 1
                self._send(self._asked, self._endpoint.vehicle, now)
                return
            given_up, self._asked = self._asked in self._wanted, None
            if given_up:
                self._deadline = now + REST
                return
        due = [c for c in self._wanted if now - self._answered.get(c, -math.inf) >= FRESH_TIME]
        if due:
            self._request = (self._request + 1) % 2**32
            self._asked, self._repetitions = min(due, key=lambda c: self._answered.get(c, -math.inf)), 0
            self._send(self._asked, self._endpoint.vehicle, now)

    def _send(self, chain: LegChain, vehicle: Source, now: float) -> None:
        rest = LEGS_AHEAD + 1 - len(chain.points)
        x, y, z = ([*(point[axis] for point in chain.points), *[math.nan] * rest] for axis in range(3))
        optional = (chain.hover_speed, chain.airspeed, chain.heading)
        hover_speed, airspeed, heading = (math.nan if value is None else value for value in optional)
        self._deadline = now + PREDICTION_TIMEOUT
        self._endpoint.send(
            mavlink.MAVLink_darko_legs_request_message(
                **target_fields(vehicle),
                request=self._request,
                hover_speed=hover_speed,
                airspeed=airspeed,
                heading=heading,
                x=x,
                y=y,
                z=z,
                count=len(chain.asked),
                asked=[*map(int, chain.asked), *[0] * (LEGS_AHEAD - len(chain.asked))],
            )
        )
