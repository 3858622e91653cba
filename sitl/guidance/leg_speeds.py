"""Speeds of legs in forward flight, one after the other, so that each leaves room for the next."""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.ranges import MIN_AIRSPEED
from sitl.control.forward_flight.forward_guidance import ground_speed, stopping_distance
from sitl.control.reference import Point
from sitl.design.gains import line_of_sight_gains
from sitl.model.vectors import Vector

CORNER_ACCELERATION = 6.0  # lateral acceleration that the start of a turn is computed for [m/s2]
MAX_CUT = math.sqrt(2.0) - 1.0  # of a corner, in radii of its turn
SETTLING_TIME = 0.5  # on a new course before braking [s]
MAX_CORNER_SHARE = 0.45  # of a leg, cut off by a corner
AIRSPEED_HALVINGS = 6  # of what is between the airspeeds wanted on a leg and at its end


def corner_lead(start: Point, corner: Point, after: Point, speed: float) -> float:
    """Distance before a corner at which the turn begins so that it ends on the next leg [m].

    Args:
        start: Where the leg to the corner begins, world NWU [m].
        corner: World NWU [m].
        after: Where the leg after the corner ends, world NWU [m].
        speed: Over the ground [m/s].
    """
    shorter = min(math.dist(start[:2], corner[:2]), math.dist(corner[:2], after[:2]))
    return min(_lead(start, corner, after, speed), MAX_CORNER_SHARE * shorter)


def _lead(start: Point, corner: Point, after: Point, speed: float) -> float:
    """The same where the legs are long enough: a sharp turn begins so late that it passes its corner."""
    inbound = math.atan2(corner[1] - start[1], corner[0] - start[0])
    outbound = math.atan2(after[1] - corner[1], after[0] - corner[0])
    turn = abs(math.remainder(outbound - inbound, math.tau))
    return speed**2 / CORNER_ACCELERATION * min(math.tan(0.5 * min(turn, math.pi - 0.1)), 1.0)


def corner_cut(speed: float) -> float:
    """Greatest distance of a turn from its corner [m]: that of a turn by a right angle.

    Args:
        speed: Over the ground [m/s].
    """
    return MAX_CUT * speed**2 / CORNER_ACCELERATION


def leg_airspeeds(points: Sequence[Point], airspeed: float, wind: Point) -> list[float]:
    """Airspeeds of legs flown forward through points, the last one ending at rest [m/s].

    A leg is flown no faster than it leaves room to slow down in for what follows, the corner before it taken off. The
    leg before it may be faster, and slows down to its airspeed before the corner: :func:`slowed_airspeed`.

    Args:
        points: Where the first leg begins, then the end of each leg.
        airspeed: Wanted, and not exceeded [m/s].
        wind: As it is estimated [m/s].
    """
    speeds = [airspeed] * (len(points) - 1)
    slower = 0.0  # airspeed of the next leg; at rest after the last
    for i in reversed(range(len(speeds))):
        fastest = airspeed
        while fastest > MIN_AIRSPEED and not _fits(fastest, slower, points[max(i - 1, 0) : i + 2], wind):
            fastest -= 0.5
        slower = max(fastest, MIN_AIRSPEED)
        speeds[i] = slower
    return speeds


def slowed_airspeed(fast: float, slow: float, room: float, leg: tuple[Point, Point], wind: Point) -> float:
    """The airspeed on a leg from which the vehicle slows down in time [m/s].

    Args:
        fast: Wanted on the leg [m/s].
        slow: Wanted at its end [m/s].
        room: Distance left until then [m].
        leg: Where it begins and ends, world NWU [m].
        wind: As it is estimated [m/s].
    """
    allowed = braking_distance(slow, leg, wind) + max(room, 0.0)
    if fast <= slow or braking_distance(fast, leg, wind) <= allowed:
        return fast
    low, high = slow, fast
    for _ in range(AIRSPEED_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if braking_distance(middle, leg, wind) <= allowed else (low, middle)
    return low


def leaves_room(points: Sequence[Point], airspeeds: Sequence[float], wind: Point) -> bool:
    """Whether legs flown at some airspeeds leave room for every turn and for the stop.

    Args:
        points: Where the first leg begins, then the end of each leg.
        airspeeds: Of the legs [m/s].
        wind: As it is estimated [m/s].
    """
    for i, fast in enumerate(airspeeds):
        slow = airspeeds[i + 1] if i + 1 < len(airspeeds) else 0.0
        if not _fits(fast, slow, points[max(i - 1, 0) : i + 2], wind):
            return False
        if i + 1 < len(airspeeds):
            start, corner, after = points[i : i + 3]
            shorter = min(math.dist(start[:2], corner[:2]), math.dist(corner[:2], after[:2]))
            if _lead(start, corner, after, speed_along(start, corner, fast, wind)) > MAX_CORNER_SHARE * shorter:
                return False
    return True


def _fits(fast: float, slow: float, points: Sequence[Point], wind: Point) -> bool:
    """Whether the leg that ends ``points`` can be entered fast, round a corner if it has one, and left slowly."""
    start, end = points[-2:]
    length = math.dist(start[:2], end[:2])
    if length < 1e-6:
        return False
    lead = 0.0
    if len(points) == 3:
        lead = corner_lead(points[0], start, end, speed_along(points[0], start, fast, wind))
    braking = braking_distance(fast, (start, end), wind)
    if slow > 0.0:
        braking -= braking_distance(slow, (start, end), wind)
    return bool(lead + SETTLING_TIME * speed_along(start, end, fast, wind) + braking <= length)


def braking_distance(airspeed: float, leg: tuple[Point, Point], wind: Point) -> float:
    """Distance along a leg, from its beginning to its end, in which the vehicle stops from an airspeed [m]."""
    start, end = leg
    length = max(math.dist(start[:2], end[:2]), 1e-9)
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    along, across = wind[0] * ux + wind[1] * uy, wind[0] * uy - wind[1] * ux
    return float(
        stopping_distance(speed_along(start, end, airspeed, wind), along, across, line_of_sight_gains().guidance)
    )


def speed_along(start: Point, end: Point, airspeed: float, wind: Point) -> float:
    """Speed over the ground along a leg at an airspeed in a wind [m/s]."""
    length = max(math.dist(start[:2], end[:2]), 1e-9)
    north, west = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    return ground_speed(north, west, Vector(*wind), airspeed)


def airspeed_over_ground(start: Point, end: Point, speed: float, wind: Point) -> float:
    """The airspeed that gives a speed over the ground along a leg in a wind [m/s]; it may be none that can be flown."""
    length = max(math.dist(start[:2], end[:2]), 1e-9)
    north, west = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    return math.hypot(speed * north - wind[0], speed * west - wind[1])
