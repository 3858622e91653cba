"""A notch that follows the propellers: what their imbalance does to the gyroscope is not for the laws.

A second-order notch (R. Bristow-Johnson's biquad) at the mean speed that the motors are believed to have. Both
propellers lie within its width; below a third of its frequency it delays by about one millisecond.

Propellers that turn faster than half the readings' rate, 15,000 rpm at 500 Hz, are seen at the alias below it, and the
notch is there. One at half the rate itself would have no width, and ring for ever: it keeps a least one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.arithmetic import sine_cosine
from sitl.model.vectors import Vector

QUALITY = 1.5  # centre over width
LEAST_WIDTH = 0.03  # half of it over the centre, for what is read [-]
MIN_SPEED = 100.0  # of the propellers; slower ones do not shake [rad/s]


class Notch(NamedTuple):
    """The last two readings, and what was made of them."""

    last: Vector
    before: Vector
    made: Vector
    made_before: Vector


@kernel
def quiet(value: Vector) -> Notch:
    """A notch that has only met one value."""
    return Notch(value, value, value, value)


@kernel
def notched(value: Vector, notch: Notch, speed: float, dt: float) -> Notch:
    """The notch after another reading; what it makes of it is ``made``.

    Args:
        value: The reading.
        notch: Before it.
        speed: Mean speed of the propellers [rad/s].
        dt: Time between readings [s].
    """
    turned = speed * dt
    seen = turned if turned <= math.pi else abs(2.0 * math.pi - turned)
    if seen < MIN_SPEED * dt or seen > math.pi:
        return quiet(value)
    sine, cosine = sine_cosine(seen)
    width = max(sine * (0.5 / QUALITY), LEAST_WIDTH)
    share = 1.0 / (1.0 + width)
    turn, left = -2.0 * cosine * share, (1.0 - width) * share
    made = Vector(
        share * (value.x + notch.before.x) + turn * (notch.last.x - notch.made.x) - left * notch.made_before.x,
        share * (value.y + notch.before.y) + turn * (notch.last.y - notch.made.y) - left * notch.made_before.y,
        share * (value.z + notch.before.z) + turn * (notch.last.z - notch.made.z) - left * notch.made_before.z,
    )
    return Notch(value, notch.last, made, notch.made)
