"""A turn of the heading on the spot, as MAV_CMD_CONDITION_YAW asks for it.

https://mavlink.io/en/messages/common.html#MAV_CMD_CONDITION_YAW
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sitl.guidance.limits import MAX_HEADING_RATE
from sitl.guidance.view import VehicleView

CLOCKWISE, ANTICLOCKWISE = 1.0, -1.0  # of its param3; 0 takes the shorter way
HEADING_REACHED = math.radians(5.0)  # nearer than this the heading is reached [rad]
NO_TURN = math.radians(1.0)  # a turn to where the heading is already is not a whole one [rad]


@dataclass(slots=True)
class YawTurn:
    """Leads the heading to its end at a rate."""

    heading: float  # wanted now [rad]
    remaining: float  # still to be turned [rad]; positive: anticlockwise
    rate: float  # [rad/s]
    time: float  # of the last tick [s]

    @classmethod
    def of(cls, params: Sequence[float], view: VehicleView) -> YawTurn:
        """The turn that the parameters of the command ask for.

        Args:
            params: Its first four: angle [deg], rate [deg/s], direction, whether the angle is relative.
            view: The vehicle as it is now.
        """
        angle, rate, direction, relative = (0.0 if math.isnan(value) else value for value in params)
        if relative == 1.0:
            remaining = -math.radians(angle) * (direction or CLOCKWISE)
        else:
            remaining = math.remainder(-math.radians(angle) - view.heading, math.tau)
            if abs(remaining) > NO_TURN and remaining * direction > 0.0:  # a clockwise turn makes the heading smaller
                remaining -= math.copysign(math.tau, remaining)
        wanted = math.radians(rate) if rate > 0.0 else MAX_HEADING_RATE
        return cls(view.heading, remaining, min(wanted, MAX_HEADING_RATE), view.time)

    def update(self, view: VehicleView) -> float:
        """The heading at this tick [rad]."""
        step = min(self.rate * max(view.time - self.time, 0.0), abs(self.remaining))
        self.time = view.time
        self.heading += math.copysign(step, self.remaining)
        self.remaining -= math.copysign(step, self.remaining)
        return self.heading

    def done(self, view: VehicleView) -> bool:
        """Whether the vehicle has the heading."""
        return self.remaining == 0.0 and abs(math.remainder(view.heading - self.heading, math.tau)) < HEADING_REACHED
