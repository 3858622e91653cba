"""Ends of manoeuvres under way: moved a little, or given a heading, without beginning anew."""

from __future__ import annotations

from sitl.control.reference import Reference
from sitl.guidance.legs import FlyLeg, leg_reference
from sitl.guidance.manoeuvres import FlyTo, Manoeuvre, ManoeuvreSequence


def moved_end(manoeuvre: Manoeuvre, target: Reference, *, turns: bool) -> Manoeuvre:
    """The same manoeuvre, or what is left of it, to a target near its end.

    Args:
        manoeuvre: Is changed. One that ends otherwise than in a leg stays as it is.
        target: The hover at the end.
        turns: Whether the heading of the target was asked for; else a leg flown forward chooses it.
    """
    if isinstance(manoeuvre, ManoeuvreSequence):
        last = moved_end(manoeuvre.steps[-1], target, turns=turns)
        manoeuvre.steps = (*manoeuvre.steps[:-1], last)
    elif isinstance(manoeuvre, FlyTo):
        manoeuvre.reference = target
    elif isinstance(manoeuvre, FlyLeg) and manoeuvre.upright:
        return FlyTo(target, manoeuvre.acceptance, manoeuvre.hold)
    elif isinstance(manoeuvre, FlyLeg):
        _move_leg(manoeuvre, target)
        if turns:
            end_at_heading(manoeuvre, target.heading)
    return manoeuvre


def end_at_heading(manoeuvre: Manoeuvre, heading: float) -> None:
    """Have a leg flown forward end at a heading [rad] that was asked for, not at one of its own choice."""
    if isinstance(manoeuvre, ManoeuvreSequence):
        end_at_heading(manoeuvre.steps[-1], heading)
    elif isinstance(manoeuvre, FlyLeg):
        manoeuvre.reference = manoeuvre.reference._replace(heading=heading)
        manoeuvre.keep_heading = True


def _move_leg(leg: FlyLeg, target: Reference) -> None:
    reference, path = leg.reference, leg.reference.path
    if target.position == reference.position:
        return
    moved = leg_reference(path.start, target.position, target, path.airspeed, stop=path.stop)
    leg.reference = moved._replace(heading=reference.heading) if leg.keep_heading else moved
    leg.arrived = None
