"""Legs in forward flight: those that stop at their end, those that fly by it, and the landing after one."""

from __future__ import annotations

import math
from dataclasses import dataclass

from sitl.control.forward_flight.forward_guidance import stopping_distance
from sitl.control.reference import Point, Reference, along, hover_at, leg, upright
from sitl.design.gains import line_of_sight_gains
from sitl.guidance.landing import LandingDescent
from sitl.guidance.manoeuvres import distance
from sitl.guidance.view import VehicleView
from sitl.guidance.waypoint_passing import Passage, flown_along

COURSE_TIME = 30.0  # a course is a leg this long, begun anew at every set-point [s]
BRAKING_CLIMB = 1.2  # a stop is approached this far below its point, because braking climbs [m]
MIN_BRAKING_HEIGHT = 8.0  # only stops at least this high are approached from below [m]
MAX_LEVEL_SHARE = 0.7  # of a leg, flown level at its end [-]
BACK_TRANSITION_END_SPEED = 4.0  # slower than this, a back transition is nearly over [m/s]
LIGHT_WIND = 2.5  # less wind than this does not change the heading of the hover [m/s]
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
        if self.crosswind is None and view.forward and (left < NEARLY_THERE or slow):
            self.crosswind = crosswind_heading(self.reference.heading, view.wind)
        heading = self.reference.heading if self.crosswind is None or self.keep_heading else self.crosswind
        reference = self.reference._replace(heading=heading)
        return upright(reference) if self.upright else reference

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
