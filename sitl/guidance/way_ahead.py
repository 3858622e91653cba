"""The way that a vehicle in forward flight is about to fly: along its legs, round their corners and its circle.

The vehicle is taken as a point whose velocity is governed as the laws' guidance does it, towards the line of sight in
the present wind, but with less acceleration than they have: a turn is predicted no tighter than it will be flown.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from sitl.control.forward_flight.forward_guidance import FAST, ground_speed
from sitl.control.reference import CIRCLE, Path, Point, height, line_of_sight
from sitl.control.reference import progress as flown
from sitl.guidance.view import VehicleView
from sitl.model.arithmetic import clipped
from sitl.model.vectors import Vector

WAY_STEP = 3.0  # of the points of a way [m]
WAY_REACH = 450.0  # length of a way that is looked at, unless it ends before [m]
ROUND_REACH = 1800.0  # of one that goes round a circle [m]
WAY_GAIN = 1.0  # velocity error to acceleration [1/s]
WAY_BRAKE, WAY_SPEED_UP = 1.5, 3.0  # limits of the acceleration along the way [m/s2]
WAY_MIN_TURN, WAY_MAX_TURN = 3.0, 6.5  # and across it, when slow and from ``FAST`` on; the laws have up to 8 [m/s2]
WAY_LAG = 0.5  # until a turn is entered [s]
WAY_CLIMB_TIME = 1.5  # for which a climb goes on [s]


class WayStretch(NamedTuple):
    """A leg or a circle."""

    path: Path
    lead: float = 0.0  # distance before its end at which the next one begins [m]
    end_airspeed: float = math.inf  # at most, there [m/s]


class WayPoint(NamedTuple):
    """One point of a way."""

    p: Point  # world NWU [m]
    v: tuple[float, float]  # over the ground, level [m/s]


class Way(NamedTuple):
    """Points of a way, about ``WAY_STEP`` apart."""

    points: tuple[WayPoint, ...] = ()
    is_whole: bool = False  # it ends at rest, or has gone round its circle


def way_ahead(view: VehicleView, stretches: Sequence[WayStretch]) -> Way:
    """The way from where a vehicle is.

    Args:
        view: The vehicle as it is now.
        stretches: That it flies, the present one first, without a stop between; beyond a last one that does not stop
            nothing is known.
    """
    points: list[WayPoint] = []
    if not stretches:
        return Way()
    moving = _Moving(view.p[0], view.p[1], (view.v[0], view.v[1]), 0.0, view.wind)
    for stretch in stretches:
        is_round = stretch.path.kind == CIRCLE
        turned, last, left = 0.0, math.nan, (ROUND_REACH if is_round else WAY_REACH) - WAY_STEP * len(points)
        while not moving.is_past(stretch):
            if left <= 0.0:
                return Way(tuple(points))
            points.append(moving.point(stretch.path, view))
            bearing = math.atan2(moving.y - stretch.path.start.y, moving.x - stretch.path.start.x)
            turned += 0.0 if math.isnan(last) else abs(math.remainder(bearing - last, math.tau))
            if is_round and turned >= math.tau:
                return Way(tuple(points), is_whole=True)
            last, left = bearing, left - WAY_STEP
            moving = moving.after(stretch)
        if stretch.path.stop and not is_round:
            return Way((*points, *moving.overshoot(stretch.path, view)), is_whole=True)
    return Way(tuple(points))


class _Moving(NamedTuple):
    """A point that moves as guidance has it."""

    x: float  # world, north [m]
    y: float  # west [m]
    v: tuple[float, float]  # over the ground [m/s]
    turn: float  # lateral acceleration, to the left [m/s2]
    wind: Point  # [m/s]

    @property
    def speed(self) -> float:
        """Over the ground, at least 1 [m/s]."""
        return max(math.hypot(*self.v), 1.0)

    def is_past(self, stretch: WayStretch) -> bool:
        """Whether the next stretch has begun."""
        if stretch.path.kind == CIRCLE:
            return False
        along, length, _ = flown(stretch.path, Vector(self.x, self.y, 0.0))
        return along >= length - stretch.lead

    def point(self, path: Path, view: VehicleView) -> WayPoint:
        """The place of it, as high as the path or the vehicle's climb leads."""
        z, _ = height(path, Vector(self.x, self.y, view.p[2]))
        return WayPoint((self.x, self.y, max(z, view.p[2] + WAY_CLIMB_TIME * max(view.v[2], 0.0))), self.v)

    def after(self, stretch: WayStretch) -> _Moving:
        """The same ``WAY_STEP`` later."""
        path, speed, (vx, vy) = stretch.path, self.speed, self.v
        dt = WAY_STEP / speed
        north, west = line_of_sight(path, Vector(self.x, self.y, 0.0), speed)
        wanted = ground_speed(north, west, Vector(*self.wind), self._airspeed(stretch))
        ux, uy = vx / speed, vy / speed
        along = clipped(WAY_GAIN * (wanted * (north * ux + west * uy) - speed), -WAY_BRAKE, WAY_SPEED_UP)
        share = min(math.hypot(vx - self.wind[0], vy - self.wind[1]) / FAST, 1.0)
        most = max(WAY_MIN_TURN, WAY_MAX_TURN * share * share)
        asked = WAY_GAIN * wanted * (west * ux - north * uy) + (speed**2 / path.radius if path.kind == CIRCLE else 0.0)
        turn = self.turn + (clipped(asked, -most, most) - self.turn) * min(dt / WAY_LAG, 1.0)
        next_v = (vx + dt * (along * ux - turn * uy), vy + dt * (along * uy + turn * ux))
        return _Moving(self.x + dt * vx, self.y + dt * vy, next_v, turn, self.wind)

    def _airspeed(self, stretch: WayStretch) -> float:
        """The airspeed wanted here: it falls to that at the end no earlier than the vehicle brakes."""
        path, slow = stretch.path, stretch.end_airspeed
        if path.kind == CIRCLE or path.airspeed <= slow:
            return path.airspeed
        along, length, _ = flown(path, Vector(self.x, self.y, 0.0))
        return min(path.airspeed, math.sqrt(slow**2 + 2.0 * WAY_BRAKE * max(length - along - stretch.lead, 0.0)))

    def overshoot(self, path: Path, view: VehicleView) -> list[WayPoint]:
        """Points beyond the end of a leg that stops, where braking takes more than is left of it."""
        left = math.dist((view.p[0], view.p[1]), (path.end.x, path.end.y))
        v, speed = self.v, self.speed
        beyond = max(view.stopping_distance - left, 0.0)
        return [
            WayPoint((self.x + s * v[0] / speed, self.y + s * v[1] / speed, path.end.z), (0.0, 0.0))
            for s in (0.0, 0.5 * beyond, beyond)
        ]
