"""Gusts: coloured noise about the steady wind."""

import math

from sitl.compiled import kernel
from sitl.model.arithmetic import decay
from sitl.model.vectors import Vector

MIN_TURNOVER_SPEED = 1.0  # air that stands still relative to the vehicle still turns over at this speed [m/s]


@kernel
def gust_after(gust: Vector, noise: Vector, rms: float, length: float, airspeed: float, dt: float) -> Vector:
    """The next value of an Ornstein-Uhlenbeck gust on each axis, world NWU [m/s].

    The discretisation is exact: the stationary deviation is ``rms`` at any ``dt``. The correlation time is the
    turbulence length over the airspeed, as in Dryden's model, whose longitudinal spectrum this is.

    Args:
        gust: Gust velocity now, world NWU [m/s].
        noise: Independent unit normals.
        rms: Standard deviation per axis [m/s].
        length: Turbulence length [m].
        airspeed: Speed through the air [m/s].
        dt: Step [s].
    """
    keep = decay(dt * max(airspeed, MIN_TURNOVER_SPEED) / length)
    fresh = rms * math.sqrt(1.0 - keep * keep)
    return Vector(keep * gust.x + fresh * noise.x, keep * gust.y + fresh * noise.y, keep * gust.z + fresh * noise.z)
