"""The table of names that a plan's expressions are evaluated against."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from protocol.flight_plans.expressions.evaluation import Argument, Scalar, UnknownNameError
from sitl.autopilot.flight_plan.plan_functions import FUNCTION_VALUES
from sitl.autopilot.flight_plan.plan_state import PlanState
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

    def loop_value(self, name: str) -> Scalar:
        """The counter of a loop."""
        if name not in self.loops:
            raise UnknownNameError(f"${name}: no enclosing loop has this counter")
        return self.loops[name]

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:
        """What a function gives."""
        meaning = self.mapping.functions.get(name, name)
        if not isinstance(meaning, str):
            return meaning
        if meaning.startswith("Inside") and self.plan.sector(meaning.removeprefix("Inside")) is not None:
            return FUNCTION_VALUES["Inside"](self, [meaning.removeprefix("Inside"), *arguments])
        if meaning not in FUNCTION_VALUES or meaning == "Inside":
            raise UnknownNameError(f"{name}(): no such function of this autopilot")
        return FUNCTION_VALUES[meaning](self, arguments)
