"""Makes references of a plan's aims: hovered, or flown forward where the prediction finds that better.

Legs, circles and the choice between both are those of ``sitl.guidance`` and ``sitl.prediction``; here is only where the
hover is sent along a leg or an arc, and how its altitude moves.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

from protocol.dialect.vocabulary import LegMode
from protocol.flight_plans.flight_plan import EnuPoint
from protocol.ranges import LEGS_AHEAD, MIN_AIRSPEED
from sitl.autopilot.flight_plan.aims import Aim, AimKind
from sitl.autopilot.flight_plan.plan_state import PlanFrame, PlanInputs
from sitl.control.reference import Point, Reference, hover_at
from sitl.guidance.circles import FlyCircle, circle_about
from sitl.guidance.landing import fast_descent_rate
from sitl.guidance.leg_speeds import leg_airspeeds
from sitl.guidance.legs import FlyLeg, lead_on, leg_reference
from sitl.guidance.setpoints import HeadingSetpoint, MovingReference
from sitl.guidance.view import MAX_HOVER_CLIMB, MIN_HOLD_HEIGHT
from sitl.prediction.chooser import LegEnd

__all__ = ["TOUCHDOWN_HEIGHT", "PlanSteering"]

LEG_LEAD = 3.0  # of the hover's target along a leg [m]
ARC_LEAD = 0.25 * math.pi  # of the hover's target along an arc, at most [rad]
ARC_ACCELERATION = 0.8  # towards the centre of a hovered arc [m/s2]
COURSE_LEAD = 5.0  # of the hover's target along a course [m]
MAX_CLIMB_LEAD = 1.0  # of the reference's altitude over the vehicle, where a plan asks for a vertical speed [m]
TOUCHDOWN_HEIGHT = 3.0  # a descent below this may end on the ground [m]
SLOW_HEIGHT = 1.5  # below this a descent is no faster than a landing [m]
LOWEST = -1.0  # where a descent to the ground leads [m]
MAX_REFERENCE_STEP = 0.1  # longest time that a reference moves at once [s]
SAME_TARGET = 0.3  # a target that moves by less does not begin its leg anew [m]
MIN_HOVER_SPEED = 0.2  # of the hover [m/s]


@dataclass(slots=True)
class PlanSteering:
    """Flies the aims of one plan, one after the other."""

    frame: PlanFrame = field(default_factory=PlanFrame)
    flown: Aim | None = None  # that ``manoeuvre`` was begun for
    manoeuvre: FlyLeg | FlyCircle | None = None  # in forward flight; None: hovered
    up: float | None = None  # altitude of the hover's reference [m]
    refused: str = ""  # why the vehicle is not sent where the aim is; empty if it is
    _at: float = 0.0  # time of the last tick [s]
    _lifted: Point | None = None  # where a take-off began
    _moving: MovingReference = field(default_factory=MovingReference)
    _velocity: Reference | None = None

    def rest(self) -> None:
        """The vehicle stands: its next flight begins anew."""
        self.flown, self.manoeuvre, self.up, self._lifted, self._velocity = None, None, None, None, None

    @property
    def sinks_to_ground(self) -> bool:
        """Whether the aim leads down to the ground."""
        return self.flown is not None and self.flown.climb is not None and self.flown.climb < 0.0

    def update(
        self, aim: Aim, inputs: PlanInputs, last: Reference, heading: float, speed: float, leg_mode: LegMode
    ) -> Reference:
        """The reference of one tick.

        Args:
            aim: What the plan wants.
            inputs: The vehicle.
            last: The reference of the tick before.
            heading: Wanted in the hover, world NWU [rad].
            speed: Greatest of the hover [m/s].
            leg_mode: How legs are asked to be flown.
        """
        view = inputs.view
        elapsed = min(max(view.time - self._at, 0.0), MAX_REFERENCE_STEP)
        self._at = view.time
        if self._is_new(aim, inputs.settings.min_leg):
            self.manoeuvre = self._begun(aim, inputs, hover_at(view.p, heading, speed), leg_mode)
            self._velocity = None
        self.flown = aim
        self.refused = ""
        up = self._altitude(aim, inputs, elapsed)
        if self.manoeuvre is not None:
            if aim.climb is None:
                self.up = view.p[2]
            elif isinstance(self.manoeuvre, FlyCircle):
                self.manoeuvre.reference = _at_height(self.manoeuvre.reference, up)
            return self._checked(self.manoeuvre.update(view), last, inputs)
        if aim.kind is AimKind.VELOCITY or aim.turn_rate != 0.0:
            return self._checked(self._moved(aim, inputs, last, heading, up), last, inputs)
        north, west, _ = self.frame.to_world(self._target(aim, self.frame.to_plan(view.p)))
        if self._takes_off(aim, inputs):
            lifted = self._lifted or view.p
            north, west = lifted[0], lifted[1]
        speed = self._hover_speed(aim, speed)
        return self._checked(hover_at((north, west, up), heading, speed), last, inputs)

    def _is_new(self, aim: Aim, far: float) -> bool:
        """Whether it is decided anew how an aim is flown: another one, or the same one elsewhere.

        Args:
            aim: What the plan wants.
            far: A target that is hovered to may move by so much at once [m].
        """
        flown = self.flown
        if flown is None or (aim.key, aim.kind) != (flown.key, flown.kind):
            return True
        moved = max(math.dist(aim.end, flown.end), math.dist(aim.start, flown.start))
        is_turned = abs(aim.radius - flown.radius) > SAME_TARGET
        if self.manoeuvre is None:
            return moved > far and self._velocity is None
        return moved > SAME_TARGET or is_turned

    def _begun(self, aim: Aim, inputs: PlanInputs, last: Reference, leg_mode: LegMode) -> FlyLeg | FlyCircle | None:
        """The manoeuvre that flies an aim in forward flight; None if the aim is hovered."""
        chooser, settings = inputs.chooser, inputs.settings
        if chooser is None or aim.is_hovered or not inputs.flying or inputs.view.landed:
            return None
        end = self.frame.to_world(aim.end)
        if aim.kind is AimKind.ARC:
            end = end if aim.climb is None else (end[0], end[1], inputs.view.p[2])
            if not chooser.orbits(end[2], leg_mode, settings):
                return None
            circle = circle_about(end, aim.radius, last, settings.airspeed) if aim.radius else None
            return circle if circle is not None and circle.reference.path.airspeed >= MIN_AIRSPEED else None
        if aim.climb is not None:
            return None
        if aim.kind is AimKind.COURSE and (leg_mode or LegMode(settings.leg_mode)) is LegMode.FORWARD:
            far = EnuPoint(
                aim.start.x + 1000.0 * math.sin(aim.course), aim.start.y + 1000.0 * math.cos(aim.course), aim.end.z
            )
            return self._forward_leg(aim._replace(kind=AimKind.POINT, end=far), inputs, last, leg_mode)
        return self._forward_leg(aim, inputs, last, leg_mode) if aim.kind in {AimKind.POINT, AimKind.LEG} else None

    def _forward_leg(self, aim: Aim, inputs: PlanInputs, last: Reference, leg_mode: LegMode) -> FlyLeg | None:
        chooser, view, settings = inputs.chooser, inputs.view, inputs.settings
        if chooser is None:
            return None
        start = self.frame.to_world(aim.start) if aim.kind is AimKind.LEG and view.forward else view.p
        points = [self.frame.to_world(point) for point in (aim.end, *aim.followers)][:LEGS_AHEAD]
        ends = [LegEnd(point, leg_mode) for point in points]
        decisions = chooser.choose(view, start, ends, settings, settings.airspeed)
        flown = [start]
        for point, decision in zip(points, decisions, strict=True):
            if decision.leg_mode is not LegMode.FORWARD:
                break
            flown.append(point)
        if len(flown) == 1:
            return None
        is_long = len(points) == LEGS_AHEAD
        airspeeds = [settings.airspeed] * len(points) if is_long else leg_airspeeds(flown, settings.airspeed, view.wind)
        stop = len(flown) == 2
        reference = leg_reference(
            start, flown[1], hover_at(flown[1], last.heading, last.speed), airspeeds[0], stop=stop
        )
        leg = FlyLeg(reference, settings.acceptance)
        if not stop:
            lead_on(leg, flown, airspeeds, view.wind)
        return leg

    def _altitude(self, aim: Aim, inputs: PlanInputs, elapsed: float) -> float:
        """Altitude set-point of the hover at this tick [m]."""
        view, settings = inputs.view, inputs.settings
        up = view.p[2] if self.up is None else self.up
        if aim.climb is not None:
            climb = max(aim.climb, 0.0) if view.forward else aim.climb  # only what stands upright sinks
            if climb < 0.0 and view.p[2] < SLOW_HEIGHT:
                climb = max(climb, -settings.descent_rate)
            up = min(max(up + climb * elapsed, view.p[2] - MAX_CLIMB_LEAD), view.p[2] + MAX_CLIMB_LEAD)
            self.up = max(up, LOWEST)
            return self.up
        wanted = max(self._wanted_altitude(aim, view.p), MIN_HOLD_HEIGHT)
        rises = view.p[2] < MIN_HOLD_HEIGHT  # a step near the ground would push the law to its limits
        climb, sink = (settings.climb_rate if rises else MAX_HOVER_CLIMB), fast_descent_rate(view)
        self.up = up + min(max(wanted - up, -sink * elapsed), climb * elapsed)
        return self.up

    def _wanted_altitude(self, aim: Aim, p: Point) -> float:
        if aim.kind is not AimKind.LEG:
            return aim.end.z
        along, length = _progress(aim, self.frame.to_plan(p))
        share = min(max(along / length, 0.0), 1.0) if length > 0.0 else 1.0
        return aim.start.z + share * (aim.end.z - aim.start.z)

    def _target(self, aim: Aim, p: EnuPoint) -> EnuPoint:
        """Position set-point of the hover."""
        match aim.kind:
            case AimKind.LEG:
                along, length = _progress(aim, p)
                share = min(max((along + LEG_LEAD) / length, 0.0), 1.0) if length > 0.0 else 1.0
                return EnuPoint(
                    aim.start.x + share * (aim.end.x - aim.start.x),
                    aim.start.y + share * (aim.end.y - aim.start.y),
                    aim.end.z,
                )
            case AimKind.ARC:
                return _on_arc(aim, p)
            case AimKind.COURSE:
                x, y = math.sin(aim.course), math.cos(aim.course)
                along = (p.x - aim.start.x) * x + (p.y - aim.start.y) * y + COURSE_LEAD
                return EnuPoint(aim.start.x + along * x, aim.start.y + along * y, aim.end.z)
            case _:
                return aim.end

    def _takes_off(self, aim: Aim, inputs: PlanInputs) -> bool:
        """Whether it still rises from the ground, straight up."""
        if inputs.view.landed or (aim.climb is not None and aim.climb < 0.0):
            self._lifted = inputs.view.p if inputs.view.landed else None
        elif inputs.view.p[2] > MIN_HOLD_HEIGHT:
            self._lifted = None
        return self._lifted is not None

    def _hover_speed(self, aim: Aim, speed: float) -> float:
        if aim.kind is AimKind.ARC:
            speed = min(speed, math.sqrt(ARC_ACCELERATION * abs(aim.radius)))
        return max(speed, MIN_HOVER_SPEED)

    def _moved(self, aim: Aim, inputs: PlanInputs, last: Reference, heading: float, up: float) -> Reference:
        """The reference that moves with a velocity, or turns."""
        if self._velocity is None:
            self._moving.restart(inputs.view.time)
            self._velocity = hover_at(inputs.view.p, heading, last.speed)
        turning = HeadingSetpoint(None, -aim.turn_rate) if aim.turn_rate else HeadingSetpoint(heading)
        v = (aim.end.y, -aim.end.x, 0.0) if aim.kind is AimKind.VELOCITY else (0.0, 0.0, 0.0)
        self._velocity = self._moving.move(v, turning, self._velocity, inputs.view, MAX_REFERENCE_STEP)
        x, y, _ = self._velocity.position
        if aim.kind is not AimKind.VELOCITY:
            x, y, _ = self.frame.to_world(aim.end)
        return hover_at((x, y, up), self._velocity.heading, last.speed)

    def _checked(self, reference: Reference, last: Reference, inputs: PlanInputs) -> Reference:
        """The reference, unless it leads where the vehicle may not be sent: then it stays."""
        p = reference.position
        inside = (p[0], p[1], max(p[2], 0.0))
        is_known = all(map(math.isfinite, inside))
        refusal = inputs.world.refuse(inside) if is_known else "the target is no place"
        if refusal is None:
            return reference
        self.refused, self.manoeuvre = refusal, None
        here = last.position if not last.forward else inputs.view.p
        held = (here[0], here[1], max(min(here[2], inputs.view.p[2] + MAX_CLIMB_LEAD), LOWEST))
        self.up = held[2]
        return hover_at(held, reference.heading, reference.speed)


def _progress(aim: Aim, p: EnuPoint) -> tuple[float, float]:
    """Distance along a leg, and its length [m]."""
    dx, dy = aim.end.x - aim.start.x, aim.end.y - aim.start.y
    length = math.hypot(dx, dy)
    return ((p.x - aim.start.x) * dx + (p.y - aim.start.y) * dy) / max(length, 1e-9), length


def _at_height(reference: Reference, up: float) -> Reference:
    """A circle at another altitude [m]."""
    path = reference.path
    centre = path.start._replace(z=up)
    return reference._replace(position=centre, path=path._replace(start=centre, end=centre))


def _on_arc(aim: Aim, p: EnuPoint) -> EnuPoint:
    """A point of the circle ahead of the vehicle."""
    size = abs(aim.radius)
    if size == 0.0:
        return aim.end
    lead = min(LEG_LEAD / size, ARC_LEAD)
    bearing = math.atan2(p.x - aim.end.x, p.y - aim.end.y) + math.copysign(lead, aim.radius)
    return EnuPoint(aim.end.x + size * math.sin(bearing), aim.end.y + size * math.cos(bearing), aim.end.z)
