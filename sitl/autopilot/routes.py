"""Legs and returns: hovered or flown forward, whichever the prediction finds better."""

from __future__ import annotations

from protocol.dialect.vocabulary import Way
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point, Reference, at, hover_at
from sitl.guidance.legs import FlyLeg, LandAfter, leg_reference
from sitl.guidance.manoeuvres import FlyTo, Manoeuvre, ManoeuvreSequence, Ramp, land_at
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser, LegEnd


def route_to(
    view: VehicleView, reference: Reference, settings: Settings, chooser: Chooser | None, requested: Way = Way.NONE
) -> FlyTo | FlyLeg:
    """One leg from where the vehicle is to a reference, in forward flight if that is better or requested."""
    if chooser is not None:
        end = LegEnd(reference.position, requested)
        decision = chooser.choose(view, view.p, [end], settings, settings.airspeed)[0]
        if decision.way is Way.FORWARD:
            leg = leg_reference(view.p, reference.position, reference, settings.airspeed, stop=True)
            return FlyLeg(leg, settings.acceptance)
    return FlyTo(reference, settings.acceptance)


def return_route(
    view: VehicleView,
    last: Reference,
    settings: Settings,
    to: Point,
    chooser: Chooser | None = None,
    requested: Way = Way.NONE,
) -> ManoeuvreSequence:
    """Climb to the height of a point, world NWU [m], or stay higher, fly there and land below it."""
    high = max(view.p[2], to[2])
    here = hover_at((view.p[0], view.p[1], high), last.heading, settings.hover_speed)
    above = at(here, (to[0], to[1], high))
    climbed = view if view.forward else view._replace(p=here.position)
    leg = route_to(climbed, above, settings, chooser, requested)
    landing = land_after(leg, above, settings)
    return ManoeuvreSequence((leg, landing) if view.forward else (Ramp(here, settings.climb_rate), leg, landing))


def land_after(approach: Manoeuvre, above: Reference, settings: Settings) -> Manoeuvre:
    """The landing below the end of an approach, which is at a reference."""
    if isinstance(approach, FlyLeg):
        return LandAfter(approach, settings.descent_rate)
    return land_at(above, settings.descent_rate)
