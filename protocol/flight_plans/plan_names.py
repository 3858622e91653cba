"""The names of a plan that never change in flight: its waypoints, its altitudes and the autopilot's constants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from protocol.flight_plans.expressions.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import HOME_BLOCK, FlightPlan
from protocol.flight_plans.known_names import CONSTANTS

__all__ = [
    "NAV_CLIMB",
    "NAV_DESCENT",
    "NO_WAYPOINT",
    "PlanConstants",
    "block_number",
    "plan_constants",
    "waypoint_constant",
    "waypoint_numbers",
]

NAV_CLIMB, NAV_DESCENT = 0.5, -0.8  # vertical speeds of take-offs and landings, unless a plan sets others [m/s]


def waypoint_constant(name: str) -> str:
    """The name of a waypoint in expressions."""
    return f"WP_{name}"


NO_WAYPOINT = waypoint_constant("dummy")


def waypoint_numbers(plan: FlightPlan) -> dict[str, int]:
    """Numbers of the waypoints by name, as expressions see them: 0 is none of them."""
    return {point.name: number for number, point in enumerate(plan.waypoints, 1)}


def block_number(plan: FlightPlan, name: str) -> int | None:
    """Number of a block; the one that is added behind the last is HOME, unless the plan has one of its own."""
    index = plan.block_index(name)
    return len(plan.blocks) if index is None and name == HOME_BLOCK else index


def plan_constants(plan: FlightPlan) -> dict[str, Scalar]:
    """Names with a value that stays."""
    home_height = plan.security_height if plan.home_mode_height is None else plan.home_mode_height
    return {
        **CONSTANTS,
        **{waypoint_constant(name): number for name, number in waypoint_numbers(plan).items()},
        NO_WAYPOINT: 0,
        "GROUND_ALT": plan.ground_alt,
        "SECURITY_HEIGHT": plan.security_height,
        "SECURITY_ALT": plan.ground_alt + plan.security_height,
        "HOME_MODE_HEIGHT": home_height,
        "MAX_DIST_FROM_HOME": plan.max_dist_from_home,
        "max_dist_from_home": plan.max_dist_from_home,
        "NAV_DEFAULT_ALT": plan.alt,
        "QFU": plan.qfu or 0.0,
    }


class PlanConstants:
    """A table of the names that never change, with the vertical speeds a plan begins with."""

    def __init__(self, plan: FlightPlan) -> None:
        self._values = plan_constants(plan) | {"nav.climb_vspeed": NAV_CLIMB, "nav.descend_vspeed": NAV_DESCENT}

    def value(self, name: str) -> Scalar:
        """A constant.

        Raises:
            UnknownNameError: It changes in flight.
        """
        if name not in self._values:
            raise UnknownNameError(f"{name} is not constant")
        return self._values[name]

    def item(self, name: str, index: Scalar, member: str) -> Scalar:  # noqa: ARG002
        """None is constant."""
        raise UnknownNameError(f"{name}[] is not constant")

    def loop_value(self, name: str) -> Scalar:
        """None is constant."""
        raise UnknownNameError(f"${name} is not constant")

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:  # noqa: ARG002
        """None is constant."""
        raise UnknownNameError(f"{name}() is not constant")
