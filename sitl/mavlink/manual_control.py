"""MANUAL_CONTROL: decoding of a pilot's sticks (https://mavlink.io/en/messages/common.html#MANUAL_CONTROL)."""

from __future__ import annotations

import math

from protocol.wire.message import Message
from sitl.autopilot.manual import Sticks

FULL_SCALE = 1000  # value of an axis at its end
DEAD_ZONE = 0.05  # share of an axis about its centre that counts as centred
UNUSED_AXIS = 0x7FFF  # value of an axis that the sender does not have


def sticks_of(message: Message) -> Sticks | None:
    """The sticks of a MANUAL_CONTROL; None if an axis is out of range.

    x is forward, y to the right and r clockwise, -1000..1000; z is the throttle, 0..1000 with the centre at 500.
    """
    x, y, z, r = (0 if value == UNUSED_AXIS else value for value in (message.x, message.y, message.z, message.r))
    if message.z == UNUSED_AXIS:
        z = FULL_SCALE // 2
    if max(abs(x), abs(y), abs(r)) > FULL_SCALE or not 0 <= z <= FULL_SCALE:
        return None
    return Sticks(
        forward=_without_dead_zone(x / FULL_SCALE),
        right=_without_dead_zone(y / FULL_SCALE),
        up=_without_dead_zone(2.0 * z / FULL_SCALE - 1.0),
        clockwise=_without_dead_zone(r / FULL_SCALE),
    )


def _without_dead_zone(value: float) -> float:
    return math.copysign(max(0.0, abs(value) - DEAD_ZONE) / (1.0 - DEAD_ZONE), value)
