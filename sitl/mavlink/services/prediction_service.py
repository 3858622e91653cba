"""Predictions of legs that nobody flies yet: their time and energy in the hover and in forward flight."""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.events import PredictionRequested
from protocol.frames import flip
from protocol.limits import LEGS_AHEAD, MAX_AIRSPEED
from protocol.tools.token_bucket import TokenBucket
from protocol.wire.message import Message, target_fields
from sitl.autopilot.autopilot import Autopilot
from sitl.control.reference import Point
from sitl.mavlink.handlers import on_event
from sitl.prediction.chooser import LegEnd
from sitl.prediction.mode_choice import Decision

PREDICTION_RATE = 20.0  # answers a second at most, to all peers: a prediction takes time that the flight needs
MAX_LEG_COORDINATE = 1e5  # of a leg's end [m]


class PredictionService:
    """Answers DARKO_LEGS_REQUEST; one that makes no sense, or comes too soon, is not answered.

    Args:
        autopilot: Knows laws, settings and wind.
        endpoint: Sends the answers.
    """

    def __init__(self, autopilot: Autopilot, endpoint: VehicleEndpoint) -> None:
        self._autopilot, self._endpoint = autopilot, endpoint
        self._bucket = TokenBucket(capacity=PREDICTION_RATE, rate=PREDICTION_RATE)

    @on_event(PredictionRequested)
    def predict(self, event: PredictionRequested, now: float) -> None:
        """A peer asks about legs."""
        autopilot, request = self._autopilot, event.message
        points, asked, chooser = _points(request), request.asked, autopilot.chooser
        if points is None or chooser is None or not self._bucket.take(now):
            return
        settings = autopilot.settings
        if 0.0 < request.hover_speed < settings.hover_speed:
            settings = settings._replace(hover_speed=request.hover_speed)
        if 0.0 < request.airspeed <= MAX_AIRSPEED:
            settings = settings._replace(airspeed=request.airspeed)
        stops = [
            LegEnd(p, LegMode(way) if way in set(LegMode) else LegMode.NONE)
            for p, way in zip(points[1:], asked, strict=False)
        ]
        heading = -request.heading if math.isfinite(request.heading) else autopilot.view.heading
        made = chooser.predict(autopilot.view.wind, heading, points[0], stops, settings)
        self._endpoint.send(_answer(event, made), event.peer)


def _points(message: Message) -> list[Point] | None:
    """Start of the first leg and end of each, world NWU [m]; None if the request makes no sense."""
    if not 1 <= message.count <= LEGS_AHEAD:
        return None
    points = list(zip(message.x, message.y, message.z, strict=True))[: message.count + 1]
    if not all(abs(part) <= MAX_LEG_COORDINATE for point in points for part in point):  # false for NaN too
        return None
    return [flip(point) for point in points]


def _answer(event: PredictionRequested, made: Sequence[Decision]) -> Message:
    def numbers(values: Sequence[float]) -> list[float]:
        return [*values, *[math.nan] * (LEGS_AHEAD - len(values))]

    def entries(values: Sequence[int]) -> list[int]:
        return [*map(int, values), *[0] * (LEGS_AHEAD - len(values))]

    return mavlink.MAVLink_darko_legs_prediction_message(
        **target_fields(event.peer),
        request=event.message.request,
        count=len(made),
        hover_time=numbers([d.hover.time for d in made]),
        hover_energy=numbers([d.hover.energy for d in made]),
        forward_time=numbers([d.forward.time for d in made]),
        forward_energy=numbers([d.forward.energy for d in made]),
        way=entries([d.leg_mode for d in made]),
        reason=entries([d.reason for d in made]),
    )
