"""Legs and returns: hovered or flown forward, whichever the prediction finds better, and round what is in the way.

A leg whose straight way keeps the clearance is one manoeuvre. Else it is led past the obstacles by
:mod:`sitl.enclosure.detours`: in forward flight where every corner leaves room to turn in and the end room to stop, or
in the hover from corner to corner. Where there is no way the answer is why, and nothing is flown.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import Refusal
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, at, hover_at
from sitl.enclosure.arena_detours import crossed, crosses_area, detour
from sitl.enclosure.geometry import Arena
from sitl.guidance.landing import LandingDescent
from sitl.guidance.leg_speeds import corner_lead, leaves_room, leg_airspeeds, speed_along
from sitl.guidance.legs import FlyLeg, LandAfter, leg_reference
from sitl.guidance.limits import MIN_AIRSPEED
from sitl.guidance.manoeuvres import ComeToRest, FlyTo, Manoeuvre, ManoeuvreSequence, PassBy, Ramp
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser, LegEnd

FORWARD_DRIFT = 3.0  # from its leg in forward flight, wind and transitions included [m]
OVERSHOOT = 10.0  # of a stop in forward flight, and of the transition before the first leg [m]


def route_to(
    view: VehicleView,
    reference: Reference,
    settings: Settings,
    chooser: Chooser | None,
    arena: Arena,
    requested: LegMode = LegMode.NONE,
    *,
    acceptance: float | None = None,
    hold: float = 0.0,
) -> FlyTo | FlyLeg | ManoeuvreSequence | Refusal:
    """The way from where the vehicle is to a reference, in forward flight if that is better or requested.

    Args:
        view: The vehicle as it is now.
        reference: Where to.
        settings: By which it flies.
        chooser: Decides whether it is hovered; None: it is.
        arena: With the obstacles.
        requested: How to fly it.
        acceptance: How near counts as arrived [m]; None takes that of the settings.
        hold: How long to stay there before the manoeuvre is done [s].

    Returns:
        The manoeuvre, or why there is no way.
    """
    near = settings.acceptance if acceptance is None else acceptance
    route = detour(arena, view.p, reference.position, settings.clearance)
    if isinstance(route, Refusal):
        return route
    forward = forward_route(view, reference, settings, chooser, arena, requested, near, hold)
    if forward is not None:
        return forward
    last = FlyTo(reference, near, hold)
    if len(route) == 1 and not (view.forward and arena.obstacles):
        return last
    if view.forward:
        rest = hover_at(stop_of(view), reference.heading, reference.speed)
        stopped = detour(arena, rest.position, reference.position, settings.clearance)
        if isinstance(stopped, Refusal):
            return stopped
        return ManoeuvreSequence((ComeToRest(rest), *(PassBy(at(reference, p)) for p in stopped[:-1]), last))
    return ManoeuvreSequence((*(PassBy(at(reference, p)) for p in route[:-1]), last))


def stop_of(view: VehicleView) -> Point:
    """The point at which a vehicle can come to rest, at its height, world NWU [m]."""
    speed = math.hypot(view.v[0], view.v[1])
    ahead = view.stopping_distance / speed if speed > 1.0 else 0.0
    return (view.p[0] + ahead * view.v[0], view.p[1] + ahead * view.v[1], view.p[2])


def forward_route(
    view: VehicleView,
    reference: Reference,
    settings: Settings,
    chooser: Chooser | None,
    arena: Arena,
    requested: LegMode,
    acceptance: float,
    hold: float = 0.0,
) -> FlyLeg | ManoeuvreSequence | None:
    """The same flown forward; None where the hover is better, or forward flight has no room."""
    if chooser is None:
        return None
    end = LegEnd(reference.position, requested)
    decision = chooser.choose(view, view.p, [end], settings, settings.airspeed)[0]
    if decision.leg_mode is not LegMode.FORWARD:
        return None
    if not arena.obstacles:
        leg = leg_reference(view.p, reference.position, reference, settings.airspeed, stop=True)
        return FlyLeg(leg, acceptance, hold)
    wide = settings.clearance + FORWARD_DRIFT
    route = detour(arena, view.p, reference.position, wide, level=True)
    if isinstance(route, Refusal):
        return None
    points = (view.p, *route)
    speeds = leg_airspeeds(points, settings.airspeed, view.wind)
    if not flies_clear(arena, points, speeds, settings.clearance, view):
        return None
    legs = []
    for i, (start, stop, speed) in enumerate(zip(points, route, speeds, strict=False)):
        is_last = i == len(route) - 1
        lead = 0.0 if is_last else corner_lead(start, stop, route[i + 1], speed_along(start, stop, speed, view.wind))
        leg = leg_reference(start, stop, at(reference, stop), speed, stop=is_last)
        legs.append(FlyLeg(leg, acceptance, hold if is_last else 0.0, lead))
    return legs[0] if len(legs) == 1 else ManoeuvreSequence(tuple(legs))


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


def return_route(
    view: VehicleView,
    last: Reference,
    settings: Settings,
    to: Point,
    arena: Arena,
    chooser: Chooser | None = None,
    requested: LegMode = LegMode.NONE,
) -> ManoeuvreSequence | Refusal:
    """Climb to the height of a point, world NWU [m], or stay higher, fly there and land below it; or why not."""
    high = max(view.p[2], to[2])
    here = hover_at((view.p[0], view.p[1], high), last.heading, settings.hover_speed)
    above = at(here, (to[0], to[1], high))
    climbs = not view.forward
    if climbs and crossed(arena, view.p, here.position, settings.clearance):
        here, climbs = at(here, view.p), False
    climbed = view if view.forward else view._replace(p=here.position)
    if reason := no_descent(arena, above.position, settings.clearance):
        return Refusal(reason)
    leg = route_to(climbed, above, settings, chooser, arena, requested)
    if isinstance(leg, Refusal):
        return leg
    landing = land_after(leg, above, settings)
    return ManoeuvreSequence((Ramp(here, settings.climb_rate), leg, landing) if climbs else (leg, landing))


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
