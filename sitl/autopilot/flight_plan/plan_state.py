"""A plan in flight, as its variables and functions see it, with their arguments as numbers and waypoints."""

from __future__ import annotations

from typing import Protocol

from protocol.flight_plans.expressions.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.name_mapping import NameMapping
from protocol.flight_plans.plan_geometry import EnuPoint, inside_polygon
from protocol.flight_plans.plan_names import plan_constants
from sitl.autopilot.flight_plan.aims import away
from sitl.autopilot.flight_plan.plan_inputs import PlanInputs
from sitl.autopilot.flight_plan.plan_memory import PlanMemory
from sitl.autopilot.flight_plan.waypoint_table import WaypointTable

__all__ = ["PlanPosition", "PlanState", "left_area", "named_point", "number", "waypoint_name"]


class PlanPosition(Protocol):
    """Progress of a plan: block and step in force, and their times."""

    @property
    def block(self) -> int:
        """Number of the block in force."""

    @property
    def stage(self) -> int:
        """Number of the step in force."""

    @property
    def block_time(self) -> float:
        """In the block [s]."""

    @property
    def stage_time(self) -> float:
        """In the stage [s]."""


class PlanState:
    """One plan in flight, and its vehicle.

    Attributes:
        plan: The plan.
        mapping: What names of its build mean.
        constants: Its names with a value that stays.
        inputs: The vehicle at this tick.
        memory: What the plan has set.
        waypoints: Where they are.
        position: Where the plan is.
        p: Where the vehicle is, of the plan's origin.
        v: Its velocity, east, north and up [m/s].
        loops: The counters of loops.
    """

    def __init__(
        self,
        plan: FlightPlan,
        mapping: NameMapping,
        memory: PlanMemory,
        waypoints: WaypointTable,
        position: PlanPosition,
        inputs: PlanInputs,
    ) -> None:
        self.plan, self.mapping, self.constants = plan, mapping, plan_constants(plan)
        self.memory, self.waypoints, self.position, self.inputs = memory, waypoints, position, inputs
        self.loops: dict[str, Scalar] = {}
        self.p = self.v = EnuPoint(0.0, 0.0, 0.0)

    @property
    def height(self) -> float:
        """Of the vehicle above the ground reference [m]."""
        return self.p.z - self.memory.ground_height

    @property
    def altitude(self) -> float:
        """Of the vehicle above the sea, as the plan counts it [m]."""
        return self.plan.ground_alt + self.p.z + self.memory.altitude_shift


def left_area(state: PlanState) -> str:
    """Beyond which of the plan's limits the vehicle is; empty: within all."""
    plan, p = state.plan, state.p
    if away(p, state.waypoints.home) > plan.max_dist_from_home:
        return f"farther than {plan.max_dist_from_home:g} m from HOME"
    if plan.geofence_max_height is not None and state.height > plan.geofence_max_height:
        return f"higher than {plan.geofence_max_height:g} m"
    if plan.geofence_max_alt is not None and state.altitude > plan.geofence_max_alt:
        return f"above {plan.geofence_max_alt:g} m"
    sector = plan.geofence_sector
    if sector is not None and not inside_polygon(state.waypoints.corners(sector.name), p.x, p.y):
        return f"outside {sector.name}"
    return ""


def number(argument: Argument) -> Scalar:
    """An argument that is a number; raises UnknownNameError, as the others do."""
    if isinstance(argument, str):
        raise UnknownNameError(f"{argument!r} is not a number")
    return argument


def waypoint_name(state: PlanState, argument: Argument) -> str:
    """The name of a waypoint that is given by its number."""
    name = state.waypoints.name_of(number(argument))
    if name is None:
        raise UnknownNameError(f"there is no waypoint {argument}")
    return name


def named_point(state: PlanState, argument: Argument) -> EnuPoint:
    """Position of a waypoint that is given by its number."""
    return state.waypoints.at(waypoint_name(state, argument))
