"""The reference: set-point made by guidance, handed to the laws as it is, and the geometry of its paths.

World frame NWU, SI units, headings in radians about world z (from north towards west).
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

from sitl.compiled import kernel
from sitl.model.arithmetic import arctangent, sine_cosine
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector, level_norm

LEG, CIRCLE = 0, 1
Point: TypeAlias = tuple[float, float, float]  # where a plain tuple does as well as a Vector
TIME_AHEAD = 2.0  # the line of sight meets the path this long ahead [s]
MIN_AHEAD = 8.0  # but never nearer than this [m]
APPROACH_SPEED = 12.0  # airspeed of an approach without one of its own [m/s]


class Path(NamedTuple):
    """One piece of forward flight: a leg from start to end, or a circle about start."""

    kind: int  # LEG or CIRCLE
    start: Vector  # of a leg, or centre of a circle [m]
    end: Vector  # of a leg [m]
    airspeed: float  # wanted [m/s]
    stop: bool  # whether the leg ends at rest
    level: float  # its last metres are flown without a slope [m]
    low: float  # and so far below its end, which the climbing stop takes back [m]
    radius: float  # of a circle [m]; positive: anticlockwise seen from above


class AttitudeReference(NamedTuple):
    """An attitude to be flown instead of a position."""

    attitude: Quaternion  # body FLU in world NWU, unit
    rates: Vector  # of the attitude itself, in its body frame FLU [rad/s]
    thrust: float  # share of what both motors give at their limit, 0..1


class Reference(NamedTuple):
    """The set-point of the laws."""

    position: Vector  # [m]; while an attitude is flown, where the vehicle is
    heading: float  # [rad]
    speed: float  # horizontal speed limit of the hover laws [m/s]
    forward: bool  # whether the path shall be flown forward; else hover at the position
    path: Path
    steered: bool  # whether the attitude below shall be flown
    attitude: AttitudeReference


def _vector(point: Point) -> Vector:
    return Vector(*(float(x) for x in point))


def leg(start: Point, end: Point, airspeed: float, *, stop: bool = True, level: float = 0.0, low: float = 0.0) -> Path:
    """A straight leg; see :class:`Path`."""
    return Path(
        kind=LEG,
        start=_vector(start),
        end=_vector(end),
        airspeed=float(airspeed),
        stop=stop,
        level=float(level),
        low=float(low),
        radius=0.0,
    )


def circle(centre: Point, radius: float, airspeed: float) -> Path:
    """A circle; see :class:`Path`."""
    return Path(
        kind=CIRCLE,
        start=_vector(centre),
        end=_vector(centre),
        airspeed=float(airspeed),
        stop=False,
        level=0.0,
        low=0.0,
        radius=float(radius),
    )


def hover_at(position: Point, heading: float, speed: float = 3.0) -> Reference:
    """Stay upright at a position."""
    point = _vector(position)
    level = AttitudeReference(Quaternion(1.0, 0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0), 0.0)
    return Reference(
        position=point,
        heading=float(heading),
        speed=float(speed),
        forward=False,
        path=leg(point, point, APPROACH_SPEED),
        steered=False,
        attitude=level,
    )


def at(reference: Reference, position: Point) -> Reference:
    """The same, upright at a position: its path is that point, which the transition to the hover brakes to."""
    point = _vector(position)
    return reference._replace(position=point, forward=False, path=leg(point, point, APPROACH_SPEED))


def upright(reference: Reference) -> Reference:
    """The same, upright at the position it leads to."""
    return at(reference, reference.position)


def along(reference: Reference, path: Path, heading: float) -> Reference:
    """Fly a path forward; a leg ends at its end, upright at the heading."""
    return reference._replace(position=path.end, heading=heading, forward=True, path=path)


def steer(reference: Reference, attitude: AttitudeReference) -> Reference:
    """Fly an attitude instead."""
    return reference._replace(steered=True, attitude=attitude)


@kernel
def progress(path: Path, p: Vector) -> tuple[float, float, float]:
    """Distance flown along a leg, its length, and the horizontal distance to its left, [m]."""
    dx, dy = path.end.x - path.start.x, path.end.y - path.start.y
    length = level_norm(dx, dy)
    if length < 1e-6:
        return 0.0, 0.0, 0.0
    dx, dy = dx / length, dy / length
    x, y = p.x - path.start.x, p.y - path.start.y
    return x * dx + y * dy, length, y * dx - x * dy


@kernel
def line_of_sight(path: Path, p: Vector, speed: float) -> tuple[float, float]:
    """Unit vector of the line of sight, level, world north and west: to the point of a leg that lies ahead.

    Args:
        path: What is followed.
        p: Where the vehicle is [m].
        speed: Over the ground [m/s].
    """
    ahead = max(TIME_AHEAD * speed, MIN_AHEAD)
    if path.kind == CIRCLE:
        return _along_circle(path, p, 0.5 * ahead)
    along, length, _ = progress(path, p)
    share = (along + ahead) / length if length > 0.0 else 1.0  # beyond its end the leg goes on
    dx = path.start.x + share * (path.end.x - path.start.x) - p.x
    dy = path.start.y + share * (path.end.y - path.start.y) - p.y
    size = level_norm(dx, dy)
    return (dx / size, dy / size) if size > 1e-6 else (0.0, 0.0)


@kernel
def height(path: Path, p: Vector) -> tuple[float, float]:
    """Altitude of the path beside the vehicle [m], and its slope there."""
    return height_to(path, p, path.low)


@kernel
def height_to(path: Path, p: Vector, low: float) -> tuple[float, float]:
    """The same of a path that leads so far below its end [m]."""
    if path.kind == CIRCLE:
        return path.start.z, 0.0
    along, length, _ = progress(path, p)
    sloping = max(length - path.level, 1.0)
    share = along / sloping
    if share <= 0.0 or share >= 1.0:
        return (path.start.z if share <= 0.0 else path.end.z - low), 0.0
    climb = path.end.z - low - path.start.z
    return path.start.z + share * climb, climb / sloping


@kernel
def _along_circle(path: Path, p: Vector, ahead: float) -> tuple[float, float]:
    """The tangent beside the vehicle, turned towards the circle by what it is off it."""
    x, y = p.x - path.start.x, p.y - path.start.y
    sense = 1.0 if path.radius >= 0.0 else -1.0
    off = level_norm(x, y) - abs(path.radius)
    course = arctangent(y, x) + sense * (0.5 * math.pi + arctangent(off, ahead))
    sine, cosine = sine_cosine(course)
    return cosine, sine


@kernel
def cross_track(path: Path, p: Vector) -> float:
    """Horizontal distance from the path, positive to its left [m]."""
    if path.kind == CIRCLE:
        away = level_norm(p.x - path.start.x, p.y - path.start.y) - abs(path.radius)
        return -away if path.radius >= 0.0 else away
    return progress(path, p)[2]
