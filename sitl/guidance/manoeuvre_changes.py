"""Changes of manoeuvres under way: another end, heading or speed, without beginning anew."""

from __future__ import annotations

from collections.abc import Iterator

from sitl.control.reference import Reference
from sitl.guidance.circles import CircleToHeight, FlyCircle, circle_airspeed
from sitl.guidance.legs import FlyLeg, LandAfter, leg_reference
from sitl.guidance.manoeuvres import ComeToRest, FlyTo, Hold, Manoeuvre, ManoeuvreSequence, PassBy, Ramp

# Ends of manoeuvres under way: moved a little, or given a heading, without beginning anew.


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


# New speeds for a manoeuvre that is under way: they act at once, and change nothing else about it.


Part = FlyTo | Hold | FlyLeg | FlyCircle | ComeToRest | PassBy | Ramp


def change_hover_speed(manoeuvre: Manoeuvre | None, speed: float) -> None:
    """Hover no faster than a speed [m/s] from now on."""
    for part in _parts(manoeuvre):
        part.reference = part.reference._replace(speed=float(speed))


def change_airspeed(manoeuvre: Manoeuvre | None, airspeed: float) -> None:
    """Fly forward at an airspeed [m/s] from now on; a tight circle is flown slower."""
    for part in _parts(manoeuvre):
        path = part.reference.path
        if part.reference.forward:
            wanted = circle_airspeed(path.radius, airspeed) if isinstance(part, FlyCircle) else airspeed
            part.reference = part.reference._replace(path=path._replace(airspeed=float(wanted)))


def follow_hover_speed(manoeuvre: Manoeuvre | None, before: float, after: float) -> None:
    """Change hovers at the speed of before, or faster than the new one, to the new one [m/s]."""
    for part in _parts(manoeuvre):
        if before != after and (part.reference.speed == before or part.reference.speed > after):
            change_hover_speed(part, after)


def follow_airspeed(manoeuvre: Manoeuvre | None, before: float, after: float) -> None:
    """Change forward flights at the airspeed of before to the new one [m/s]."""
    for part in _parts(manoeuvre):
        path = part.reference.path
        usual = circle_airspeed(path.radius, before) if isinstance(part, FlyCircle) else before
        if before != after and path.airspeed == usual:
            change_airspeed(part, after)


def change_vertical_speeds(manoeuvre: Manoeuvre | None, climb: float | None, descent: float | None) -> None:
    """Climb and descend no faster than this on hovered legs [m/s]; None: as fast as the laws do."""
    for part in _parts(manoeuvre):
        if isinstance(part, FlyTo):
            part.climb, part.descent = climb, descent


def _parts(manoeuvre: Manoeuvre | None) -> Iterator[Part]:
    if isinstance(manoeuvre, ManoeuvreSequence):
        for step in manoeuvre.steps[manoeuvre.index :]:
            yield from _parts(step)
    elif isinstance(manoeuvre, LandAfter):
        yield from _parts(manoeuvre.leg)
        yield from _parts(manoeuvre.down)
    elif isinstance(manoeuvre, CircleToHeight):
        yield manoeuvre.circle
    elif isinstance(manoeuvre, Part):
        yield manoeuvre
