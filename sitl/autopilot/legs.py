"""Guidance in forward flight: legs that stop or fly by their end, and circles."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from sitl.autopilot.guidance import MIN_AIRSPEED, Ramp, View, distance, land_at
from sitl.control.forward_guidance import ground_speed, stopping_distance
from sitl.control.reference import Path, Point, Reference, along, circle, hover_at, leg, upright
from sitl.design.forward import line_of_sight_gains
from sitl.model.vectors import Vector

FAR = 30.0  # a course is a leg of so many seconds, begun anew all the time [s]
TURNING = 6.0  # lateral acceleration a corner is begun for [m/s2]
LOW = 1.2  # a stop is approached so far below its point: braking climbs [m]
LOW_FROM = 8.0  # where there is room below [m]
SETTLED = 0.5  # on a new course before braking [s]
LEVEL_SHARE = 0.7  # of a leg, at most, flown level at its end [-]
CORNER_SHARE = 0.45  # of a leg, at most, that a corner may cut
STANDING = 4.0  # slower than this a transition to the hover is nearly over [m/s]
BREEZE = 2.5  # less wind than this leaves the heading alone [m/s]
NEARLY_THERE = 40.0  # upright again nearer than this, the rest is hovered [m]
MAX_CENTRIPETAL = 5.0  # lateral acceleration of a circle at most [m/s2]


def leg_reference(start: Point, end: Point, last: Reference, airspeed: float, *, stop: bool) -> Reference:
    """The reference of a leg in forward flight; it ends heading along the leg."""
    course = math.atan2(end[1] - start[1], end[0] - start[0])
    # Idling motors brake little; a descent takes even that away. So it is over before the braking begins.
    level = 0.0
    if stop and end[2] < start[2]:
        gains = line_of_sight_gains().guidance
        level = min(
            LEVEL_SHARE * math.dist(start[:2], end[:2]), airspeed + stopping_distance(airspeed, 0.0, 0.0, gains)
        )
    low = LOW if stop and end[2] >= LOW_FROM else 0.0
    return along(hover_at(end, course, last.speed), leg(start, end, airspeed, stop=stop, level=level, low=low), course)


def course(p: Point, v: Point, wind: Point, last: Reference) -> Reference:
    """The reference of flight at a velocity over the ground, from wherever the vehicle is.

    Args:
        p: Where the vehicle is [m].
        v: Wanted velocity, level speed not zero [m/s].
        wind: As it is estimated [m/s].
        last: Gives the hover laws' part of the reference.
    """
    end = (p[0] + FAR * v[0], p[1] + FAR * v[1], p[2] + FAR * v[2])
    airspeed = math.dist(v, wind)
    return leg_reference(p, end, last, airspeed, stop=False)


def corner_lead(start: Point, corner: Point, after: Point, ground_speed: float) -> float:
    """How far before a corner the turn begins so that it ends on the next leg [m]."""
    inbound = math.atan2(corner[1] - start[1], corner[0] - start[0])
    outbound = math.atan2(after[1] - corner[1], after[0] - corner[0])
    turn = abs(math.remainder(outbound - inbound, math.tau))
    lead = ground_speed**2 / TURNING * math.tan(0.5 * min(turn, 2.6))
    shorter = min(math.dist(start[:2], corner[:2]), math.dist(corner[:2], after[:2]))
    return min(lead, CORNER_SHARE * shorter)


def leg_airspeeds(points: Sequence[Point], airspeed: float, wind: Point) -> list[float]:
    """Airspeeds of legs flown forward through points, the last one ending at rest.

    A leg is flown no faster than the legs after it leave room to slow down in, corners taken off.

    Args:
        points: Where the first leg begins, then the end of each leg.
        airspeed: Wanted, and not exceeded [m/s].
        wind: As it is estimated [m/s].
    """
    speeds = [airspeed] * (len(points) - 1)
    slower = 0.0  # what the next leg is flown at; rest after the last
    for i in reversed(range(len(speeds))):
        fastest = airspeed
        while fastest > MIN_AIRSPEED and not _fits(fastest, slower, points[max(i - 1, 0) : i + 2], wind):
            fastest -= 0.5
        slower = max(fastest, MIN_AIRSPEED)
        # What fits into this leg bounds the leg before as well, which ends where this one begins.
        speeds[i] = min(speeds[i], slower)
        if i > 0:
            speeds[i - 1] = min(speeds[i - 1], slower)
    return speeds


def _fits(fast: float, slow: float, points: Sequence[Point], wind: Point) -> bool:
    """Whether the leg that ends ``points`` can be entered fast, round a corner if it has one, and left slowly."""
    start, end = points[-2:]
    length = math.dist(start[:2], end[:2])
    if length < 1e-6:
        return False
    lead = 0.0
    if len(points) == 3:
        lead = corner_lead(points[0], start, end, over_ground(points[0], start, fast, wind))
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    along, across = wind[0] * ux + wind[1] * uy, wind[0] * uy - wind[1] * ux
    gains = line_of_sight_gains().guidance
    speed = over_ground(start, end, fast, wind)
    braking = stopping_distance(speed, along, across, gains)
    if slow > 0.0:
        braking -= stopping_distance(over_ground(start, end, slow, wind), along, across, gains)
    return bool(lead + SETTLED * speed + braking <= length)


def over_ground(start: Point, end: Point, airspeed: float, wind: Point) -> float:
    """Speed over the ground along a leg [m/s]."""
    length = max(math.dist(start[:2], end[:2]), 1e-9)
    north, west = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    return ground_speed(north, west, Vector(*wind), airspeed)


@dataclass(slots=True)
class FlyLeg:
    """Fly a leg forward.

    One that stops is done as a hovering approach is: within ``acceptance`` for ``hold`` seconds. One that does not is
    done ``lead`` metres before its end, or abeam of it.
    """

    reference: Reference  # with the leg as its path
    acceptance: float
    hold: float = 0.0
    lead: float = 0.0  # where the next leg is turned to [m]; 0: the point itself is flown over
    landing: bool = False
    arrived: float | None = None
    flown: bool = False  # has been in forward flight
    upright: bool = False  # and stands again near the end
    keep_heading: bool = False  # somebody asked for the heading at the end
    edge_on: float | None = None  # heading of the hover to come, chosen by the wind [rad]

    def update(self, view: View) -> Reference:
        """The leg, or its end once the vehicle stands near it."""
        path = self.reference.path
        left = math.dist(view.p[:2], self.reference.position[:2])
        if path.stop:
            self.flown |= view.forward
            self.upright |= self.flown and not view.forward and left < NEARLY_THERE
        if self.arrived is None and distance(view.p, self.reference.position) <= self.acceptance:
            self.arrived = view.time
        slow = math.hypot(view.v[0], view.v[1]) < STANDING
        if self.edge_on is None and view.forward and (left < NEARLY_THERE or slow):
            self.edge_on = edge_on(self.reference.heading, view.wind)
        heading = self.reference.heading if self.edge_on is None or self.keep_heading else self.edge_on
        reference = self.reference._replace(heading=heading)
        return upright(reference) if self.upright else reference

    def done(self, view: View) -> bool:
        """Held long enough at the end, or past it."""
        path = self.reference.path
        if path.stop:
            return self.arrived is not None and not view.forward and view.time - self.arrived >= self.hold
        flown, length = _along(path, view.p)
        if self.lead > 0.0:
            return length - flown <= self.lead
        return flown >= length or math.dist(view.p[:2], path.end[:2]) <= self.acceptance


def _along(path: Path, p: Point) -> tuple[float, float]:
    """Distance flown along a leg, and its length [m]."""
    dx, dy = path.end.x - path.start.x, path.end.y - path.start.y
    length = math.hypot(dx, dy)
    return ((p[0] - path.start.x) * dx + (p[1] - path.start.y) * dy) / max(length, 1e-9), length


@dataclass(slots=True)
class LandAfter:
    """Land below a leg's end, edge-on to the wind as it is known there.

    Turned back to the leg's own course, belly or back to the wind, it would be blown metres away.
    """

    leg: FlyLeg
    rate: float  # vertical speed near the ground [m/s]
    landing: bool = True
    down: Ramp | None = None  # from where the leg ended

    def update(self, view: View) -> Reference:
        """The reference on its way down."""
        if self.down is None:
            above = upright(self.leg.update(view))
            heading = above.heading if self.leg.keep_heading else edge_on(above.heading, view.wind)
            self.down = land_at(above._replace(heading=heading), self.rate)
        return self.down.update(view)

    def done(self, view: View) -> bool:  # noqa: ARG002 - the ground ends it
        """Never."""
        return False


def edge_on(heading: float, wind: Point) -> float:
    """The heading to hover at in a wind: with the span along it the wing feels nothing of it [rad].

    Belly or back to a wind above 4 m/s the elevons are nearly spent holding the nose up.
    """
    if math.hypot(wind[0], wind[1]) < BREEZE:
        return heading
    across = math.atan2(wind[1], wind[0]) + 0.5 * math.pi
    off = math.remainder(across - heading, math.pi)  # either side will do
    return heading + off


@dataclass(slots=True)
class Orbit:
    """Circle about a point in forward flight, for a time, for a number of turns, or for ever."""

    reference: Reference  # with a circle as its path
    seconds: float = math.inf
    turns: float = math.inf
    landing: bool = False
    since: float | None = None  # on the circle since
    bearing: float = 0.0  # from the centre, last tick [rad]
    turned: float = 0.0  # [rad]

    def update(self, view: View) -> Reference:
        """The circle; counts time and turns from when it is reached."""
        path = self.reference.path
        x, y = view.p[0] - path.start.x, view.p[1] - path.start.y
        bearing = math.atan2(y, x)
        if self.since is None:
            if abs(math.hypot(x, y) - abs(path.radius)) < 0.3 * abs(path.radius) and view.forward:
                self.since, self.bearing = view.time, bearing
        else:
            self.turned += abs(math.remainder(bearing - self.bearing, math.tau))
            self.bearing = bearing
        return self.reference

    def done(self, view: View) -> bool:
        """Time or turns are over."""
        if self.since is None:
            return False
        return view.time - self.since >= self.seconds or self.turned >= self.turns * math.tau


def orbit(
    centre: Point, radius: float, last: Reference, airspeed: float, seconds: float = math.inf, turns: float = math.inf
) -> Orbit:
    """A circle as MAVLink means it.

    Args:
        centre: World NWU [m].
        radius: [m]; positive: clockwise seen from above.
        last: Gives the hover laws' part of the reference.
        airspeed: Wanted [m/s]; a tight circle is flown slower.
        seconds: How long; infinite: for ever.
        turns: How often; infinite: for ever.
    """
    slower = min(airspeed, math.sqrt(MAX_CENTRIPETAL * abs(radius)))
    reference = along(hover_at(centre, last.heading, last.speed), circle(centre, -radius, slower), last.heading)
    return Orbit(reference, seconds, turns)
