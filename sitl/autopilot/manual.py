"""MANUAL_CONTROL: a pilot's sticks as a velocity of the hover (https://mavlink.io/en/messages/common.html#MANUAL_CONTROL).

Forward and to the right are those of the heading, the belly's side when upright. Sticks in the middle stop the vehicle.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.codec import Message
from sitl.control.reference import Point

FULL = 1000  # what a stick at its end sends
CENTRE = 0.05  # share of a stick that counts as none
TURN_RATE = math.radians(30.0)  # at full stick [rad/s]
UNUSED = 0x7FFF  # of an axis that the sender has not


class Sticks(NamedTuple):
    """Stick positions, each -1..1."""

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    clockwise: float = 0.0

    def velocity(self, heading: float, speed: float, climb: float, descent: float) -> Point:
        """Wanted velocity, world NWU [m/s].

        Args:
            heading: Of the vehicle [rad].
            speed: Level speed at full stick [m/s].
            climb: Upwards at full stick [m/s].
            descent: Downwards at full stick [m/s].
        """
        c, s = math.cos(heading), math.sin(heading)
        length = max(1.0, math.hypot(self.forward, self.right))  # both sticks at their ends are no faster
        ahead, right = speed * self.forward / length, speed * self.right / length
        vertical = self.up * (climb if self.up > 0.0 else descent)
        return (ahead * c + right * s, ahead * s - right * c, vertical)


def sticks_of(message: Message) -> Sticks | None:
    """The sticks of a MANUAL_CONTROL; None if an axis is out of its range.

    x is forward, y to the right and r clockwise, -1000..1000; z is the throttle, 0..1000 with the middle at 500.
    """
    x, y, z, r = (0 if value == UNUSED else value for value in (message.x, message.y, message.z, message.r))
    if message.z == UNUSED:
        z = FULL // 2
    if max(abs(x), abs(y), abs(r)) > FULL or not 0 <= z <= FULL:
        return None
    return Sticks(*(_deadened(value) for value in (x / FULL, y / FULL, 2.0 * z / FULL - 1.0, r / FULL)))


def _deadened(value: float) -> float:
    return math.copysign(max(0.0, abs(value) - CENTRE) / (1.0 - CENTRE), value)
