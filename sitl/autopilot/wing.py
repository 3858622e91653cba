"""Requests about forward flight: transitions, circles, speeds."""

from __future__ import annotations

import math

from protocol.dialect.vocabulary import Way
from protocol.modes import Mode
from sitl.autopilot.flight import Flight
from sitl.autopilot.guidance import MAX_AIRSPEED, MIN_AIRSPEED, FlyTo, Hold, with_speed
from sitl.autopilot.legs import FlyLeg, Orbit, orbit
from sitl.autopilot.outcome import ACCEPTED, DENIED, FAILED, IN_PROGRESS, REJECTED, Outcome
from sitl.autopilot.progress import Transition, is_reached
from sitl.control.reference import Point
from sitl.prediction.mode_choice import MIN_HEIGHT


class WingRequests(Flight):
    """Transitions there and back, circles, and speeds."""

    def transition(self, way: Way) -> Outcome:
        """Begin a transition to forward flight or to the hover now; the rest of a mission is flown that way as well.

        Outside a mission forward flight needs somewhere to go: it circles a point ahead. What is answered with
        IN_PROGRESS is ``under_way`` until it has an end; whatever else is ordered meanwhile ends it.
        """
        if not self.flying:
            return self._refuse(REJECTED, "Transition refused: not in the air")
        if way is Way.FORWARD and (self.chooser is None or not self.chooser.can_fly_forward):
            return self._refuse(DENIED, "Transition denied: this airframe has no trim between hover and wing")
        if way is Way.FORWARD and self.view.p[2] < MIN_HEIGHT:
            return self._refuse(REJECTED, f"Transition refused: {self.view.p[2]:.1f} m is too low to tip over")
        done, before = is_reached(way, self.view, self.reference), Way.NONE
        if self.mode is Mode.MISSION and self.mission is not None:
            before = self.mission.transition(way)
        elif way is Way.FORWARD and not done:
            circle = self._circle_ahead()
            reason = self._refuse_rim(circle.reference.position, self.settings.loiter_radius)
            if reason is not None:
                return self._refuse(REJECTED, f"Transition refused: no room to circle, {reason}")
            self._enter(Mode.HOLD, circle)
        elif way is Way.HOVER and not done:
            self._hold_here()
        if done:
            return Outcome(ACCEPTED)
        self.under_way = Transition(way, self.view, before)
        return Outcome(IN_PROGRESS)

    def cancel_transition(self) -> None:
        """Stop a transition that was asked for by command: hold upright, or fly the mission as it was flown before.

        Upright is where both kinds end: a vehicle that brakes is not sent back to forward flight from a speed at which
        neither carries it.
        """
        transition = self.under_way
        if transition is not None:
            transition.cancel()
            self._end(transition)
            self._take_back(transition)

    def _look_at(self, transition: Transition) -> None:
        transition.look(self.view, self.reference)
        if transition.end is not None:
            self._end(transition)
            if transition.end.result == FAILED:
                self._take_back(transition)

    def _take_back(self, transition: Transition) -> None:
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.transition(transition.before)
        else:
            self._hold_here()

    def _circle_ahead(self) -> Orbit:
        """A circle that is joined at its nearest point, flying straight ahead."""
        radius, h, p = self.settings.loiter_radius, self.view.heading, self.view.p
        ahead, right = 1.5 * radius, radius
        centre = (
            p[0] + ahead * math.cos(h) + right * math.sin(h),
            p[1] + ahead * math.sin(h) - right * math.cos(h),
            p[2],
        )
        return orbit(centre, radius, self._at(p), self.settings.airspeed)

    def circle(self, centre: Point, radius: float, airspeed: float | None = None) -> Outcome:
        """Circle a point in forward flight, for ever.

        Args:
            centre: World NWU [m].
            radius: [m]; positive: clockwise seen from above.
            airspeed: [m/s]; None takes the set one.
        """
        if not self.flying:
            return self._refuse(REJECTED, "Orbit refused: not in the air")
        if self.chooser is None or not self.chooser.can_fly_forward:
            return self._refuse(DENIED, "Orbit denied: this airframe has no trim between hover and wing")
        speed = self.settings.airspeed if airspeed is None else airspeed
        flown = orbit(centre, radius, self._at(self.view.p), speed)
        if flown.reference.path.airspeed < MIN_AIRSPEED or speed > MAX_AIRSPEED:
            return self._refuse(DENIED, f"Orbit denied: {abs(radius):g} m at {speed:g} m/s cannot be flown")
        if min(centre[2], self.view.p[2]) < MIN_HEIGHT:
            return self._refuse(REJECTED, f"Orbit refused: below {MIN_HEIGHT:g} m it is too low to tip over")
        reason = self._refuse_rim(centre, abs(radius))
        if reason is not None:
            return self._refuse(DENIED, f"Orbit denied: {reason}")
        self._enter(Mode.HOLD, flown)
        return Outcome(ACCEPTED)

    def change_speed(self, speed: float | None) -> Outcome:
        """Speed of the manoeuvre under way, or of the mission: of the hover, or from 7 m/s on of the cruise.

        Args:
            speed: [m/s]; None takes the set one.
        """
        if self.mode is Mode.MISSION and self.mission is not None:
            self.mission.change_speed(-1.0 if speed is None else speed)
            return Outcome(ACCEPTED)
        if speed is None:
            on_wing = isinstance(self._guidance, FlyLeg | Orbit)
            speed = self.settings.airspeed if on_wing else self.settings.hover_speed
        if speed >= MIN_AIRSPEED:
            return self._change_airspeed(speed)
        if isinstance(self._guidance, FlyTo | Hold):
            self._guidance = with_speed(self._guidance, speed)
        else:
            doing = "on the wing" if isinstance(self._guidance, FlyLeg | Orbit) else "not flying to a point"
            return self._refuse(REJECTED, f"Speed unchanged: {speed:g} m/s is of the hover, and it is {doing}")
        return Outcome(ACCEPTED)

    def _change_airspeed(self, speed: float) -> Outcome:
        if not isinstance(self._guidance, FlyLeg | Orbit):
            return self._refuse(REJECTED, f"Speed {speed:g} m/s refused: not on the wing")
        reference = self._guidance.reference
        if reference.forward:
            self._guidance.reference = reference._replace(path=reference.path._replace(airspeed=float(speed)))
        return Outcome(ACCEPTED)
