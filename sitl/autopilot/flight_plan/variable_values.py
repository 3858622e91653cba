"""The variables that a plan may read or set: what each is, and what setting it changes in the plan's memory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from protocol.flight_plans.expressions.evaluation import Scalar, UnknownNameError
from protocol.flight_plans.known_names import CONSTANTS
from sitl.autopilot.flight_plan.plan_inputs import MotorRequest
from sitl.autopilot.flight_plan.plan_state import PlanState
from sitl.model.battery import EMPTY_VOLTAGE, FULL_VOLTAGE

__all__ = ["VARIABLE_VALUES", "battery_voltage", "read_variable", "store_variable"]

MAX_PPRZ = 9600  # full throttle


def read_variable(state: PlanState, name: str) -> Scalar:
    """The value of a variable or constant.

    Raises:
        UnknownNameError: There is no such variable.
    """
    if name in state.memory.variables:
        return state.memory.variables[name]
    meaning = state.mapping.variables.get(name, name)
    if not isinstance(meaning, str):
        return meaning
    if meaning in VARIABLE_VALUES:
        return VARIABLE_VALUES[meaning](state)
    if meaning in state.constants:
        return state.constants[meaning]
    raise UnknownNameError(f"{name}: no such variable or constant")


def store_variable(state: PlanState, name: str, value: Scalar) -> None:
    """Set a variable of the plan, or one of the autopilot.

    Raises:
        UnknownNameError: It is neither.
    """
    memory = state.memory
    if name in memory.variables:
        memory.variables[name] = int(value) if name in memory.whole else float(value)
        return
    meaning = state.mapping.variables.get(name, name)
    if not isinstance(meaning, str):
        return  # a number by the user's word: what is stored there is of no use here
    if meaning not in _SETTERS:
        raise UnknownNameError(f"{name} cannot be set")
    _SETTERS[meaning](state, value)


def _throttle(state: PlanState) -> float:
    """Of the motors, as a share [-]: what the stage asks for, or what its climb is taken for."""
    return state.memory.throttle if state.inputs.flying else 0.0


def _set_kill(state: PlanState, value: Scalar) -> None:
    state.memory.motors.append(MotorRequest.STOP if value else MotorRequest.START)


def _set_climb(state: PlanState, value: Scalar) -> None:
    state.memory.climb_speed = float(value)


def _set_descent(state: PlanState, value: Scalar) -> None:
    state.memory.descent_speed = float(value)


def _set_radius(state: PlanState, value: Scalar) -> None:
    state.memory.radius = float(value)


def _set_heading(state: PlanState, value: Scalar) -> None:
    state.memory.heading = float(value)


def _set_flight_time(state: PlanState, value: Scalar) -> None:
    state.memory.flight_time = float(value)


def _set_forward(state: PlanState, value: Scalar) -> None:
    state.memory.forces_forward = bool(value)


def _ignore(state: PlanState, value: Scalar) -> None:
    """A launch is a take-off here."""


_SETTERS: Final[Mapping[str, Callable[[PlanState, Scalar], None]]] = {
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


def _heading(state: PlanState) -> float:
    return -state.inputs.view.heading if state.memory.heading is None else state.memory.heading


def _radius(state: PlanState) -> float:
    return state.inputs.settings.loiter_radius if state.memory.radius is None else state.memory.radius


def battery_voltage(state: PlanState) -> float:
    """Of the battery, as its charge tells [V]."""
    return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * state.inputs.view.battery_remaining


VARIABLE_VALUES: Final[Mapping[str, Callable[[PlanState], Scalar]]] = {
    "datalink_time": lambda n: int(n.inputs.datalink_time),
    "stage_time": lambda n: int(n.position.stage_time),
    "block_time": lambda n: int(n.position.block_time),
    "nav_block": lambda n: n.position.block,
    "nav_stage": lambda n: n.position.stage,
    "flight_time": lambda n: int(n.memory.flight_time),
    "autopilot_flight_time": lambda n: int(n.memory.flight_time),
    "autopilot.flight_time": lambda n: int(n.memory.flight_time),
    "electrical.bat_low": lambda n: int(n.inputs.view.battery_remaining < n.inputs.settings.battery_low),
    "electrical.bat_critical": lambda n: int(n.inputs.view.battery_remaining < n.inputs.settings.battery_critical),
    "electrical.vsupply": battery_voltage,
    "autopilot.kill_throttle": lambda n: int(not n.inputs.armed),
    "kill_throttle": lambda n: int(not n.inputs.armed),
    "autopilot.motors_on": lambda n: int(n.inputs.armed),
    "autopilot.in_flight": lambda n: int(not n.inputs.view.landed),
    "autopilot.launch": lambda n: int(n.inputs.flying),
    "launch": lambda n: int(n.inputs.flying),
    "autopilot.mode": lambda _: int(CONSTANTS["AP_MODE_NAV"]),
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
