"""The plan's frame, east, north and up of its origin, in the world frame."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.flight_plans.plan_geometry import EnuPoint
from sitl.control.reference import Point

__all__ = ["PlanFrame"]


@dataclass(frozen=True, slots=True)
class PlanFrame:
    """Frame of the plan: its origin in the world frame NWU."""

    east: float = 0.0
    north: float = 0.0

    def to_world(self, p: EnuPoint) -> Point:
        """World NWU [m]."""
        return (p.y + self.north, -(p.x + self.east), p.z)

    def to_plan(self, p: Point) -> EnuPoint:
        """East, north and up of the plan's origin [m]."""
        return EnuPoint(-p[1] - self.east, p[0] - self.north, p[2])

    @staticmethod
    def turned(v: Point) -> EnuPoint:
        """A velocity east, north and up [m/s]."""
        return EnuPoint(-v[1], v[0], v[2])
