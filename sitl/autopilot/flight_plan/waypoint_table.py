"""The waypoints of a plan as they are now: moved by the plan, or by its operator."""

from __future__ import annotations

import math

from protocol.flight_plans.flight_plan import HOME_WAYPOINT, EnuPoint, FlightPlan, waypoint_position

__all__ = ["WaypointTable"]


class WaypointTable:
    """Positions by name and number; number 0 is none of them, as in the autopilots that plans are written for."""

    def __init__(self, plan: FlightPlan) -> None:
        self._plan = plan
        self.names = tuple(point.name for point in plan.waypoints)
        self._positions = {point.name: waypoint_position(plan, point) for point in plan.waypoints}

    def number(self, name: str) -> int:
        """The number of a waypoint."""
        return self.names.index(name) + 1

    def name_of(self, number: float) -> str | None:
        """The name of a numbered waypoint; None: there is none."""
        index = round(number) - 1 if math.isfinite(number) else -1
        return self.names[index] if 0 <= index < len(self.names) else None

    def known(self, name: str) -> str | None:
        """The name a waypoint has here; that of a procedure may be ``PROCEDURE.name``."""
        point = self._plan.waypoint(name)
        return None if point is None else point.name

    def at(self, name: str) -> EnuPoint:
        """Position of a waypoint."""
        return self._positions[name]

    @property
    def home(self) -> EnuPoint:
        """Position of HOME."""
        return self._positions[HOME_WAYPOINT]

    def move(self, name: str, to: EnuPoint) -> None:
        """Put a waypoint elsewhere."""
        self._positions[name] = to

    def corners(self, sector: str) -> list[tuple[float, float]]:
        """The outline of a sector as its corners are now, east and north [m]."""
        found = self._plan.sector(sector)
        corners = () if found is None else found.corners
        names = [self.known(corner.name) for corner in corners]
        return [self._positions[name][:2] for name in names if name is not None]
