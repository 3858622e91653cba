"""Gusts: coloured noise about the steady wind."""

import math

from numba import njit

from sitl.kernels.parameters import Array

SLOWEST = 1.0  # air that stands still relative to the vehicle still turns over at this speed [m/s]


@njit(cache=True)
def gust_step(gust: Array, noise: Array, rms: float, length: float, airspeed: float, dt: float) -> None:
    """One step of an Ornstein-Uhlenbeck gust on each axis, in place, (3,) [m/s].

    The discretisation is exact: the stationary deviation is ``rms`` at any ``dt``. The correlation time is the
    turbulence length over the airspeed, as in Dryden's model, whose longitudinal spectrum this is.

    Args:
        gust: Gust velocity, world, changed in place, (3,) [m/s].
        noise: Independent unit normals, (3,).
        rms: Standard deviation per axis [m/s].
        length: Turbulence length [m].
        airspeed: Speed through the air [m/s].
        dt: Step [s].
    """
    keep = math.exp(-dt * max(airspeed, SLOWEST) / length)
    fresh = rms * math.sqrt(1.0 - keep * keep)
    for axis in range(3):
        gust[axis] = keep * gust[axis] + fresh * noise[axis]
