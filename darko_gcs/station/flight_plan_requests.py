"""The operator's requests about the vehicle's flight plan."""

from __future__ import annotations

import math

from darko_gcs.station.family_requests import RequestContext
from protocol import units
from protocol.dialect import mavlink
from protocol.engines.flight_plan_table import plan_key
from protocol.frames import Vector
from protocol.names import Mode

_NAN = math.nan


class FlightPlanRequests:
    """Requests about blocks, waypoints and variables; the message log shows the result of each.

    A request names the plan that the operator sees, so that it cannot reach another one by its numbers.

    Args:
        context: The station.
    """

    def __init__(self, context: RequestContext) -> None:
        self._context = context

    def start(self, now: float) -> None:
        """Fly the flight plan, from where it is."""
        self._context.set_mode(Mode.FLIGHT_PLAN, now)

    def jump_to_block(self, number: int, now: float) -> None:
        """Enter a block."""
        command = mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK
        self._context.attempt(
            now, lambda: self._context.endpoint.command(command, float(number), self._plan_key, now=now)
        )

    def set_variable(self, number: int, value: float, now: float) -> None:
        """Set a variable."""
        command = mavlink.MAV_CMD_DARKO_SET_VARIABLE
        self._context.attempt(
            now, lambda: self._context.endpoint.command(command, float(number), self._plan_key, value, now=now)
        )

    def move_waypoint(self, number: int, place: Vector, now: float) -> None:
        """Put a waypoint to a place: east, north and up of the plan's origin [m]."""
        frame, command = mavlink.MAV_FRAME_LOCAL_ENU, mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT
        params = (float(number), self._plan_key, _NAN, _NAN)

        def request() -> None:
            x, y = units.local_e4(place[0]), units.local_e4(place[1])
            self._context.endpoint.command_int(command, frame, *params, x, y, place[2], now=now)

        self._context.attempt(now, request)

    def load(self, data: bytes, now: float) -> None:
        """Have the vehicle load a plan from the content of its file, which includes nothing."""
        self._context.attempt(now, lambda: self._context.endpoint.send_flight_plan(data, now))

    def fetch(self) -> None:
        """Download the flight plan anew."""
        self._context.endpoint.request_flight_plan()

    @property
    def _plan_key(self) -> float:
        plan = self._context.snapshot.flight_plan
        return _NAN if plan is None else plan_key(plan.plan_id)
