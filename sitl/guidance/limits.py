"""Limits of flight: speeds and rates within which guidance makes references."""

from __future__ import annotations

import math

from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED

__all__ = [
    "MAX_AIRSPEED",
    "MAX_CENTRIPETAL",
    "MAX_HEADING_RATE",
    "MAX_HEADING_STEP",
    "MAX_HOVER_CLIMB",
    "MAX_HOVER_DESCENT",
    "MAX_HOVER_TURN_RATE",
    "MIN_AIRSPEED",
    "MIN_HOLD_HEIGHT",
]

MAX_HOVER_CLIMB, MAX_HOVER_DESCENT = 2.5, 2.0  # vertical speeds of the hover [m/s]
MAX_HOVER_TURN_RATE = math.radians(20.0)  # of the heading: the hover laws follow no faster turn evenly [rad/s]
MAX_HEADING_RATE = math.radians(30.0)  # at which a step of the wanted heading is turned [rad/s]
MAX_HEADING_STEP = math.radians(45.0)  # but for steps that a pilot or program steers, up to this [rad]
MIN_HOLD_HEIGHT = 1.5  # nothing moves sideways lower than this, and no hold is flown lower [m]
MAX_CENTRIPETAL = 5.0  # lateral acceleration on a circle [m/s2]
