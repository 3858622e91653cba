"""Passing a waypoint in forward flight: near it and near its height, by a circle where the way there is too short.

A vehicle at speed cannot meet a point within its circle of turn, nor climb or sink on a short leg as far as on a long
one. It then circles first: until its course leads to the point, or through the point until the height is right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl.control.reference import Path, Point, Reference
from sitl.guidance.circles import FlyCircle, circle_about
from sitl.guidance.leg_speeds import CORNER_ACCELERATION
from sitl.guidance.limits import MAX_CENTRIPETAL, MIN_AIRSPEED
from sitl.guidance.view import VehicleView

ALIGNED = math.radians(10.0)  # a course that leads so nearly to a point leads there [rad]
MIN_TURN_SPEED = 5.0  # over the ground, below which nothing is known of the course [m/s]
SLOWER = 0.6  # than the leg a circle is flown: it is tighter and takes less time
TIGHTEST = 0.85  # of the planned radius, a turn is flown at most [-]
MAX_CIRCLES = 3  # to meet one waypoint; then it counts as passed where it was passed
MAX_TURNS = 8.0  # of a circle that climbs or sinks
MIN_REACH = 3.0  # a waypoint's own radius counts as at least this in forward flight [m]
NEAR_SHARE = 0.5  # of the height that may be off, within which a circle ends


@dataclass(slots=True)
class Passage:
    """Tolerances within which a waypoint is passed, and the side of the circle that is flown to do so.

    Attributes:
        reach: Level distance within which it is passed [m].
        height_reach: How far off its height may be [m].
        turns_left: Whether circles through the waypoint are flown to the left, as the next leg leads.
    """

    reach: float
    height_reach: float
    turns_left: bool = False
    circle: FlyCircle | None = None
    climbs: bool = False  # whether the circle leads through the waypoint, to climb or sink
    circles: int = 0  # flown for this waypoint
    checked: bool = False  # whether the waypoint can be met from where the leg began

    def is_within(self, p: Point, end: Point) -> bool:
        """Whether a point is as near a waypoint as wanted, and as near its height."""
        return math.dist(p[:2], end[:2]) <= self.reach and abs(p[2] - end[2]) <= self.height_reach

    def circled(self, view: VehicleView, path: Path, last: Reference) -> Reference | None:
        """The circle that is to be flown now; None: the leg is.

        Args:
            view: The vehicle.
            path: The leg to the waypoint.
            last: Gives the hover laws' part of the reference.
        """
        end: Point = (path.end.x, path.end.y, path.end.z)
        if self.circle is None and view.forward and self.circles < MAX_CIRCLES:
            self._begin(view, path, end, last)
        circle = self.circle
        if circle is None:
            return None
        reference = circle.update(view)
        is_over = circle.turned > MAX_TURNS * math.tau or not view.forward
        if is_over or (not self.climbs and _leads_to(view, end)):
            self.circle = None
        return reference

    def _begin(self, view: VehicleView, path: Path, end: Point, last: Reference) -> None:
        if math.hypot(view.v[0], view.v[1]) < MIN_TURN_SPEED:
            return  # in a transition there is no course yet
        along, length = flown_along(path, view.p)
        is_missed = along >= length and not self.is_within(view.p, end)
        is_beside = not self.checked and not can_meet(
            view, end, TIGHTEST * turn_radius(view, path.airspeed), self.reach
        )
        self.checked = True
        if not (is_missed or is_beside):
            return
        self.circles += 1
        self.climbs = is_missed and math.dist(view.p[:2], end[:2]) <= self.reach
        height = end[2] if self.climbs else view.p[2]
        left = self.turns_left if self.climbs else not _lies_left(view, end)
        airspeed = max(SLOWER * path.airspeed, MIN_AIRSPEED)
        radius = circle_radius(view, airspeed)
        centre = _beside(view, radius, left=left)
        self.circle = circle_about((*centre, height), -radius if left else radius, last, airspeed)

    def is_passed(self, view: VehicleView, path: Path, lead: float) -> bool:
        """Whether the waypoint is passed, or the turn to the next leg begins so far before it [m].

        Before it, it is enough to be on the leg, and at its height there.
        """
        end: Point = (path.end.x, path.end.y, path.end.z)
        if self.circle is not None:
            off = abs(view.p[2] - end[2])
            return (
                self.climbs and off <= NEAR_SHARE * self.height_reach and math.dist(view.p[:2], end[:2]) <= self.reach
            )
        along, length = flown_along(path, view.p)
        if along >= length:
            return self.is_within(view.p, end) or self.circles >= MAX_CIRCLES
        share = max(along, 0.0) / max(length, 1e-9)
        beside = tuple(a + share * (b - a) for a, b in zip(path.start, path.end, strict=True))
        return length - along <= lead and self.is_within(view.p, (beside[0], beside[1], beside[2]))


def is_left_turn(start: Point, corner: Point, after: Point) -> bool:
    """Whether the way through three points turns to the left, seen from above."""
    ax, ay, bx, by = corner[0] - start[0], corner[1] - start[1], after[0] - corner[0], after[1] - corner[1]
    return ax * by - ay * bx > 0.0


def flown_along(path: Path, p: Point) -> tuple[float, float]:
    """Distance flown along a leg, and its length [m]."""
    dx, dy = path.end.x - path.start.x, path.end.y - path.start.y
    length = math.hypot(dx, dy)
    return ((p[0] - path.start.x) * dx + (p[1] - path.start.y) * dy) / max(length, 1e-9), length


def turn_radius(view: VehicleView, airspeed: float) -> float:
    """Radius of a turn at the present speed over the ground, or at an airspeed if that is more [m]."""
    return max(math.hypot(view.v[0], view.v[1]), airspeed) ** 2 / CORNER_ACCELERATION


def circle_radius(view: VehicleView, airspeed: float) -> float:
    """Radius of a circle that can be flown in the present wind [m]."""
    return (airspeed + math.hypot(view.wind[0], view.wind[1])) ** 2 / MAX_CENTRIPETAL


def can_meet(view: VehicleView, end: Point, radius: float, reach: float) -> bool:
    """Whether a turn towards a point leads there: it does not lie within the circle of that turn."""
    return math.dist(_beside(view, radius, left=_lies_left(view, end)), end[:2]) >= radius - reach


def _beside(view: VehicleView, radius: float, *, left: bool) -> tuple[float, float]:
    """Centre of a circle of turn."""
    speed = max(math.hypot(view.v[0], view.v[1]), 1e-6)
    side = radius if left else -radius
    return view.p[0] - side * view.v[1] / speed, view.p[1] + side * view.v[0] / speed


def _lies_left(view: VehicleView, end: Point) -> bool:
    return view.v[0] * (end[1] - view.p[1]) - view.v[1] * (end[0] - view.p[0]) >= 0.0


def _leads_to(view: VehicleView, end: Point) -> bool:
    """Whether the present course leads to a point."""
    bearing = math.atan2(end[1] - view.p[1], end[0] - view.p[0])
    return abs(math.remainder(bearing - math.atan2(view.v[1], view.v[0]), math.tau)) < ALIGNED
