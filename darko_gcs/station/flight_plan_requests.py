"""What an operator asks of the vehicle's flight plan, as a part of the station."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable

from darko_gcs.state.snapshot import Snapshot
from protocol import units
from protocol.dialect import mavlink
from protocol.endpoint_ground import GroundEndpoint
from protocol.engines.flight_plan_table import plan_key
from protocol.frames import Vector
from protocol.names.modes import Mode

__all__ = ["FlightPlanRequests"]

_NAN = math.nan


class FlightPlanRequests(ABC):
    """Requests about blocks, waypoints and variables; the message log shows the result of each.

    A request names the plan that the operator sees, so that it cannot reach another one by its numbers.
    """

    snapshot: Snapshot
    endpoint: GroundEndpoint

    @abstractmethod
    def set_mode(self, mode: Mode, now: float) -> None:
        """Change the flight mode."""

    @abstractmethod
    def _try(self, now: float, request: Callable[[], object]) -> None:
        """Send a request, and log why it cannot be sent."""

    def start_flight_plan(self, now: float) -> None:
        """Fly the flight plan, from where it is."""
        self.set_mode(Mode.FLIGHT_PLAN, now)

    def jump_to_block(self, number: int, now: float) -> None:
        """Enter a block."""
        command = mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK
        self._try(now, lambda: self.endpoint.command(command, float(number), self._plan_key, now=now))

    def set_variable(self, number: int, value: float, now: float) -> None:
        """Set a variable."""
        command = mavlink.MAV_CMD_DARKO_SET_VARIABLE
        self._try(now, lambda: self.endpoint.command(command, float(number), self._plan_key, value, now=now))

    def move_waypoint(self, number: int, place: Vector, now: float) -> None:
        """Put a waypoint to a place: east, north and up of the plan's origin [m]."""
        frame, command = mavlink.MAV_FRAME_LOCAL_ENU, mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT
        params = (float(number), self._plan_key, _NAN, _NAN)

        def request() -> None:
            x, y = units.local_e4(place[0]), units.local_e4(place[1])
            self.endpoint.command_int(command, frame, *params, x, y, place[2], now=now)

        self._try(now, request)

    def load_flight_plan(self, data: bytes, now: float) -> None:
        """Have the vehicle load a plan from the content of its file, which includes nothing."""
        self._try(now, lambda: self.endpoint.send_flight_plan(data, now))

    def fetch_flight_plan(self, _now: float) -> None:
        """Download the flight plan anew."""
        self.endpoint.request_flight_plan()

    @property
    def _plan_key(self) -> float:
        return _NAN if self.snapshot.flight_plan is None else plan_key(self.snapshot.flight_plan.plan_id)
