"""MANUAL_CONTROL: decoding of a pilot's sticks (https://mavlink.io/en/messages/common.html#MANUAL_CONTROL)."""

from __future__ import annotations

import math

from protocol.plans.plan import Refusal
from protocol.ranges.message_ranges import STICK_SCALE, UNUSED_AXIS, message_flaw
from protocol.wire.message import Message
from sitl.autopilot.manual import Sticks

DEAD_ZONE = 0.05  # share of an axis about its centre that counts as centred


def sticks_of(message: Message) -> Sticks | Refusal:
    """The sticks of a MANUAL_CONTROL, or the axis that is out of its range.

    x is forward, y to the right and r clockwise, -1000..1000; z is the throttle, 0..1000 with the centre at 500.
    """
    axes = {name: getattr(message, name) for name in "xyzr"}
    if flaw := message_flaw("MANUAL_CONTROL", axes):
        return Refusal(flaw)
    x, y, r = (0 if axes[name] == UNUSED_AXIS else axes[name] for name in "xyr")
    z = STICK_SCALE // 2 if axes["z"] == UNUSED_AXIS else axes["z"]
    return Sticks(
        forward=_without_dead_zone(x / STICK_SCALE),
        right=_without_dead_zone(y / STICK_SCALE),
        up=_without_dead_zone(2.0 * z / STICK_SCALE - 1.0),
        clockwise=_without_dead_zone(r / STICK_SCALE),
    )


def _without_dead_zone(value: float) -> float:
    return math.copysign(max(0.0, abs(value) - DEAD_ZONE) / (1.0 - DEAD_ZONE), value)
