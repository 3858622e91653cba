"""OBSTACLE_DISTANCE from range finders, companions and stations: handed to the autopilot's failsafe.

https://mavlink.io/en/messages/common.html#OBSTACLE_DISTANCE
"""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.wire.message import Message, source_of
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.safety.live_obstacles import scan_of
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.handlers import on_message

UNUSED = 0xFFFF  # an element that says nothing
BY_HEADING = frozenset({mavlink.MAV_FRAME_BODY_FRD})
BY_NORTH = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_LOCAL_NED})


class ObstacleService:
    """Takes what sensors see about the vehicle.

    Args:
        autopilot: Stops before it.
        broadcast: Tells everyone why a message is refused.
    """

    def __init__(self, autopilot: Autopilot, broadcast: Broadcast) -> None:
        self._autopilot, self._broadcast = autopilot, broadcast

    @on_message("OBSTACLE_DISTANCE")
    def take_distances(self, message: Message) -> None:
        """Distances in directions round the vehicle."""
        if reason := self._hand_over(message):
            self._broadcast.complain(f"OBSTACLE_DISTANCE refused: {reason}")

    def _hand_over(self, message: Message) -> str:
        if message.frame not in BY_HEADING | BY_NORTH:
            return f"frame {message.frame} is not supported"
        step = message.increment_f if message.increment_f > 0.0 else float(message.increment)
        if not (0.0 < step <= 360.0 and math.isfinite(message.angle_offset)):
            return f"directions {step:g} deg apart from {message.angle_offset:g} deg"
        distances = [_metres(value, message.min_distance, message.max_distance) for value in message.distances]
        scan = scan_of(
            self._autopilot.view,
            distances,
            math.radians(message.angle_offset),
            math.radians(step),
            by_heading=message.frame in BY_HEADING,
        )
        source = (*source_of(message), message.sensor_type)
        return "" if self._autopilot.failsafes.obstacles.take(source, scan) else "too many sensors"


def _metres(value: int, nearest: int, farthest: int) -> float:
    """A distance of the message [cm] in metres; infinite where nothing was seen."""
    if value == UNUSED or value > farthest or value < nearest:
        return math.inf
    return 0.01 * value
