"""Legs and returns: hovered or flown forward, whichever the prediction finds better, and round what is in the way.

Legs flown forward without a stop between them are planned together where there are no obstacles. Where there are, a
leg whose straight way keeps the clearance is one manoeuvre, and stops at its end. Else it is led past them by
:mod:`sitl.enclosure.detours`: in forward flight where every corner leaves room to turn in and the end room to stop, or
in the hover from corner to corner. Where there is no way the answer is why, and nothing is flown.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import Refusal
from protocol.ranges import LEGS_AHEAD, MIN_AIRSPEED
from sitl.autopilot.mission.speeds import MissionSpeeds
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, at, hover_at
from sitl.enclosure.arena_detours import crossed, crosses_area, detour
from sitl.enclosure.arena_files import Arena
from sitl.guidance.landing import LandingDescent
from sitl.guidance.leg_speeds import corner_cut, corner_lead, leaves_room, leg_airspeeds, speed_along
from sitl.guidance.legs import MIN_REACH, FlyLeg, LandAfter, Passage, is_left_turn, lead_on, leg_reference
from sitl.guidance.manoeuvre_changes import end_at_heading
from sitl.guidance.manoeuvres import ComeToRest, FlyTo, Manoeuvre, ManoeuvreSequence, PassBy, Ramp
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView
from sitl.prediction.chooser import Chooser, LegEnd

FORWARD_DRIFT = 3.0  # from its leg in forward flight, wind and transitions included [m]
OVERSHOOT = 10.0  # of a stop in forward flight, and of the transition before the first leg [m]
HOVER_STOP_TIME = 0.5  # a hovering vehicle stops within its distance of this time [s]


class Arrival(NamedTuple):
    """Terms on which a leg ends at its reference."""

    radius: float = 0.0  # how near counts as arrived, or as passed [m]; 0 takes the distances of the settings
    hold: float = 0.0  # how long to stay there before the manoeuvre is done [s]
    turns: bool = False  # the heading of the reference was asked for; else a leg flown forward chooses it


FULL_STOP = Arrival()


class ChainAhead(NamedTuple):
    """Legs flown forward without a stop between them; empty where the leg under way is no such leg."""

    points: tuple[Point, ...] = ()  # where the first begins, then the end of each, world NWU [m]
    is_long: bool = False  # they go on beyond what is planned ahead
    seqs: tuple[int, ...] = ()  # mission items at the ends of the legs


class PlannedLeg(NamedTuple):
    """The manoeuvre of a leg, and the legs that it was planned with."""

    manoeuvre: FlyTo | FlyLeg | ManoeuvreSequence
    chain: ChainAhead = ChainAhead()


class LegPlanner(NamedTuple):
    """Decides how legs are flown, and makes their manoeuvres."""

    settings: Settings
    chooser: Chooser | None  # decides whether a leg is hovered; None: every one is
    arena: Arena  # with the obstacles
    speeds: MissionSpeeds  # asked for, in place of those of the settings
    requested: LegMode = LegMode.NONE  # how to fly legs

    def leg_to(
        self, view: VehicleView, reference: Reference, arrival: Arrival = FULL_STOP
    ) -> FlyTo | FlyLeg | ManoeuvreSequence | Refusal:
        """The way from where the vehicle is to a hover, in forward flight if that is better; or why there is none."""
        planned = self.plan(view, reference, [LegEnd(reference.position, self.requested)], arrival)
        return planned if isinstance(planned, Refusal) else planned.manoeuvre

    def plan(
        self,
        view: VehicleView,
        reference: Reference,
        ends: Sequence[LegEnd],
        arrival: Arrival = FULL_STOP,
        start: Point | None = None,
    ) -> PlannedLeg | Refusal:
        """The first of some legs, planned with those after it; or why there is no way.

        Args:
            view: The vehicle as it is now.
            reference: The hover at the end of the first leg.
            ends: Of the legs, which follow one another without a stop.
            arrival: Terms of the first leg's end.
            start: Where that begins, world NWU [m]; None: where the vehicle is, as past obstacles.
        """
        route = detour(self.arena, view.p, reference.position, self.settings.clearance)
        if isinstance(route, Refusal):
            return route
        if self.arena.obstacles:
            ends, start = ends[:1], None
        forward = self._chosen_forward(view, start or view.p, ends)
        planned = self._forward(view, reference, forward, arrival) if forward.points else None
        return planned or self._hovered(view, reference, route, arrival)

    def _chosen_forward(self, view: VehicleView, start: Point, ends: Sequence[LegEnd]) -> ChainAhead:
        """The legs that are better flown forward; none where the first is not."""
        if self.chooser is None:
            return ChainAhead()
        decisions = self.chooser.choose(view, start, ends, self.settings, self.speeds.airspeed(self.settings))
        made = zip(ends, decisions, strict=True)
        ahead = [end for end, _ in itertools.takewhile(lambda pair: pair[1].leg_mode is LegMode.FORWARD, made)]
        points, seqs = (start, *(end.p for end in ahead)), tuple(end.seq for end in ahead)
        return ChainAhead(points, len(ends) == LEGS_AHEAD, seqs) if ahead else ChainAhead()

    def airspeeds(self, chain: ChainAhead, wind: Point) -> list[float]:
        """Airspeeds of a chain: that asked for, or slower where the legs after each need room [m/s]."""
        wanted = self.speeds.through_air(chain.points, self.speeds.airspeed(self.settings), wind)
        return [wanted] * len(chain.points) if chain.is_long else leg_airspeeds(chain.points, wanted, wind)

    def _forward(
        self, view: VehicleView, reference: Reference, chain: ChainAhead, arrival: Arrival
    ) -> PlannedLeg | None:
        """Legs flown forward; None where there is no room for them past the obstacles."""
        if not self.arena.obstacles:
            leg = self._leg(chain.points, self.airspeeds(chain, view.wind), view.wind, reference, arrival)
            if len(chain.points) > 2:
                self._pass_waypoint(leg, chain.points, view.wind, arrival.radius)
            return PlannedLeg(leg, chain)
        wide = self.settings.clearance + FORWARD_DRIFT
        route = detour(self.arena, view.p, reference.position, wide, level=True)
        if isinstance(route, Refusal):
            return None
        points = (view.p, *route)
        speeds = without_slowing(self.airspeeds(ChainAhead(points), view.wind))
        if not flies_clear(self.arena, points, speeds, self.settings.clearance, view):
            return None
        passing = arrival._replace(turns=False)
        legs = [
            self._leg(points[i:], speeds[i:], view.wind, reference, arrival if i == len(speeds) - 1 else passing)
            for i in range(len(speeds))
        ]
        return PlannedLeg(legs[0] if len(legs) == 1 else ManoeuvreSequence(tuple(legs)))

    def _leg(
        self, points: Sequence[Point], airspeeds: Sequence[float], wind: Point, last: Reference, arrival: Arrival
    ) -> FlyLeg:
        """The first leg through points, each leg at its airspeed: it stops at its end unless others follow."""
        start, end = points[:2]
        stops = len(points) == 2
        reference = leg_reference(start, end, last, airspeeds[0], stop=stops)
        leg = FlyLeg(reference, arrival.radius or self.settings.acceptance, arrival.hold if stops else 0.0)
        if arrival.turns:
            end_at_heading(leg, last.heading)
        if not stops:
            lead_on(leg, points, airspeeds, wind)
        return leg

    def _pass_waypoint(self, leg: FlyLeg, points: Sequence[Point], wind: Point, radius: float) -> None:
        """Have a leg pass its end near enough: within a radius [m] if there is one, as a turn cuts its corner else."""
        start, corner, after = points[:3]
        if radius > 0.0:  # the turn to the next leg begins within the radius
            leg.lead, reach = radius, max(radius, MIN_REACH)
        else:
            airspeed = min(leg.reference.path.airspeed, leg.end_airspeed)
            speed = speed_along(start, corner, airspeed, wind)
            reach = max(leg.acceptance, corner_cut(speed))
        leg.passage = Passage(reach, self.settings.height_acceptance, is_left_turn(start, corner, after))

    def _hovered(
        self, view: VehicleView, reference: Reference, route: Sequence[Point], arrival: Arrival
    ) -> PlannedLeg | Refusal:
        """A way hovered from corner to corner; in forward flight the vehicle comes to rest before it."""
        last = FlyTo(reference, arrival.radius or self.settings.acceptance, arrival.hold)
        first: tuple[Manoeuvre, ...] = ()
        if view.forward and self.arena.obstacles:
            rest = hover_at(stopping_point(view), reference.heading, reference.speed)
            stopped = detour(self.arena, rest.position, reference.position, self.settings.clearance)
            if isinstance(stopped, Refusal):
                return stopped
            first, route = (ComeToRest(rest),), stopped
        elif len(route) == 1:
            return PlannedLeg(last)
        return PlannedLeg(ManoeuvreSequence((*first, *(PassBy(at(reference, p)) for p in route[:-1]), last)))

    def return_to(self, view: VehicleView, last: Reference, to: Point) -> ManoeuvreSequence | Refusal:
        """Climb to the height of a point, world NWU [m], or stay higher, fly there and land below it; or why not."""
        high = max(view.p[2], to[2])
        here = hover_at((view.p[0], view.p[1], high), last.heading, self.settings.hover_speed)
        above = at(here, (to[0], to[1], high))
        climbs = not view.forward
        if climbs and crossed(self.arena, view.p, here.position, self.settings.clearance):
            here, climbs = at(here, view.p), False
        climbed = view if view.forward else view._replace(p=here.position)
        if reason := no_descent(self.arena, above.position, self.settings.clearance):
            return Refusal(reason)
        leg = self.leg_to(climbed, above)
        if isinstance(leg, Refusal):
            return leg
        landing = land_after(leg, above, self.settings)
        return ManoeuvreSequence((Ramp(here, self.settings.climb_rate), leg, landing) if climbs else (leg, landing))


def stopping_point(view: VehicleView) -> Point:
    """The point at which a vehicle can stop, not lower than a hold may be; world NWU [m]."""
    p, v = view.p, view.v
    speed = math.hypot(v[0], v[1])
    ahead = view.stopping_distance / speed if view.forward and speed > 1.0 else HOVER_STOP_TIME
    return (p[0] + ahead * v[0], p[1] + ahead * v[1], max(p[2] + HOVER_STOP_TIME * v[2], MIN_HOLD_HEIGHT))


def without_slowing(airspeeds: Sequence[float]) -> list[float]:
    """Airspeeds of legs none of which is slowed down on: each is flown no faster than the next."""
    return [min(airspeeds[i : i + 2]) for i in range(len(airspeeds))]


def flies_clear(
    arena: Arena, points: Sequence[Point], speeds: Sequence[float], clearance: float, view: VehicleView
) -> bool:
    """Whether legs flown forward have room: each for its turns and the stop, and the air about them.

    Args:
        arena: With the obstacles.
        points: Where the first leg begins, then the end of each, world NWU [m].
        speeds: Airspeeds of the legs [m/s].
        clearance: From obstacles [m].
        view: The vehicle, which may have to turn round first.
    """
    if not leaves_room(points, speeds, view.wind):
        return False
    wide = clearance + FORWARD_DRIFT
    if any(crossed(arena, a, b, wide) for a, b in itertools.pairwise(points)):
        return False
    radius = 2.0 * max(speeds[0], MIN_AIRSPEED) ** 2 / 6.0 if view.forward else OVERSHOOT
    if crosses_area(arena, _about(points[0], radius), clearance):
        return False
    beyond = _beyond(points[-2], points[-1], OVERSHOOT)
    if crossed(arena, points[-1], beyond, wide):
        return False
    for start, corner, after, speed in zip(points, points[1:], points[2:], speeds, strict=False):
        lead = corner_lead(start, corner, after, speed_along(start, corner, speed, view.wind))
        cut = (_beyond(start, corner, -lead), corner, _beyond(after, corner, -lead))
        if crosses_area(arena, cut, clearance + FORWARD_DRIFT / 2.0):
            return False
    return True


def _beyond(start: Point, end: Point, distance: float) -> Point:
    """A point so far beyond the end of a leg, or before it [m]."""
    length = max(math.dist(start[:2], end[:2]), 1e-9)
    share = distance / length
    return (end[0] + share * (end[0] - start[0]), end[1] + share * (end[1] - start[1]), end[2])


def _about(p: Point, radius: float) -> list[Point]:
    return [(p[0] + x * radius, p[1] + y * radius, p[2]) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]


def no_descent(arena: Arena, above: Point, clearance: float) -> str:
    """The reason why there is no landing straight below a point, world NWU [m]; empty if there is one."""
    under = crossed(arena, (above[0], above[1], 0.0), above, clearance)
    return f"'{under[0].name}' is in the way of the landing" if under else ""


def land_after(approach: Manoeuvre, above: Reference, settings: Settings) -> Manoeuvre:
    """The landing below the end of an approach, which is at a reference."""
    end = approach.steps[-1] if isinstance(approach, ManoeuvreSequence) else approach
    if isinstance(end, FlyLeg):
        return LandAfter(end, settings.descent_rate)
    return LandingDescent(above, settings.descent_rate)
