"""Other aircraft on the link, told by FOLLOW_TARGET or their own GLOBAL_POSITION_INT: what a flight plan may follow.

https://mavlink.io/en/messages/common.html#FOLLOW_TARGET
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.ranges.item_ranges import ALTITUDE
from protocol.wire.message import Message, source_of
from sitl.autopilot.autopilot import Autopilot
from sitl.mavlink.handlers import on_message

DEGREES, METRES, METRES_PER_SECOND = 1e-7, 1e-3, 1e-2  # of the integers on the wire
MAX_AIRCRAFT_SPEED = 300.0  # that is believed of an aircraft [m/s]


class TrafficService:
    """Keeps where other systems are.

    Args:
        autopilot: Whose plan may follow them.
    """

    def __init__(self, autopilot: Autopilot) -> None:
        self._autopilot = autopilot

    @on_message("FOLLOW_TARGET")
    def take_target(self, message: Message) -> None:
        """A system tells where it is, to be followed."""
        self._take(message, message.alt, message.vel)

    @on_message("GLOBAL_POSITION_INT")
    def take_position(self, message: Message) -> None:
        """An aircraft streams where it is."""
        velocity = [METRES_PER_SECOND * v for v in (message.vx, message.vy, message.vz)]
        self._take(message, METRES * message.alt, velocity)

    def _take(self, message: Message, altitude: float, velocity: Sequence[float]) -> None:
        lat, lon = DEGREES * message.lat, DEGREES * message.lon
        if abs(lat) > 90.0 or abs(lon) > 180.0 or not ALTITUDE.allows(altitude):
            return
        north, east, down = velocity if all(map(math.isfinite, velocity)) else (0.0, 0.0, 0.0)
        if math.hypot(north, east, down) > MAX_AIRCRAFT_SPEED:
            return
        world, now = self._autopilot.world, self._autopilot.view.time
        x, y, _ = world.local(lat, lon, 0.0)
        up = world.up(altitude, above_sea=True)
        self._autopilot.flight_plan.others.take(source_of(message)[0], now, (x, y, up), (north, -east, -down))
