"""Legs in forward flight: those that stop at their end, those that fly by it, and the landing after one."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.dialect.vocabulary import Law
from protocol.ranges import MIN_AIRSPEED
from sitl.control.forward_flight.forward_guidance import stopping_distance
from sitl.control.reference import LEG, Path, Point, Reference, along, hover_at, leg, upright
from sitl.design.gains import line_of_sight_gains
from sitl.guidance.circles import FlyCircle, circle_about
from sitl.guidance.landing import LandingDescent
from sitl.guidance.leg_speeds import CORNER_ACCELERATION, corner_lead, slowed_airspeed, speed_along
from sitl.guidance.manoeuvres import Manoeuvre, ManoeuvreSequence, current_step, distance
from sitl.guidance.view import MAX_CENTRIPETAL, VehicleView
from sitl.guidance.way_ahead import WayStretch

# Passing a waypoint in forward flight: near it and near its height, by a circle where the way there is too short.
#
# A vehicle at speed cannot meet a point within its circle of turn, nor climb or sink on a short leg as far as on a long
# one. It then circles first: until its course leads to the point, or through the point until the height is right.


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


COURSE_TIME = 30.0  # a course is a leg this long, begun anew at every set-point [s]
BRAKING_CLIMB = 1.2  # a stop is approached this far below its point, because braking climbs [m]
MIN_BRAKING_HEIGHT = 8.0  # only stops at least this high are approached from below [m]
MAX_LEVEL_SHARE = 0.7  # of a leg, flown level at its end [-]
BACK_TRANSITION_END_SPEED = 4.0  # slower than this, a back transition is nearly over [m/s]
LIGHT_WIND = 2.5  # less wind than this does not change the heading of the hover [m/s]
SWING_DISTANCE = 80.0  # nearer than this, INDI turns its hover edge-on to the wind on the way [m]
NEARLY_THERE = 40.0  # once upright nearer than this, the rest of a leg is hovered [m]


def leg_reference(start: Point, end: Point, last: Reference, airspeed: float, *, stop: bool) -> Reference:
    """The reference of a leg in forward flight; at its end the heading is that of the leg.

    Args:
        start: World NWU [m].
        end: World NWU [m].
        last: Its speed limit is kept for the hover at the end.
        airspeed: [m/s].
        stop: Whether the leg ends at rest.
    """
    heading = math.atan2(end[1] - start[1], end[0] - start[0])
    # Idling motors brake little, and in a descent less still. So the descent is over before the braking begins.
    level = 0.0
    if stop and end[2] < start[2]:
        gains = line_of_sight_gains().guidance
        level = min(
            MAX_LEVEL_SHARE * math.dist(start[:2], end[:2]), airspeed + stopping_distance(airspeed, 0.0, 0.0, gains)
        )
    low = BRAKING_CLIMB if stop and end[2] >= MIN_BRAKING_HEIGHT else 0.0
    path = leg(start, end, airspeed, stop=stop, level=level, low=low)
    return along(hover_at(end, heading, last.speed), path, heading)


def lead_on(leg: FlyLeg, points: Sequence[Point], airspeeds: Sequence[float], wind: Point) -> None:
    """Have a leg lead on into the next one: slowed down to that, it turns before its end.

    Args:
        leg: Does not stop at its end.
        points: Where it begins and ends, and where the next one ends, world NWU [m].
        airspeeds: Of both, :func:`sitl.guidance.leg_speeds.leg_airspeeds` [m/s].
        wind: As it is estimated [m/s].
    """
    start, corner, after = points[:3]
    leg.end_airspeed = airspeeds[1]
    leg.lead = corner_lead(start, corner, after, speed_along(start, corner, min(airspeeds[:2]), wind))


def course_reference(p: Point, v: Point, wind: Point, last: Reference) -> Reference:
    """The reference of flight at a velocity over the ground, from wherever the vehicle is.

    Args:
        p: Where the vehicle is [m].
        v: Wanted velocity, horizontal speed not zero [m/s].
        wind: As it is estimated [m/s].
        last: Gives the hover laws' part of the reference.
    """
    end = (p[0] + COURSE_TIME * v[0], p[1] + COURSE_TIME * v[1], p[2] + COURSE_TIME * v[2])
    airspeed = math.dist(v, wind)
    return leg_reference(p, end, last, airspeed, stop=False)


@dataclass(slots=True)
class FlyLeg:
    """Fly a leg forward.

    A leg that stops is done as a hovering approach is: upright within ``acceptance`` for ``hold`` seconds; to pass by
    its end is not to arrive. A leg that does not stop is done ``lead`` metres before its end, or abeam of it.
    """

    reference: Reference  # with the leg as its path
    acceptance: float
    hold: float = 0.0
    lead: float = 0.0  # distance before the end at which the turn to the next leg begins [m]; 0: fly over the end
    landing: bool = False
    arrived: float | None = None
    flown: bool = False  # has been in forward flight
    upright: bool = False  # and is upright again near the end
    keep_heading: bool = False  # the heading at the end was requested
    crosswind: float | None = None  # heading of the hover to come, chosen by the wind [rad]
    passage: Passage | None = None  # of a waypoint that is flown past; None: abeam of it is past it
    end_airspeed: float = math.inf  # at most, where the turn at its end begins [m/s]

    def update(self, view: VehicleView) -> Reference:
        """The leg, or its end once the vehicle is upright near it, or a circle that makes it meet its waypoint."""
        if self.passage is not None and not self.reference.path.stop:
            was_circling = self.passage.circle is not None
            circled = self.passage.circled(view, self.reference.path, self.reference)
            if circled is not None:
                return circled
            if was_circling:
                self._begin_here(view)
        path = self.reference.path
        left = math.dist(view.p[:2], self.reference.position[:2])
        if path.stop:
            self.flown |= view.forward
            self.upright |= self.flown and not view.forward and left < NEARLY_THERE
        stands = not (path.stop and view.forward)
        if self.arrived is None and stands and distance(view.p, self.reference.position) <= self.acceptance:
            self.arrived = view.time
        slow = math.hypot(view.v[0], view.v[1]) < BACK_TRANSITION_END_SPEED
        near = SWING_DISTANCE if view.law is Law.INDI else NEARLY_THERE
        if self.crosswind is None and view.forward and (left < near or slow):
            self.crosswind = crosswind_heading(self.reference.heading, view.wind)
        heading = self.reference.heading if self.crosswind is None or self.keep_heading else self.crosswind
        reference = self.reference._replace(heading=heading, path=self._slowed(view))
        return upright(reference) if self.upright else reference

    def _slowed(self, view: VehicleView) -> Path:
        """The path, no faster than it can slow down to the leg after it."""
        path = self.reference.path
        if path.airspeed <= self.end_airspeed:
            return path
        along, length = flown_along(path, view.p)
        leg = ((path.start.x, path.start.y, path.start.z), (path.end.x, path.end.y, path.end.z))
        airspeed = slowed_airspeed(path.airspeed, self.end_airspeed, length - along - self.lead, leg, view.wind)
        return path._replace(airspeed=airspeed)

    def _begin_here(self, view: VehicleView) -> None:
        """Fly straight to the end from where a circle left."""
        path, p = self.reference.path, view.p
        start = path.start._replace(x=float(p[0]), y=float(p[1]), z=float(p[2]))
        self.reference, self.lead = self.reference._replace(path=path._replace(start=start)), 0.0

    def done(self, view: VehicleView) -> bool:
        """Held long enough at the end, or past it."""
        path = self.reference.path
        if path.stop:
            return self.arrived is not None and not view.forward and view.time - self.arrived >= self.hold
        if self.passage is not None:
            return self.passage.is_passed(view, path, self.lead)
        flown, length = flown_along(path, view.p)
        if self.lead > 0.0:
            return length - flown <= self.lead
        return flown >= length or math.dist(view.p[:2], path.end[:2]) <= self.acceptance


@dataclass(slots=True)
class LandAfter:
    """Land below a leg's end, with the crosswind heading of the wind as it is known there.

    Turned back to the leg's own course, belly or back to the wind, it would be blown metres away.
    """

    leg: FlyLeg
    rate: float  # vertical speed near the ground [m/s]
    down: LandingDescent | None = None  # from where the leg ended

    @property
    def landing(self) -> bool:
        """Whether touching the ground ends it."""
        return self.down is not None and self.down.landing

    def update(self, view: VehicleView) -> Reference:
        """The reference of the descent."""
        if self.down is None:
            above = upright(self.leg.update(view))
            heading = above.heading if self.leg.keep_heading else crosswind_heading(above.heading, view.wind)
            self.down = LandingDescent(above._replace(heading=heading), self.rate)
        return self.down.update(view)

    def done(self, view: VehicleView) -> bool:  # noqa: ARG002 - the ground ends it
        """Never."""
        return False


def crosswind_heading(heading: float, wind: Point, light: float = LIGHT_WIND) -> float:
    """The heading to hover at in a wind: with the span along the wind, the wing feels nothing of it [rad].

    With the belly or the back to a wind above 4 m/s, the elevons are nearly saturated by holding the nose up.
    Less than ``light`` of it [m/s] does not change the heading.
    """
    if math.hypot(wind[0], wind[1]) < light:
        return heading
    across = math.atan2(wind[1], wind[0]) + 0.5 * math.pi
    off = math.remainder(across - heading, math.pi)  # either side will do
    return heading + off


def stretches_of(manoeuvre: Manoeuvre | None, path: Path) -> tuple[WayStretch, ...]:
    """The leg or circle under way, whose path is given, and the legs flown forward after it in a sequence."""
    step = current_step(manoeuvre)
    if path.kind != LEG or not isinstance(step, FlyLeg):
        return (WayStretch(path),)
    steps = manoeuvre.steps[manoeuvre.index + 1 :] if isinstance(manoeuvre, ManoeuvreSequence) else ()
    legs = [
        leg for leg in itertools.takewhile(lambda after: isinstance(after, FlyLeg), steps) if isinstance(leg, FlyLeg)
    ]
    first = WayStretch(path, step.lead, step.end_airspeed)
    return (first, *(WayStretch(leg.reference.path, leg.lead, leg.end_airspeed) for leg in legs))
