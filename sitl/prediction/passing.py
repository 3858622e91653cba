"""Passing a waypoint in forward flight as the autopilot does, in a prediction: near it, by circles where need be.

It is what :class:`sitl.guidance.legs.Passage` flies; heights apart, of which a prediction makes no circles.
"""

import math
from typing import NamedTuple

from protocol.ranges import MIN_AIRSPEED
from sitl.compiled import kernel
from sitl.control.reference import CIRCLE, Path, progress
from sitl.guidance.leg_speeds import CORNER_ACCELERATION
from sitl.guidance.legs import ALIGNED, MAX_CIRCLES, MIN_TURN_SPEED, SLOWER, TIGHTEST
from sitl.guidance.view import MAX_CENTRIPETAL
from sitl.model.vectors import Vector, level_norm

LEADS = math.cos(ALIGNED)  # cosine between course and bearing


class Passing(NamedTuple):
    """The way to a waypoint, as it is flown now."""

    path: Path
    early: float  # so far before its end the leg is past it [m]
    is_circling: bool
    is_checked: bool  # whether it can be met from where the leg began
    circles: int


@kernel
def first_passing(path: Path, early: float) -> Passing:
    """At the beginning of a leg."""
    return Passing(path=path, early=early, is_circling=False, is_checked=False, circles=0)


@kernel
def is_passed(passing: Passing, p: Vector, reach: float) -> bool:
    """Whether the waypoint is passed, or the turn to the next leg begins."""
    if passing.is_circling:
        return False
    along, length, beside = progress(passing.path, p)
    if along >= length:
        return abs(beside) <= reach or passing.circles >= MAX_CIRCLES
    return length - along <= passing.early and abs(beside) <= reach


@kernel
def passed_on(passing: Passing, p: Vector, v: Vector, leg: Path, wind: Vector, reach: float) -> Passing:
    """The way a step later.

    Args:
        passing: Until now.
        p: Position [m].
        v: Velocity [m/s].
        leg: To the waypoint.
        wind: [m/s].
        reach: So near the waypoint it is passed [m].
    """
    x, y, speed = leg.end.x - p.x, leg.end.y - p.y, level_norm(v.x, v.y)
    away = level_norm(x, y)
    if passing.is_circling:
        if x * v.x + y * v.y < LEADS * away * speed:
            return passing
        return Passing(_from(p, leg), 0.0, False, True, passing.circles)
    if speed < MIN_TURN_SPEED or passing.circles >= MAX_CIRCLES:
        return passing
    along, length, beside = progress(passing.path, p)
    lies_left = v.x * y - v.y * x >= 0.0
    is_missed = along >= length and abs(beside) > reach
    fastest = max(speed, leg.airspeed)
    tightest = TIGHTEST * fastest * fastest / CORNER_ACCELERATION
    cx, cy = _beside(v, tightest, lies_left)
    if is_missed or (not passing.is_checked and level_norm(x - cx, y - cy) < tightest - reach):
        return Passing(_circle(p, v, leg, wind, not lies_left), 0.0, True, True, passing.circles + 1)
    return Passing(passing.path, passing.early, False, True, passing.circles)


@kernel
def _beside(v: Vector, radius: float, left: bool) -> tuple[float, float]:
    """From the vehicle to the centre of its circle of turn [m]."""
    side = (radius if left else -radius) / max(level_norm(v.x, v.y), 1e-6)
    return -side * v.y, side * v.x


@kernel
def _from(p: Vector, leg: Path) -> Path:
    """The way from here to the end of a leg."""
    return Path(
        kind=leg.kind,
        start=p,
        end=leg.end,
        airspeed=leg.airspeed,
        stop=leg.stop,
        level=leg.level,
        low=leg.low,
        radius=0.0,
    )


@kernel
def _circle(p: Vector, v: Vector, leg: Path, wind: Vector, left: bool) -> Path:
    """The circle from here."""
    airspeed = max(SLOWER * leg.airspeed, MIN_AIRSPEED)
    fastest = airspeed + level_norm(wind.x, wind.y)
    radius = fastest * fastest / MAX_CENTRIPETAL
    cx, cy = _beside(v, radius, left)
    centre = Vector(p.x + cx, p.y + cy, p.z)
    return Path(
        kind=CIRCLE,
        start=centre,
        end=centre,
        airspeed=airspeed,
        stop=False,
        level=0.0,
        low=0.0,
        radius=radius if left else -radius,
    )
