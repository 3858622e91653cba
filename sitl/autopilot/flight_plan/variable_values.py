"""The variables that a plan may read or set: what each is, and what setting it changes in the plan's memory."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

from protocol.flight_plans.evaluation import Scalar, UnknownNameError
from protocol.flight_plans.plan_names import CONSTANTS
from sitl.autopilot.flight_plan.aims import away
from sitl.autopilot.flight_plan.plan_state import FIRST_VALUES, MotorRequest, PlanState
from sitl.model.battery import EMPTY_VOLTAGE, FULL_VOLTAGE

__all__ = ["VARIABLE_VALUES", "battery_voltage", "has_fix", "read_variable", "store_variable"]

POSITION_LOST = 5.0  # a position without an aid for so long is lost [s]
MAX_PPRZ = 9600  # full throttle
USUAL_SATELLITES, USUAL_ACCURACY = 12, 100  # of a position with aids, as plans ask for them [-], [cm]


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


def _set_max_speed(state: PlanState, value: Scalar) -> None:
    state.memory.max_speed = max(float(value), 0.0)


def _set_forward(state: PlanState, value: Scalar) -> None:
    state.memory.forces_forward = bool(value)


def _ignore(state: PlanState, value: Scalar) -> None:
    """A launch is a take-off here."""


def _keep(name: str) -> Callable[[PlanState, Scalar], None]:
    def store(state: PlanState, value: Scalar) -> None:
        state.memory.extras[name] = value

    return store


def _kept(name: str) -> Callable[[PlanState], Scalar]:
    return lambda state: state.memory.extras[name]


_SETTERS: Final[Mapping[str, Callable[[PlanState, Scalar], None]]] = {
    **{name: _keep(name) for name in FIRST_VALUES},
    "autopilot.kill_throttle": _set_kill,
    "kill_throttle": _set_kill,
    "autopilot.flight_time": _set_flight_time,
    "autopilot_flight_time": _set_flight_time,
    "estimator_flight_time": _set_flight_time,
    "autopilot.launch": _ignore,
    "launch": _ignore,
    "nav.radius": _set_radius,
    "nav_radius": _set_radius,
    "nav.heading": _set_heading,
    "nav.climb_vspeed": _set_climb,
    "nav_climb_vspeed": _set_climb,
    "nav.descend_vspeed": _set_descent,
    "nav_descend_vspeed": _set_descent,
    "nav_max_speed": _set_max_speed,
    "nav.max_speed": _set_max_speed,
    "force_forward": _set_forward,
}


def _heading(state: PlanState) -> float:
    return -state.inputs.view.heading if state.memory.heading is None else state.memory.heading


def _radius(state: PlanState) -> float:
    return state.inputs.settings.loiter_radius if state.memory.radius is None else state.memory.radius


def _max_speed(state: PlanState) -> float:
    return state.inputs.settings.hover_speed if state.memory.max_speed is None else state.memory.max_speed


def battery_voltage(state: PlanState) -> float:
    """Of the battery, as its charge tells [V]."""
    return _voltage(state.inputs.view.battery_remaining)


def has_fix(state: PlanState) -> bool:
    """Whether the vehicle knows where it is."""
    view = state.inputs.view
    return view.aligned and view.position_age < POSITION_LOST


def _fix_type(state: PlanState) -> Scalar:
    return CONSTANTS["GPS_FIX_3D"] if has_fix(state) else CONSTANTS["GPS_FIX_NONE"]


def _voltage(share: float) -> float:
    """Of a battery with a share of its charge [V]."""
    return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * share


VARIABLE_VALUES: Final[Mapping[str, Callable[[PlanState], Scalar]]] = {
    **{name: _kept(name) for name in FIRST_VALUES},
    "LOW_BAT_LEVEL": lambda n: _voltage(n.inputs.settings.battery_low),
    "CRITIC_BAT_LEVEL": lambda n: _voltage(n.inputs.settings.battery_critical),
    "CATASTROPHIC_BAT_LEVEL": lambda _: EMPTY_VOLTAGE,
    "state.ned_initialized_i": lambda n: int(n.inputs.view.aligned),
    "state.ned_initialized_f": lambda n: int(n.inputs.view.aligned),
    "state.utm_initialized_f": lambda n: int(n.inputs.view.aligned),
    "gps.fix": _fix_type,
    "gps_fix": _fix_type,
    "gps.num_sv": lambda n: USUAL_SATELLITES if has_fix(n) else 0,
    "gps.pacc": lambda n: USUAL_ACCURACY if has_fix(n) else 100 * USUAL_ACCURACY,
    "nav.too_far_from_home": lambda n: int(away(n.p, n.waypoints.home) > n.plan.max_dist_from_home),
    "nav.dist2_to_home": lambda n: away(n.p, n.waypoints.home) ** 2,
    "datalink_time": lambda n: int(n.inputs.datalink_time),
    "stage_time": lambda n: int(n.position.stage_time),
    "block_time": lambda n: int(n.position.block_time),
    "nav_block": lambda n: n.position.block,
    "nav_stage": lambda n: n.position.stage,
    "flight_time": lambda n: int(n.memory.flight_time),
    "autopilot_flight_time": lambda n: int(n.memory.flight_time),
    "autopilot.flight_time": lambda n: int(n.memory.flight_time),
    "estimator_flight_time": lambda n: int(n.memory.flight_time),
    "estimator_x": lambda n: n.p.x,
    "estimator_y": lambda n: n.p.y,
    "estimator_z": lambda n: n.altitude,
    "estimator_hspeed_mod": lambda n: math.hypot(n.v.x, n.v.y),
    "estimator_hspeed_dir": lambda n: math.atan2(n.v.x, n.v.y),
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
    "nav_max_speed": _max_speed,
    "nav.max_speed": _max_speed,
    "force_forward": lambda n: int(n.memory.forces_forward),
}
