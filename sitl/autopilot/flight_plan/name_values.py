"""The table of names that a plan's expressions are evaluated against."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from protocol.flight_plans.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.plan_limits import MAX_COORDINATE
from protocol.flight_plans.plan_names import WAYPOINT_FIELDS, WAYPOINTS
from sitl.autopilot.flight_plan.plan_functions import FUNCTION_VALUES
from sitl.autopilot.flight_plan.plan_state import PlanState, waypoint_name
from sitl.autopilot.flight_plan.variable_values import read_variable, store_variable

__all__ = ["NameValues"]


class NameValues(PlanState):
    """Names of one plan in flight."""

    def value(self, name: str) -> Scalar:
        """The value of a variable or constant; raises UnknownNameError."""
        return read_variable(self, name)

    def store(self, name: str, value: Scalar) -> None:
        """Set a variable of the plan, or one of the autopilot; raises UnknownNameError."""
        store_variable(self, name, value)

    def item(self, name: str, index: Scalar, member: str) -> Scalar:
        """A coordinate of a waypoint, as an item of the array of all of them; raises UnknownNameError."""
        coordinate = WAYPOINT_FIELDS.get(member) if name == WAYPOINTS else None
        point = self.waypoints.at(waypoint_name(self, index))
        if coordinate is None:
            raise UnknownNameError(f"{name}[].{member}: no such array")
        return {"x": point.x, "y": point.y, "z": point.z, "alt": point.z + self.plan.ground_alt}[coordinate]

    def move(self, index: Scalar, coordinate: str, value: Scalar) -> None:
        """Set one coordinate of a waypoint [m]; raises UnknownNameError.

        Args:
            index: Number of the waypoint.
            coordinate: ``x``, ``y``, ``z`` above the plan's ground, or ``alt`` above the sea.
            value: [m].
        """
        name = waypoint_name(self, index)
        if not math.isfinite(value) or abs(value) > MAX_COORDINATE:
            raise UnknownNameError(f"waypoint {name} stays: {value:g} is no coordinate")
        if coordinate == "alt":
            coordinate, value = "z", value - self.plan.ground_alt
        self.waypoints.move(name, self.waypoints.at(name)._replace(**{coordinate: float(value)}))

    def loop_value(self, name: str) -> Scalar:
        """The counter of a loop."""
        if name not in self.loops:
            raise UnknownNameError(f"${name}: no enclosing loop has this counter")
        return self.loops[name]

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:
        """Value of a function call in the plan."""
        meaning = self.mapping.functions.get(name, name)
        if not isinstance(meaning, str):
            return meaning
        if meaning.startswith("Inside") and self.plan.sector(meaning.removeprefix("Inside")) is not None:
            return FUNCTION_VALUES["Inside"](self, [meaning.removeprefix("Inside"), *arguments])
        if meaning not in FUNCTION_VALUES or meaning == "Inside":
            raise UnknownNameError(f"{name}(): no such function of this autopilot")
        return FUNCTION_VALUES[meaning](self, arguments)
