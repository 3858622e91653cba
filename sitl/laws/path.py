"""Paths of forward flight: straight legs and circles, and where on them the line of sight points.

A path is what the line-of-sight law follows; a position, velocity or course set-point becomes one of them. World
frame NWU, SI units.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.kernels.parameters import Array

LEG, CIRCLE = 0, 1
TIME_AHEAD = 2.0  # the line of sight meets the path this long ahead [s]
LEAST_AHEAD = 8.0  # but never nearer than this [m]


class Path(NamedTuple):
    """One piece of a forward flight."""

    kind: int  # LEG or CIRCLE
    start: Array  # of a leg, or centre of a circle, (3,) [m]
    end: Array  # of a leg, (3,) [m]
    radius: float  # of a circle [m]; positive: anticlockwise seen from above
    airspeed: float  # wanted [m/s]
    stop: bool  # whether the leg ends at rest
    level: float  # its last metres are flown at the altitude of its end [m]


@njit(cache=True)
def progress(path: Path, p: Array) -> tuple[float, float, float]:
    """Distance flown along a leg, its length, and the horizontal distance left of it, [m]."""
    dx, dy = path.end[0] - path.start[0], path.end[1] - path.start[1]
    length = math.hypot(dx, dy)
    if length < 1e-6:
        return 0.0, 0.0, 0.0
    dx, dy = dx / length, dy / length
    x, y = p[0] - path.start[0], p[1] - path.start[1]
    return x * dx + y * dy, length, y * dx - x * dy


@njit(cache=True)
def aim(path: Path, p: Array, speed: float) -> Array:
    """The point the line of sight goes to, world, (3,) [m].

    Args:
        path: What is followed.
        p: Where the vehicle is, (3,) [m].
        speed: Over the ground [m/s].
    """
    ahead = max(TIME_AHEAD * speed, LEAST_AHEAD)
    if path.kind == CIRCLE:
        return _on_circle(path, p, ahead)
    along, length, _ = progress(path, p)
    if length == 0.0:
        return path.end.copy()
    share = (along + ahead) / length  # beyond the end the leg goes on, level
    point = path.start + share * (path.end - path.start)
    climbed = (along + ahead) / max(length - path.level, 1.0)
    point[2] = path.start[2] + min(max(climbed, 0.0), 1.0) * (path.end[2] - path.start[2])
    return np.asarray(point)


@njit(cache=True)
def _on_circle(path: Path, p: Array, ahead: float) -> Array:
    x, y = p[0] - path.start[0], p[1] - path.start[1]
    r, radius = math.hypot(x, y), abs(path.radius)
    turn = math.copysign(1.0, path.radius)
    bearing = math.atan2(y, x) + turn * min(ahead / radius, 0.5 * math.pi)
    # Aiming at the circle cuts inside it; aiming a little outside follows it. Far away the circle itself is the aim.
    outside = radius / math.cos(min(0.5 * ahead / radius, 1.0)) if r < 2.0 * radius else radius
    return np.array(
        (path.start[0] + outside * math.cos(bearing), path.start[1] + outside * math.sin(bearing), path.start[2])
    )


@njit(cache=True)
def cross_track(path: Path, p: Array) -> float:
    """Horizontal distance from the path, positive to its left [m]."""
    if path.kind == CIRCLE:
        away = math.hypot(p[0] - path.start[0], p[1] - path.start[1]) - abs(path.radius)
        return -math.copysign(away, path.radius) if away >= 0.0 else math.copysign(-away, path.radius)
    return progress(path, p)[2]
