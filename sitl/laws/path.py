"""Paths of forward flight: straight legs and circles, and where on them the line of sight points.

A path is what the line-of-sight law follows; a position, velocity or course set-point becomes one of them. World
frame NWU, SI units.
"""

import math
from typing import NamedTuple

from numba import njit

from sitl.model.airframe import Array

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
    level: float  # its last metres are flown without a slope [m]
    low: float  # and so far below its end, which the climbing stop takes back [m]


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
def aim(path: Path, p: Array, speed: float) -> tuple[float, float]:
    """Unit vector of the line of sight, level, world north and west: to the point of a leg that lies ahead.

    Args:
        path: What is followed.
        p: Where the vehicle is, (3,) [m].
        speed: Over the ground [m/s].
    """
    ahead = max(TIME_AHEAD * speed, LEAST_AHEAD)
    if path.kind == CIRCLE:
        return _along_circle(path, p, 0.5 * ahead)
    along, length, _ = progress(path, p)
    share = (along + ahead) / length if length > 0.0 else 1.0  # beyond its end the leg goes on
    dx = path.start[0] + share * (path.end[0] - path.start[0]) - p[0]
    dy = path.start[1] + share * (path.end[1] - path.start[1]) - p[1]
    size = math.hypot(dx, dy)
    return (dx / size, dy / size) if size > 1e-6 else (0.0, 0.0)


@njit(cache=True)
def height(path: Path, p: Array) -> tuple[float, float]:
    """Altitude of the path beside the vehicle [m], and its slope there."""
    if path.kind == CIRCLE:
        return path.start[2], 0.0
    along, length, _ = progress(path, p)
    sloping = max(length - path.level, 1.0)
    share = along / sloping
    if share <= 0.0 or share >= 1.0:
        return (path.start[2] if share <= 0.0 else path.end[2] - path.low), 0.0
    climb = path.end[2] - path.low - path.start[2]
    return path.start[2] + share * climb, climb / sloping


@njit(cache=True)
def _along_circle(path: Path, p: Array, ahead: float) -> tuple[float, float]:
    """The tangent beside the vehicle, turned towards the circle by what it is off it."""
    x, y = p[0] - path.start[0], p[1] - path.start[1]
    sense = math.copysign(1.0, path.radius)
    off = math.hypot(x, y) - abs(path.radius)
    course = math.atan2(y, x) + sense * (0.5 * math.pi + math.atan(off / ahead))
    return math.cos(course), math.sin(course)


@njit(cache=True)
def cross_track(path: Path, p: Array) -> float:
    """Horizontal distance from the path, positive to its left [m]."""
    if path.kind == CIRCLE:
        away = math.hypot(p[0] - path.start[0], p[1] - path.start[1]) - abs(path.radius)
        return -math.copysign(away, path.radius) if away >= 0.0 else math.copysign(-away, path.radius)
    return progress(path, p)[2]
