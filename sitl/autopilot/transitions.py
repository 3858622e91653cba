"""Front and back transitions by command: how far one is, how it ends, and what follows.

MAV_CMD_DO_VTOL_TRANSITION takes seconds, so it is answered as a long-running command
(https://mavlink.io/en/services/command.html#long_running_commands). Take-offs, landings, returns and go-tos are
accepted at once, because stock clients take any later answer for a lost one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Regime
from protocol.names import Mode
from protocol.ranges import MIN_FORWARD_HEIGHT
from sitl.autopilot.answers import ACCEPTED, CANCELLED, DENIED, FAILED, IN_PROGRESS, REJECTED, Answer
from sitl.autopilot.flight_state import FlightState
from sitl.control.reference import Reference
from sitl.guidance.circles import circle_ahead
from sitl.guidance.view import VehicleView

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
