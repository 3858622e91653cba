"""The table of names that a plan's expressions are evaluated against."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Final, Protocol

from protocol.flight_plans.evaluation import Argument, Scalar, UnknownNameError
from protocol.flight_plans.flight_plan import FlightPlan
from protocol.flight_plans.name_mapping import NameMapping
from protocol.flight_plans.plan_geometry import EnuPoint
from protocol.flight_plans.plan_names import plan_constants
from sitl.autopilot.flight_plan.plan_functions import FUNCTION_VALUES
from sitl.autopilot.flight_plan.plan_inputs import MotorRequest, PlanInputs
from sitl.autopilot.flight_plan.plan_memory import PlanMemory
from sitl.autopilot.flight_plan.waypoint_table import WaypointTable
from sitl.model.battery import EMPTY_VOLTAGE, FULL_VOLTAGE

__all__ = ["VARIABLE_VALUES", "NameValues", "PlanPosition"]

MAX_PPRZ = 9600  # full throttle


class PlanPosition(Protocol):
    """Where a plan is in its blocks."""

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


class NameValues:
    """Names of one plan in flight.

    Attributes:
        plan: Whose names they are.
        inputs: The vehicle at this tick.
        memory: What the plan has set.
        waypoints: Where they are.
        position: Where the plan is.
        p: Where the vehicle is, of the plan's origin.
        v: Its velocity, east, north and up [m/s].
        loops: The counters of loops.
    """

    plan: FlightPlan
    inputs: PlanInputs
    memory: PlanMemory
    waypoints: WaypointTable
    position: PlanPosition
    p: EnuPoint
    v: EnuPoint

    def __init__(
        self,
        plan: FlightPlan,
        mapping: NameMapping,
        memory: PlanMemory,
        waypoints: WaypointTable,
        position: PlanPosition,
        inputs: PlanInputs,
    ) -> None:
        self.plan, self.memory, self.waypoints, self.position, self.inputs = plan, memory, waypoints, position, inputs
        self._mapping = mapping
        self._constants = plan_constants(plan)
        self.loops: dict[str, Scalar] = {}
        self.p = self.v = EnuPoint(0.0, 0.0, 0.0)

    # What expressions ask

    def value(self, name: str) -> Scalar:
        """The value of a variable or constant."""
        if name in self.memory.variables:
            return self.memory.variables[name]
        meaning = self._mapping.variables.get(name, name)
        if not isinstance(meaning, str):
            return meaning
        if meaning in VARIABLE_VALUES:
            return VARIABLE_VALUES[meaning](self)
        if meaning in self._constants:
            return self._constants[meaning]
        raise UnknownNameError(f"{name}: no such variable or constant")

    def loop_value(self, name: str) -> Scalar:
        """The counter of a loop."""
        if name not in self.loops:
            raise UnknownNameError(f"${name}: no loop around has this counter")
        return self.loops[name]

    def call(self, name: str, arguments: Sequence[Argument]) -> Scalar | Mapping[str, float]:
        """What a function gives."""
        meaning = self._mapping.functions.get(name, name)
        if not isinstance(meaning, str):
            return meaning
        if meaning.startswith("Inside") and self.plan.sector(meaning.removeprefix("Inside")) is not None:
            return FUNCTION_VALUES["Inside"](self, [meaning.removeprefix("Inside"), *arguments])
        if meaning not in FUNCTION_VALUES or meaning == "Inside":
            raise UnknownNameError(f"{name}(): no such function of this autopilot")
        return FUNCTION_VALUES[meaning](self, arguments)

    # What a plan changes

    def store(self, name: str, value: Scalar) -> None:
        """Set a variable of the plan, or one of the autopilot.

        Raises:
            UnknownNameError: It is neither.
        """
        if name in self.memory.variables:
            self.memory.variables[name] = int(value) if name in self.memory.whole else float(value)
            return
        meaning = self._mapping.variables.get(name, name)
        if not isinstance(meaning, str):
            return  # a number by the user's word: what is stored there is of no use here
        if meaning not in _SETTERS:
            raise UnknownNameError(f"{name} cannot be set")
        _SETTERS[meaning](self, value)

    @property
    def height(self) -> float:
        """Of the vehicle above the ground reference [m]."""
        return self.p.z - self.memory.ground_height

    @property
    def altitude(self) -> float:
        """Of the vehicle above the sea, as the plan counts it [m]."""
        return self.plan.ground_alt + self.p.z + self.memory.altitude_shift


def _throttle(names: NameValues) -> float:
    """Of the motors, as a share [-]: what the stage asks for, or what its climb is taken for."""
    return names.memory.throttle if names.inputs.flying else 0.0


def _set_kill(names: NameValues, value: Scalar) -> None:
    names.memory.motors.append(MotorRequest.STOP if value else MotorRequest.START)


def _set_climb(names: NameValues, value: Scalar) -> None:
    names.memory.climb_speed = float(value)


def _set_descent(names: NameValues, value: Scalar) -> None:
    names.memory.descent_speed = float(value)


def _set_radius(names: NameValues, value: Scalar) -> None:
    names.memory.radius = float(value)


def _set_heading(names: NameValues, value: Scalar) -> None:
    names.memory.heading = float(value)


def _set_flight_time(names: NameValues, value: Scalar) -> None:
    names.memory.flight_time = float(value)


def _set_forward(names: NameValues, value: Scalar) -> None:
    names.memory.forces_forward = bool(value)


def _ignore(names: NameValues, value: Scalar) -> None:
    """A launch is a take-off here."""


_SETTERS: Final[Mapping[str, Callable[[NameValues, Scalar], None]]] = {
    "autopilot.kill_throttle": _set_kill,
    "kill_throttle": _set_kill,
    "autopilot.flight_time": _set_flight_time,
    "autopilot.launch": _ignore,
    "launch": _ignore,
    "nav.radius": _set_radius,
    "nav_radius": _set_radius,
    "nav.heading": _set_heading,
    "nav.climb_vspeed": _set_climb,
    "nav_climb_vspeed": _set_climb,
    "nav.descend_vspeed": _set_descent,
    "nav_descend_vspeed": _set_descent,
    "force_forward": _set_forward,
}


def _heading(names: NameValues) -> float:
    return -names.inputs.view.heading if names.memory.heading is None else names.memory.heading


def _radius(names: NameValues) -> float:
    return names.inputs.settings.loiter_radius if names.memory.radius is None else names.memory.radius


def _voltage(names: NameValues) -> float:
    return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * names.inputs.view.battery_left


VARIABLE_VALUES: Final[Mapping[str, Callable[[NameValues], Scalar]]] = {
    "datalink_time": lambda n: int(n.inputs.datalink_time),
    "stage_time": lambda n: int(n.position.stage_time),
    "block_time": lambda n: int(n.position.block_time),
    "nav_block": lambda n: n.position.block,
    "nav_stage": lambda n: n.position.stage,
    "flight_time": lambda n: int(n.memory.flight_time),
    "autopilot_flight_time": lambda n: int(n.memory.flight_time),
    "autopilot.flight_time": lambda n: int(n.memory.flight_time),
    "electrical.bat_low": lambda n: int(n.inputs.view.battery_left < n.inputs.settings.battery_low),
    "electrical.bat_critical": lambda n: int(n.inputs.view.battery_left < n.inputs.settings.battery_critical),
    "electrical.vsupply": _voltage,
    "autopilot.kill_throttle": lambda n: int(not n.inputs.armed),
    "kill_throttle": lambda n: int(not n.inputs.armed),
    "autopilot.motors_on": lambda n: int(n.inputs.armed),
    "autopilot.in_flight": lambda n: int(not n.inputs.view.landed),
    "autopilot.launch": lambda n: int(n.inputs.flying),
    "launch": lambda n: int(n.inputs.flying),
    "autopilot.mode": lambda n: int(n.value("AP_MODE_NAV")),
    "radio_control.status": lambda n: 2 * int(n.inputs.radio_lost),
    "guidance_v.delta_t": lambda n: MAX_PPRZ * _throttle(n),
    "ground_alt": lambda n: n.plan.ground_alt + n.memory.ground_height,
    "dist2_to_home": lambda n: (n.p.x - n.waypoints.home.x) ** 2 + (n.p.y - n.waypoints.home.y) ** 2,
    "dist2_to_wp": lambda n: (n.p.x - n.memory.last_point.x) ** 2 + (n.p.y - n.memory.last_point.y) ** 2,
    "baseleg_out_qdr": lambda n: n.memory.baseleg_qdr,
    "nav.radius": _radius,
    "nav_radius": _radius,
    "DEFAULT_CIRCLE_RADIUS": lambda n: n.inputs.settings.loiter_radius,
    "NAV_DEFAULT_RADIUS": lambda n: n.inputs.settings.loiter_radius,
    "nav.heading": _heading,
    "nav.climb_vspeed": lambda n: n.memory.climb_speed,
    "nav_climb_vspeed": lambda n: n.memory.climb_speed,
    "nav.descend_vspeed": lambda n: n.memory.descent_speed,
    "nav_descend_vspeed": lambda n: n.memory.descent_speed,
    "force_forward": lambda n: int(n.memory.forces_forward),
}
