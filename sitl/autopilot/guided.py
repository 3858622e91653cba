"""Guided flight and transitions, as requests."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Regime
from protocol.names import DEFAULT_SPEED, Mode
from protocol.plans.plan import Refusal
from protocol.ranges import MAX_AIRSPEED, MIN_AIRSPEED, MIN_FORWARD_HEIGHT
from sitl.autopilot.answers import ACCEPTED, CANCELLED, DENIED, FAILED, IN_PROGRESS, REJECTED, Answer
from sitl.autopilot.arming import Arming
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.mission.speeds import CLIMB, GROUND_SPEED, MAX_VERTICAL_SPEEDS
from sitl.control.reference import Point, Reference, hover_at
from sitl.guidance.circles import FlyCircle, circle_about, circle_ahead, circle_at
from sitl.guidance.headings import YawTurn
from sitl.guidance.leg_speeds import airspeed_over_ground
from sitl.guidance.legs import FlyLeg
from sitl.guidance.manoeuvre_changes import change_airspeed, change_hover_speed, change_vertical_speeds
from sitl.guidance.manoeuvres import FlyTo, Hold, PassBy, Ramp, current_step
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView

# Guided flight: take-off, hold, go-to, circle, return, landing and speed, as requests.

# Front and back transitions by command: how far one is, how it ends, and what follows.
#
# MAV_CMD_DO_VTOL_TRANSITION takes seconds, so it is answered as a long-running command
# (https://mavlink.io/en/services/command.html#long_running_commands). Take-offs, landings, returns and go-tos are
# accepted at once, because stock clients take any later answer for a lost one.


NAMES = {LegMode.HOVER: "Back transition", LegMode.FORWARD: "Front transition"}
CRUISE_TILT = math.radians(70.0)  # of a vehicle in forward flight, or a little more
LIFT_SPEED = 9.0  # about the airspeed at which the wing carries the vehicle [m/s]
HEIGHT_ERROR = 0.3  # of a hover at the least height: it is never quite still [m]
TIME_LIMIT = 60.0  # a strong wind can keep a vehicle from its transition for ever [s]


def is_reached(wanted: LegMode, view: VehicleView, reference: Reference) -> bool:
    """Whether a flying vehicle hovers or flies forward as wanted, and is not about to change that."""
    if wanted is LegMode.FORWARD:
        return view.regime is Regime.FORWARD
    return not view.forward and not reference.forward and view.law is not Law.FAILSAFE


@dataclass(slots=True)
class Transition:
    """One transition from the request to its ``end``. Once ended, it stays as it is."""

    wanted: LegMode  # HOVER or FORWARD
    begun: VehicleView  # the vehicle at the request
    before: LegMode = LegMode.NONE  # what was requested of the mission until then
    percent: int = 0  # never falls, and is 100 only at the end
    end: Answer | None = None

    def update(self, view: VehicleView, reference: Reference) -> None:
        """Take the vehicle as it is now, and the reference of this tick."""
        if self.end is not None:
            return
        self.percent = max(self.percent, min(99, round(100.0 * self._share(view))))
        if view.law is Law.FAILSAFE:
            self.fail("a fall was caught")
        elif is_reached(self.wanted, view, reference):
            self._finish(ACCEPTED)
        elif self.wanted is LegMode.FORWARD and not reference.forward:  # a mission decides leg by leg
            self._finish(ACCEPTED, "This item is hovered; later ones fly forward where possible")
        elif view.time - self.begun.time > TIME_LIMIT:
            self.fail(f"not done in {TIME_LIMIT:g} s")

    def fail(self, reason: str) -> None:
        """End it as failed, unless it has ended."""
        self._finish(FAILED, f"{NAMES[self.wanted]} failed: {reason}")

    def give_way(self, mode: Mode) -> None:
        """End it because another mode was asked for, unless it has ended."""
        self._finish(FAILED, f"{NAMES[self.wanted]} left for {mode.name}, as asked")

    def cancel(self) -> None:
        """End it as cancelled, unless it has ended."""
        self._finish(CANCELLED, f"{NAMES[self.wanted]} cancelled")

    def _finish(self, result: int, text: str = "") -> None:
        if self.end is None:
            self.end = Answer(result, text)

    def _share(self, view: VehicleView) -> float:
        """Progress of the transition, in tilt and in airspeed, 0..1."""
        tilted, fast = min(view.tilt / CRUISE_TILT, 1.0), min(_airspeed(view) / LIFT_SPEED, 1.0)
        if self.wanted is LegMode.FORWARD:
            return 0.5 * (tilted + fast)
        fastest = max(_airspeed(self.begun), LIFT_SPEED)
        return 1.0 - 0.5 * (tilted + min(_airspeed(view) / fastest, 1.0))


def _airspeed(view: VehicleView) -> float:
    return math.dist(view.v, view.wind)


class TransitionRequests:
    """Begins and cancels transitions of a flight.

    Attributes:
        under_way: The transition that was requested and has not ended, or None.
    """

    def __init__(self, flight: FlightState) -> None:
        self._flight = flight
        self.under_way: Transition | None = None
        flight.before_change(self._supersede)

    def begin(self, wanted: LegMode) -> Answer:
        """Begin a transition to forward flight or to hover now; the rest of a mission is flown so as well.

        Outside a mission forward flight needs somewhere to go: it circles a point ahead. A transition that is answered
        with IN_PROGRESS is ``under_way`` until it has an end; any other order ends it.
        """
        flight = self._flight
        if refusal := self._refuse(wanted):
            return refusal
        done, before = is_reached(wanted, flight.view, flight.reference), LegMode.NONE
        if flight.mode is Mode.MISSION and flight.mission is not None:
            before = flight.mission.request(wanted)
        elif wanted is LegMode.FORWARD and not done:
            here = flight.hover_reference(flight.view.p)
            circle = circle_ahead(flight.view, flight.settings.loiter_radius, here, flight.settings.airspeed)
            reason = flight.refuse_circle(circle.reference.position, flight.settings.loiter_radius)
            if reason is not None:
                return flight.refuse(REJECTED, f"Transition refused: no room to circle, {reason}")
            flight.enter(Mode.HOLD, circle)
        elif wanted is LegMode.HOVER and not done:
            flight.hold_here()
        if done:
            return Answer(ACCEPTED)
        self.under_way = Transition(wanted, flight.view, before)
        return Answer(IN_PROGRESS)

    def cancel(self) -> None:
        """Stop the transition under way: hold upright, or fly the mission as before the request.

        Both kinds end upright: a vehicle that brakes is not sent back to forward flight from a speed at which neither
        hover nor wing carries it.
        """
        transition = self.under_way
        if transition is not None:
            transition.cancel()
            self._end(transition)
            self._revert(transition)

    def update(self) -> None:
        """One tick: see how far the transition under way is."""
        transition = self.under_way
        if transition is None:
            return
        transition.update(self._flight.view, self._flight.reference)
        if transition.end is not None:
            self._end(transition)
            if transition.end.result == FAILED:
                self._revert(transition)

    def _refuse(self, wanted: LegMode) -> Answer | None:
        flight = self._flight
        if not flight.flying:
            return flight.refuse(REJECTED, "Transition refused: not in the air")
        if wanted is LegMode.FORWARD and not flight.can_fly_forward:
            return flight.refuse(DENIED, "Transition denied: not possible with this airframe")
        height = flight.view.p[2]
        if wanted is LegMode.FORWARD and height < MIN_FORWARD_HEIGHT - HEIGHT_ERROR:
            reason = f"too low at {height:.1f} m, it needs {MIN_FORWARD_HEIGHT:g} m"
            return flight.refuse(REJECTED, f"Transition refused: {reason}")
        return None

    def _supersede(self, mode: Mode) -> None:
        """Another order ends the transition under way."""
        flight, transition = self._flight, self.under_way
        if transition is None:
            return
        transition.give_way(mode) if flight.flying else transition.fail("the flight is over")
        self._end(transition)
        if flight.mode is Mode.MISSION and flight.mission is not None:
            flight.mission.request(transition.before)

    def _end(self, transition: Transition) -> None:
        self.under_way = None
        if transition.end is not None and transition.end.text:
            failed = transition.end.result == FAILED
            severity = mavlink.MAV_SEVERITY_WARNING if failed else mavlink.MAV_SEVERITY_INFO
            self._flight.say(severity, transition.end.text)

    def _revert(self, transition: Transition) -> None:
        if self._flight.mode is Mode.MISSION and self._flight.mission is not None:
            self._flight.mission.request(transition.before)
        else:
            self._flight.hold_here()


MIN_CLIMB = 0.5  # of a take-off [m]


class GuidedRequests:
    """Requests that begin a manoeuvre at once; a refusal changes nothing."""

    def __init__(self, flight: FlightState, arming: Arming) -> None:
        self._flight, self._arming = flight, arming

    def take_off(self, height: float | None = None) -> Answer:
        """Climb straight up to a height above home [m]; None takes that of the settings."""
        flight, here = self._flight, self._flight.view.p
        wanted = flight.settings.takeoff_altitude if height is None else height
        target = flight.world.up(wanted, above_sea=False)
        if not flight.view.landed:
            return flight.refuse(REJECTED, "Take-off refused: already in the air")
        point = (here[0], here[1], target)
        reason = self._refuse_take_off(point)
        if reason is not None:
            return flight.refuse(DENIED, f"Take-off denied: {reason}")
        if not flight.armed:
            return self._arming.wait_for_arming(
                Mode.TAKEOFF, lambda: self.take_off(height), lambda: self._refuse_take_off(point)
            )
        flight.enter(Mode.TAKEOFF, Ramp(flight.hover_reference(point), flight.settings.climb_rate))
        flight.flying = True
        return Answer(ACCEPTED)

    def _refuse_take_off(self, point: Point) -> str | None:
        """The reason why the vehicle may not climb to a point above it, world NWU [m]; None if it may."""
        reason = self._flight.world.refuse(point) or self._flight.refuse_climb(point)
        if reason is None and point[2] < self._flight.view.p[2] + MIN_CLIMB:
            return f"{point[2]:.1f} m is not above the ground"
        return reason

    def hold(self) -> Answer:
        """Stop and stay; on the ground, just change the mode."""
        self._flight.hold_here()
        return Answer(ACCEPTED)

    def land(self) -> Answer:
        """Descend on the spot until the ground is reached."""
        if not self._flight.flying:
            return self._flight.refuse(REJECTED, "Landing refused: not in the air")
        self._flight.land_here()
        return Answer(ACCEPTED)

    def return_to_launch(self) -> Answer:
        """Climb to the return altitude, fly to home or the nearest rally point, and land."""
        flight = self._flight
        if not flight.flying:
            return flight.refuse(REJECTED, "Return refused: not in the air")
        route = flight.find_route_home(flight.view)
        if isinstance(route, Refusal):
            return flight.refuse(DENIED, f"Return denied: {route.text}")
        flight.enter(Mode.RTL, route)
        return Answer(ACCEPTED)

    def go_to(self, p: Point, heading: float | None = None, speed: float | None = None) -> Answer:
        """Fly to a point and hold there.

        Args:
            p: Position, world NWU [m].
            heading: Heading at the point [rad]; None keeps the present one.
            speed: Speed limit [m/s]; None takes the hover speed of the settings.
        """
        flight = self._flight
        if not flight.flying:
            return flight.refuse(REJECTED, "Go-to refused: not in the air")
        reason = flight.refuse_point(p)
        if reason is not None:
            return flight.refuse(DENIED, f"Go-to denied: {reason}")
        if p[2] < MIN_HOLD_HEIGHT:
            flight.say(mavlink.MAV_SEVERITY_NOTICE, f"Go-to at {p[2]:g} m is flown at {MIN_HOLD_HEIGHT:g} m")
            p = (p[0], p[1], MIN_HOLD_HEIGHT)
        reference = hover_at(
            p,
            flight.reference.heading if heading is None else heading,
            flight.settings.hover_speed if speed is None else speed,
        )
        leg = flight.leg_to(reference, turns=heading is not None)
        if isinstance(leg, Refusal):
            return flight.refuse(DENIED, f"Go-to denied: {leg.text}")
        flight.enter(Mode.HOLD, leg)
        return Answer(ACCEPTED)

    def change_height(self, up: float, heading: float | None = None, speed: float | None = None) -> Answer:
        """Go to another height where the vehicle is to be; in a circle, fly on round it there.

        Args:
            up: World NWU height [m].
            heading: [rad]; given, it is hovered to; None keeps the present one.
            speed: Speed limit of the hover [m/s]; None takes that of the settings.
        """
        flight = self._flight
        circle = flight.circle
        if circle is None or heading is not None:
            north, west, _ = flight.reference.position
            return self.go_to((north, west, up), heading, speed)
        if speed is not None:
            return flight.refuse(REJECTED, f"Hover speed {speed:g} m/s refused: in forward flight")
        if not up >= MIN_FORWARD_HEIGHT:
            return flight.refuse(
                DENIED, f"Height denied: {up:.1f} m is too low to circle (below {MIN_FORWARD_HEIGHT:g} m)"
            )
        path = circle.reference.path
        reason = flight.refuse_circle((path.start.x, path.start.y, up), abs(path.radius))
        if reason is not None:
            return flight.refuse(DENIED, f"Height denied: {reason}")
        flight.enter(Mode.HOLD, circle_at(circle, up))
        return Answer(ACCEPTED)

    def circle(self, centre: Point, radius: float, airspeed: float | None = None) -> Answer:
        """Circle a point in forward flight, for ever.

        Args:
            centre: World NWU [m].
            radius: [m]; positive: clockwise seen from above.
            airspeed: [m/s]; None takes that of the settings.
        """
        flight = self._flight
        if not flight.flying:
            return flight.refuse(REJECTED, "Orbit refused: not in the air")
        if not flight.can_fly_forward:
            return flight.refuse(DENIED, "Orbit denied: not possible with this airframe")
        speed = flight.settings.airspeed if airspeed is None else airspeed
        circle = circle_about(centre, radius, flight.hover_reference(flight.view.p), speed)
        if circle.reference.path.airspeed < MIN_AIRSPEED or speed > MAX_AIRSPEED:
            return flight.refuse(DENIED, f"Orbit denied: {abs(radius):g} m at {speed:g} m/s cannot be flown")
        if min(centre[2], flight.view.p[2]) < MIN_FORWARD_HEIGHT:
            return flight.refuse(REJECTED, f"Orbit refused: too low (below {MIN_FORWARD_HEIGHT:g} m)")
        reason = flight.refuse_circle(centre, abs(radius))
        if reason is not None:
            return flight.refuse(DENIED, f"Orbit denied: {reason}")
        flight.enter(Mode.HOLD, circle)
        return Answer(ACCEPTED)

    def turn(self, params: Sequence[float]) -> Answer:
        """Turn on the spot, as the first four parameters of CONDITION_YAW say; outside of missions, and hovering."""
        flight = self._flight
        if not flight.flying or flight.view.forward or flight.mode is not Mode.HOLD:
            return flight.refuse(REJECTED, "Turn refused: not holding in the hover")
        flight.turn = YawTurn.of(params, flight.view)
        return Answer(ACCEPTED)

    def change_speed(self, kind: float, speed: float) -> Answer:
        """Change a speed of the manoeuvre under way, or of the mission.

        Args:
            kind: SPEED_TYPE. Up to its limit that of the hover is one over the ground, whichever is named; from 7 m/s
                on it is one of the cruise.
            speed: [m/s]; -2 takes that of the settings, of climb and descent that of the laws.
        """
        flight = self._flight
        if flight.mode is Mode.MISSION and flight.mission is not None:
            flight.mission.change_speed(kind, speed)
            return Answer(ACCEPTED)
        if kind in MAX_VERTICAL_SPEEDS:
            return self._change_vertical_speed(kind, None if speed == DEFAULT_SPEED else speed)
        return self._change_speed(None if speed == DEFAULT_SPEED else speed, over_ground=kind == GROUND_SPEED)

    def _change_vertical_speed(self, kind: float, speed: float | None) -> Answer:
        flight, under_way = self._flight, current_step(self._flight.manoeuvre)
        if not isinstance(under_way, FlyTo):
            return flight.refuse(REJECTED, "Vertical speed refused: not hovering to a point")
        climb, descent = under_way.climb, under_way.descent
        new = (speed, descent) if kind == CLIMB else (climb, speed)
        change_vertical_speeds(flight.manoeuvre, *new)
        return Answer(ACCEPTED)

    def _change_speed(self, speed: float | None, *, over_ground: bool) -> Answer:
        flight = self._flight
        under_way = current_step(flight.manoeuvre)
        forward = isinstance(under_way, FlyCircle) or (isinstance(under_way, FlyLeg) and not under_way.upright)
        if speed is None:
            speed = flight.settings.airspeed if forward else flight.settings.hover_speed
        cruise = speed >= MIN_AIRSPEED
        if cruise and not forward:
            return flight.refuse(REJECTED, f"Speed {speed:g} m/s refused: not in forward flight")
        if forward and not cruise:
            return flight.refuse(REJECTED, f"Hover speed {speed:g} m/s refused: in forward flight")
        if not isinstance(under_way, FlyTo | Hold | FlyLeg | FlyCircle | PassBy):
            return flight.refuse(REJECTED, f"Hover speed {speed:g} m/s refused: not flying to a point")
        if not forward:
            change_hover_speed(flight.manoeuvre, speed)
            return Answer(ACCEPTED)
        airspeed = speed
        if over_ground and isinstance(under_way, FlyLeg):
            path = under_way.reference.path
            airspeed = airspeed_over_ground(path.start, path.end, speed, flight.view.wind)
        if not MIN_AIRSPEED <= airspeed <= MAX_AIRSPEED:
            text = f"{speed:g} m/s over the ground needs an airspeed of {airspeed:.1f} m/s"
            return flight.refuse(REJECTED, f"Speed refused: {text}, not {MIN_AIRSPEED:g} to {MAX_AIRSPEED:g} m/s")
        change_airspeed(flight.manoeuvre, airspeed)
        return Answer(ACCEPTED)
