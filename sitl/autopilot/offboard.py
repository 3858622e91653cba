"""Offboard flight: set-points that a program streams, flown in OFFBOARD while they keep arriving."""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect.vocabulary import Law
from protocol.names import Mode
from protocol.plans.plan import Refusal
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.arming import Arming
from sitl.autopilot.flight_state import FlightState
from sitl.control.reference import AttitudeReference, Point, Reference, hover_at
from sitl.guidance.legs import FlyLeg, course_reference
from sitl.guidance.manoeuvre_changes import moved_end
from sitl.guidance.manoeuvres import FlyTo, Hold, Manoeuvre, ManoeuvreSequence
from sitl.guidance.setpoints import (
    KEEP_HEADING,
    LIFT_HEIGHT,
    FlyAttitude,
    HeadingSetpoint,
    MovingReference,
    attitude_for,
    from_heading_axes,
    lifts,
    refuse_attitude,
    refuse_to_go_on,
)
from sitl.guidance.view import MAX_HOVER_CLIMB, MAX_HOVER_DESCENT, MAX_HOVER_TURN_RATE
from sitl.prediction.mode_choice import MAX_CLIMB_SLOPE, MAX_DESCENT_SLOPE

SAME_END = 0.05  # where there are obstacles, whose ways depend on their end [m]
SAME_LEG = 5.0  # a streamed position that moved less than this is the same leg [m]
LIFT_MARGIN = 0.5  # a lift-off aims this much above the height where it ends, to get there at speed [m]
TURN_RATE_TOLERANCE = 1e-6  # for rates that were rounded on the wire [rad/s]


class _Offset(NamedTuple):
    """The last offset from the vehicle, and the place it led to."""

    offset: Point
    body: bool
    place: Point  # world NWU [m]


class OffboardRequests:
    """Takes set-points and starts OFFBOARD. Each ``set_`` method returns why the set-point is refused, or None.

    Args:
        flight: The flight that the set-points are for.
        arming: What is chosen before it begins with it.
        moving: The reference that velocities move.
    """

    def __init__(self, flight: FlightState, arming: Arming, moving: MovingReference) -> None:
        self._flight, self._arming, self._moving = flight, arming, moving
        self._first = flight.reference  # what OFFBOARD starts with
        self._turns = False  # the heading of that was asked for
        self._received: float | None = None  # when the last set-point arrived [s]
        self._offset: _Offset | None = None
        self._lifted_from: Point | None = None  # while attitudes wait for their height

    def choose(self) -> Answer:
        """Choose OFFBOARD before arming; arming then starts it. Refused unless set-points arrive."""
        if self.is_stale():
            return self._flight.refuse(REJECTED, "OFFBOARD refused: no set-points are arriving")
        return self._arming.wait_for_arming(Mode.OFFBOARD, self.start)

    def start(self) -> Answer:
        """Enter OFFBOARD; refused unless set-points arrive."""
        flight = self._flight
        if self.is_stale():
            return flight.refuse(REJECTED, "OFFBOARD refused: no set-points are arriving")
        if not flight.armed:
            return flight.refuse(REJECTED, "OFFBOARD refused: not armed")
        waiting = self._lifted_from is not None
        moving = self._first.forward or self._first.steered or waiting
        leg = Hold(self._first) if moving else flight.leg_to(self._first, turns=self._turns)
        if isinstance(leg, Refusal):
            return flight.refuse(DENIED, f"OFFBOARD denied: {leg.text}")
        flight.enter(Mode.OFFBOARD, leg)
        flight.flying = flight.flying or not waiting
        return Answer(ACCEPTED)

    @property
    def _is_in_force(self) -> bool:
        """Whether set-points are flown now, and not kept for the start."""
        return self._flight.mode is Mode.OFFBOARD and self._flight.armed

    def is_stale(self) -> bool:
        """Whether set-points have stopped, or never came."""
        now, timeout = self._flight.view.time, self._flight.settings.setpoint_timeout
        return self._received is None or now - self._received > timeout

    def attitude_problem(self, last: Law) -> str | None:
        """The reason why the attitude set-point can be flown no longer, or None; ``last`` is the law a tick before."""
        if isinstance(self._flight.manoeuvre, FlyAttitude):
            return refuse_to_go_on(self._flight.view, last)
        return None

    def set_attitude(self, attitude: AttitudeReference) -> str | None:
        """Take an attitude with its rates and thrust; from the ground the vehicle first climbs to their height."""
        flight, view = self._flight, self._flight.view
        reason = refuse_attitude(attitude, view)
        self._watch_lift_off()
        if reason is None and self._lifted_from is None:
            reason = refuse_to_go_on(view, view.law)
        if reason is not None:
            return reason
        self._received = view.time
        manoeuvre = self._attitude_manoeuvre(attitude)
        if self._is_in_force:
            flight.manoeuvre = manoeuvre
            flight.flying = flight.flying or self._lifts_off(attitude)
        else:
            self._first = manoeuvre.update(view)
        return None

    def set_acceleration(self, a: Point, heading: HeadingSetpoint) -> str | None:
        """Take an acceleration, world NWU [m/s2]; it is flown as an attitude."""
        flight = self._flight
        if flight.chooser is None:
            return "acceleration set-points need an airframe"
        wanted = flight.reference.heading if heading.heading is None else heading.heading
        if heading.turn_rate:
            wanted = flight.view.heading
        return self.set_attitude(attitude_for(a, wanted, heading.turn_rate, flight.chooser.airframe))

    def set_offset(self, offset: Point, heading: HeadingSetpoint, *, body: bool) -> str | None:
        """Take an offset from the vehicle [m], world NWU, or with ``body`` forward, to the left and up."""
        if not all(map(math.isfinite, offset)):
            return f"position {offset} is not a number"
        return self.set_position(self._place_of(offset, body=body), heading)

    def set_velocity(self, v: Point, heading: HeadingSetpoint = KEEP_HEADING) -> str | None:
        """Take a velocity, world NWU [m/s]; in forward flight the heading is that of the velocity."""
        flight = self._flight
        reason = self._refuse_velocity(v) or _refuse_turn_rate(heading)
        if reason is not None:
            return reason
        self._received, self._lifted_from = flight.view.time, None
        reference = self._velocity_reference(v, heading)
        if flight.world.arena.has_net and (outside := flight.refuse_point(reference.position)):
            return outside
        if self._is_in_force:
            flight.manoeuvre = Hold(reference)
        else:
            self._first = reference
        return None

    def set_position(self, p: Point, heading: HeadingSetpoint = KEEP_HEADING) -> str | None:
        """Take a position, world NWU [m]."""
        flight = self._flight
        reason = flight.refuse_point(p)
        if reason is not None:
            return reason
        self._received, self._lifted_from = flight.view.time, None
        target = flight.hover_reference(p)
        if heading.heading is not None:
            target = target._replace(heading=heading.heading)
        if not self._is_in_force:
            self._first, self._turns = target, heading.heading is not None
        else:
            return self._lead_to(target, turns=heading.heading is not None)
        return None

    def _lead_to(self, target: Reference, *, turns: bool) -> str | None:
        """Move the end of the way under way, or begin another way; why there is none, or None.

        Args:
            target: The hover at the end.
            turns: Whether its heading was asked for.
        """
        flight, far = self._flight, SAME_END if self._flight.world.arena.obstacles else SAME_LEG
        if flight.manoeuvre is not None and _is_same_leg(flight.manoeuvre, target, far):
            flight.manoeuvre = moved_end(flight.manoeuvre, target, turns=turns)
            return None
        leg = flight.leg_to(target, turns=turns)
        if isinstance(leg, Refusal):
            return leg.text
        flight.manoeuvre = leg
        return None

    def from_body(self, v: Point) -> Point:
        """A vector forward, to the left and up of the vehicle, in world NWU; only its heading counts."""
        return from_heading_axes(v, self._flight.view.heading)

    def _watch_lift_off(self) -> None:
        view = self._flight.view
        if view.landed:
            self._lifted_from = view.p
        elif self._lifted_from is not None and view.p[2] - self._lifted_from[2] >= LIFT_HEIGHT:
            self._lifted_from = None

    def _attitude_manoeuvre(self, attitude: AttitudeReference) -> Manoeuvre:
        """The attitude itself, or the climb from the ground to where it is flown."""
        view, speed = self._flight.view, self._flight.settings.hover_speed
        if self._lifted_from is None:
            return FlyAttitude(attitude, view.time, speed)
        north, west, ground = self._lifted_from
        return Hold(hover_at((north, west, ground + LIFT_HEIGHT + LIFT_MARGIN), self._flight.reference.heading, speed))

    def _lifts_off(self, attitude: AttitudeReference) -> bool:
        flight = self._flight
        return flight.armed and flight.chooser is not None and lifts(attitude, flight.chooser.airframe)

    def _place_of(self, offset: Point, *, body: bool) -> Point:
        """The place that an offset leads to, world NWU [m].

        An offset that comes again, number for number, keeps its place: repeating it only keeps the stream alive.
        """
        last = self._offset
        if last is None or self.is_stale() or (last.offset, last.body) != (offset, body):
            p, away = self._flight.view.p, self.from_body(offset) if body else offset
            last = self._offset = _Offset(offset, body, (p[0] + away[0], p[1] + away[1], p[2] + away[2]))
        return last.place

    def _velocity_reference(self, v: Point, heading: HeadingSetpoint) -> Reference:
        flight = self._flight
        if _is_hovered(v, flight.settings.hover_speed):
            return self._moving.move(v, heading, flight.reference, flight.view, flight.settings.setpoint_timeout)
        return course_reference(flight.view.p, v, flight.view.wind, flight.reference)

    def _refuse_velocity(self, v: Point) -> str | None:
        """The reason why a velocity, world NWU [m/s], cannot be flown; None if it can.

        Up to the speed limit of the hover it is flown in hover, from 7 m/s on in forward flight. In between the
        vehicle can hold no speed for long.
        """
        hover_speed = self._flight.settings.hover_speed
        if _is_hovered(v, hover_speed):
            return None
        level = math.hypot(v[0], v[1])
        if not MIN_AIRSPEED <= level <= MAX_AIRSPEED:
            allowed = f"hover to {hover_speed:g}, forward flight from {MIN_AIRSPEED:g} m/s"
            return f"{level:.1f} m/s level, {v[2]:.1f} m/s up: {allowed}"
        if not -MAX_DESCENT_SLOPE * level <= v[2] <= MAX_CLIMB_SLOPE * level:
            return f"{v[2]:.3g} m/s up at {level:.1f} m/s level is too steep for forward flight"
        if not self._flight.can_fly_forward:
            return f"{level:.1f} m/s: this airframe cannot leave the hover"
        return None


def _refuse_turn_rate(heading: HeadingSetpoint) -> str | None:
    """The reason why a heading rate cannot be flown; None if it can."""
    if abs(heading.turn_rate) <= MAX_HOVER_TURN_RATE + TURN_RATE_TOLERANCE:
        return None
    turn, limit = math.degrees(abs(heading.turn_rate)), math.degrees(MAX_HOVER_TURN_RATE)
    return f"{turn:.0f} deg/s: the hover turns with up to {limit:.0f} deg/s"


def _is_hovered(v: Point, hover_speed: float) -> bool:
    return math.hypot(v[0], v[1]) <= hover_speed and -MAX_HOVER_DESCENT <= v[2] <= MAX_HOVER_CLIMB


def _is_same_leg(manoeuvre: Manoeuvre, target: Reference, far: float) -> bool:
    """Whether the manoeuvre under way already leads not ``far`` from a reference [m]; then its end moves there."""
    if isinstance(manoeuvre, ManoeuvreSequence):
        return _is_same_leg(manoeuvre.steps[-1], target, far)
    return isinstance(manoeuvre, FlyTo | FlyLeg) and math.dist(manoeuvre.reference.position, target.position) <= far
