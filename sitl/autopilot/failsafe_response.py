"""Response of the vehicle to alarms: it holds, returns, lands or cuts the motors; the graver action wins."""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans.plan import Refusal
from sitl.autopilot.flight_state import FlightState
from sitl.autopilot.safety.alarm import DOING, SafetyAction
from sitl.autopilot.safety.failsafe import Failsafes
from sitl.control.reference import Point, at
from sitl.guidance.manoeuvres import ComeToRest, Hold, ManoeuvreSequence

OFFBOARD_ACTIONS = {3: SafetyAction.RETURN, 4: SafetyAction.LAND, 5: SafetyAction.HOLD}  # by COM_OBL_RC_ACT


class FailsafeResponse:
    """Checks the failsafes of a flight, and does what they ask for."""

    def __init__(self, flight: FlightState, failsafes: Failsafes) -> None:
        self._flight, self._failsafes = flight, failsafes

    def check(self) -> None:
        """One tick of a flight: report the alarms that begin, and act on the gravest."""
        flight, under_way = self._flight, self._under_way()
        alarms = self._failsafes.check(
            flight.view,
            flight.mode,
            flight.world,
            flight.settings,
            flight.chooser,
            landing=under_way is SafetyAction.LAND,
            return_points=flight.return_points,
            reference=flight.reference,
        )
        if not alarms:
            return
        gravest = max(alarms, key=lambda alarm: alarm.action or SafetyAction.NONE)
        if gravest.action is SafetyAction.TERMINATE:
            flight.terminate(gravest.reason)
            return
        if gravest.always and under_way is SafetyAction.RETURN:
            under_way = SafetyAction.NONE
        for alarm in alarms:
            flight.say(alarm.severity, alarm.text(gravest.action or SafetyAction.NONE, under_way))
        if (gravest.action or SafetyAction.NONE) > under_way:
            self._act(gravest.action or SafetyAction.NONE, stop=gravest.stop, retreat=gravest.retreat, to=gravest.to)

    def lose_setpoints(self, reason: str) -> None:
        """Set-points can no longer be flown, for a reason the pilot reads: do what the settings say."""
        action = OFFBOARD_ACTIONS[self._flight.settings.setpoint_action]
        self._flight.say(mavlink.MAV_SEVERITY_WARNING, f"{reason}: {DOING[action]}")
        if action > self._under_way():
            self._act(action, stop=False)

    def _under_way(self) -> SafetyAction:
        """The action in progress, which no lesser alarm may stop; LAND already as it comes to rest before one."""
        if self._flight.landing or self._flight.mode is Mode.LAND:
            return SafetyAction.LAND
        return SafetyAction.RETURN if self._flight.mode is Mode.RTL else SafetyAction.NONE

    def _act(self, action: SafetyAction, *, stop: bool, retreat: float = 0.0, to: Point | None = None) -> None:
        """Do what an alarm asks for.

        Args:
            action: What it asks for.
            stop: Whether a vehicle in forward flight stops before it turns elsewhere.
            retreat: How much farther inside the arena's net a hold is flown [m].
            to: Where a return ends and holds, world NWU [m]; None: it lands at home.
        """
        if action is SafetyAction.HOLD:
            self._flight.hold_here(retreat)
        elif action is SafetyAction.LAND:
            self._flight.land_here()
        elif to is None or not self._hold_at(to):
            self._return(stop=stop)

    def _hold_at(self, point: Point) -> bool:
        """Stop, fly to a point no lower than a return is flown, and hold there; False if there is no way."""
        flight = self._flight
        here, last = flight.hover_reference(flight.stop_point()), flight.view
        low = flight.world.home[2] + flight.settings.return_altitude
        there = at(here, flight.world.arena.clamped((point[0], point[1], max(point[2], low))))
        stopped = last._replace(p=here.position, v=(0.0, 0.0, 0.0), forward=False)
        route = flight.leg_to(there, stopped)
        if isinstance(route, Refusal):
            return False
        flight.say(mavlink.MAV_SEVERITY_INFO, "Flying to the fence's return point")
        flight.enter(Mode.HOLD, ManoeuvreSequence((ComeToRest(here), route, Hold(there))))
        return True

    def _return(self, *, stop: bool) -> None:
        flight = self._flight
        here = flight.hover_reference(flight.stop_point())
        first = (ComeToRest(here),) if flight.view.forward and stop else ()
        view = flight.view._replace(p=here.position, v=(0.0, 0.0, 0.0), forward=False) if first else flight.view
        flight.enter(Mode.RTL, ManoeuvreSequence((*first, *flight.route_home(view).steps)))
