"""Guided flight: take-off, hold, go-to, circle, return, landing and speed, as requests."""

from __future__ import annotations

from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.names import DEFAULT_SPEED, Mode
from protocol.plans.plan import Refusal
from protocol.ranges import MIN_FORWARD_HEIGHT
from sitl.autopilot.answers import ACCEPTED, DENIED, REJECTED, Answer
from sitl.autopilot.arming import Arming
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.mission.speeds import CLIMB, GROUND_SPEED, MAX_VERTICAL_SPEEDS
from sitl.control.reference import Point, hover_at
from sitl.guidance.circles import FlyCircle, circle_about, circle_at
from sitl.guidance.leg_speeds import airspeed_over_ground
from sitl.guidance.legs import FlyLeg
from sitl.guidance.limits import MAX_AIRSPEED, MIN_AIRSPEED, MIN_HOLD_HEIGHT
from sitl.guidance.manoeuvres import FlyTo, Hold, PassBy, Ramp, current_step
from sitl.guidance.speed_changes import change_airspeed, change_hover_speed, change_vertical_speeds
from sitl.guidance.yaw_turns import YawTurn

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
        reason = flight.world.refuse(point) or flight.refuse_climb(point)
        if reason is None and target < here[2] + MIN_CLIMB:
            reason = f"{target:.1f} m is not above the ground"
        if reason is not None:
            return flight.refuse(DENIED, f"Take-off denied: {reason}")
        if not flight.armed:
            return self._arming.wait_for_arming(Mode.TAKEOFF, lambda: self.take_off(height))
        flight.enter(Mode.TAKEOFF, Ramp(flight.hover_reference(point), flight.settings.climb_rate))
        flight.flying = True
        return Answer(ACCEPTED)

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
