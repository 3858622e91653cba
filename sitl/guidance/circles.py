"""Circles in forward flight (https://mavlink.io/en/messages/common.html#MAV_CMD_DO_ORBIT)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.plans.item_circles import COMPASS
from sitl.control.reference import Point, Reference, along, circle, hover_at
from sitl.guidance.view import MAX_CENTRIPETAL, VehicleView

HEIGHT_REACHED = 2.0  # nearer than this, the height of a circle is reached [m]
TANGENT_ERROR = math.radians(10.0)  # of the course to a point for which a circle is left [rad]
MIN_TANGENT_SHARE = 1.1  # of the radius: to points nearer to the centre no tangent leads
ON_CIRCLE_SHARE = 0.3  # of the radius: nearer to the circle than this, it counts as reached


@dataclass(slots=True)
class FlyCircle:
    """Circle about a point in forward flight, for a time, for a number of turns, or for ever."""

    reference: Reference  # with a circle as its path
    seconds: float = math.inf
    turns: float = math.inf
    landing: bool = False
    since: float | None = None  # on the circle since
    bearing: float = 0.0  # from the centre, last tick [rad]
    turned: float = 0.0  # [rad]

    def update(self, view: VehicleView) -> Reference:
        """The circle; counts time and turns from when it is reached."""
        path = self.reference.path
        x, y = view.p[0] - path.start.x, view.p[1] - path.start.y
        bearing = math.atan2(y, x)
        if self.since is None:
            off = abs(math.hypot(x, y) - abs(path.radius))
            if off < ON_CIRCLE_SHARE * abs(path.radius) and view.forward:
                self.since, self.bearing = view.time, bearing
        else:
            self.turned += abs(math.remainder(bearing - self.bearing, math.tau))
            self.bearing = bearing
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Time or turns are over."""
        if self.since is None:
            return False
        return view.time - self.since >= self.seconds or self.turned >= self.turns * math.tau


@dataclass(slots=True)
class CircleToHeight:
    """Circle until the height of the circle is reached, and leave it towards a point."""

    circle: FlyCircle
    towards: Point | None = None  # world NWU [m]; None: leave it wherever the height is reached
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:
        """The circle."""
        return self.circle.update(view)

    def done(self, view: VehicleView) -> bool:
        """On the circle, at its height, and flying towards the point, which a point within the circle cannot be."""
        path = self.circle.reference.path
        if self.circle.since is None or abs(view.p[2] - path.start.z) > HEIGHT_REACHED:
            return False
        end = self.towards
        if end is None or math.dist(end[:2], (path.start.x, path.start.y)) < MIN_TANGENT_SHARE * abs(path.radius):
            return True
        bearing, course = math.atan2(end[1] - view.p[1], end[0] - view.p[0]), math.atan2(view.v[1], view.v[0])
        return abs(math.remainder(bearing - course, math.tau)) < TANGENT_ERROR


def circle_about(
    centre: Point, radius: float, last: Reference, airspeed: float, seconds: float = math.inf, turns: float = math.inf
) -> FlyCircle:
    """A circle as MAVLink means it.

    Args:
        centre: World NWU [m].
        radius: [m]; positive: clockwise seen from above.
        last: Gives the hover laws' part of the reference.
        airspeed: Wanted [m/s]; a tight circle is flown slower.
        seconds: How long; infinite: for ever.
        turns: How often; infinite: for ever.
    """
    path = circle(centre, -radius, circle_airspeed(radius, airspeed))
    reference = along(hover_at(centre, last.heading, last.speed), path, last.heading)
    return FlyCircle(reference, seconds, turns)


def rim(centre: Point, radius: float) -> list[Point]:
    """Points of a circle about a centre, world NWU [m]."""
    return [(centre[0] + radius * x, centre[1] + radius * y, centre[2]) for x, y in COMPASS]


def circle_airspeed(radius: float, wanted: float) -> float:
    """The airspeed of a circle: the wanted one, or slower where it is tight [m/s]."""
    return min(wanted, math.sqrt(MAX_CENTRIPETAL * abs(radius)))


def circle_at(circling: FlyCircle, height: float) -> FlyCircle:
    """The same circle at another height, world NWU [m], flown on from where the vehicle is, for ever."""
    reference, path = circling.reference, circling.reference.path
    centre = path.start._replace(z=float(height))
    path = path._replace(start=centre, end=centre)
    return FlyCircle(reference._replace(position=centre, path=path))


def circle_ahead(view: VehicleView, radius: float, last: Reference, airspeed: float) -> FlyCircle:
    """A clockwise circle ahead that is joined at its nearest point, flying straight ahead; arguments as above."""
    h, p = view.heading, view.p
    ahead, right = 1.5 * radius, radius
    centre = (
        p[0] + ahead * math.cos(h) + right * math.sin(h),
        p[1] + ahead * math.sin(h) - right * math.cos(h),
        p[2],
    )
    return circle_about(centre, radius, last, airspeed)
