"""Motors and elevons between command and effect (report, "Saturation des commandes").

Both models have closed forms, so positions are exact at any time within a step; commands do not change in one.
"""

from sitl.compiled import kernel
from sitl.model.airframe import FIRST_ORDER, Airframe
from sitl.model.arithmetic import clipped, exponential
from sitl.model.state import Actuators

AT_REST = 1e-9


@kernel
def limited(command: Actuators, armed: bool, a: Airframe) -> Actuators:
    """Commands within what the actuators can reach: running motors never stop, stopped ones do not turn."""
    low, high = (a.omega_min, a.omega_max) if armed else (0.0, 0.0)
    return Actuators(
        clipped(command.left_motor, low, high),
        clipped(command.right_motor, low, high),
        clipped(command.left_elevon, -a.delta_max, a.delta_max),
        clipped(command.right_elevon, -a.delta_max, a.delta_max),
    )


@kernel
def moved(now: Actuators, wanted: Actuators, dt: float, a: Airframe) -> Actuators:
    """Actuators ``dt`` seconds later, on their way to where they are wanted: rate limit or first-order lag."""
    if a.actuator_model == FIRST_ORDER:
        motor, elevon = 1.0 - exponential(-dt / a.motor_tau), 1.0 - exponential(-dt / a.elevon_tau)
        return Actuators(
            now.left_motor + motor * (wanted.left_motor - now.left_motor),
            now.right_motor + motor * (wanted.right_motor - now.right_motor),
            now.left_elevon + elevon * (wanted.left_elevon - now.left_elevon),
            now.right_elevon + elevon * (wanted.right_elevon - now.right_elevon),
        )
    motor, elevon = a.omega_rate * dt, a.delta_rate * dt
    return Actuators(
        now.left_motor + clipped(wanted.left_motor - now.left_motor, -motor, motor),
        now.right_motor + clipped(wanted.right_motor - now.right_motor, -motor, motor),
        now.left_elevon + clipped(wanted.left_elevon - now.left_elevon, -elevon, elevon),
        now.right_elevon + clipped(wanted.right_elevon - now.right_elevon, -elevon, elevon),
    )


@kernel
def limits(now: Actuators, command: Actuators, armed: bool, dt: float, a: Airframe) -> int:
    """Bits of DARKO_LIMIT that are active over a step.

    1, 2, 4, 8 are a position limit of motor left, right, elevon left, right; times 16 their rate limits.
    """
    wanted = limited(command, armed, a)
    flags = 0
    if armed:  # a stopped motor is at no limit
        flags |= 1 if command.left_motor <= a.omega_min or command.left_motor >= a.omega_max else 0
        flags |= 2 if command.right_motor <= a.omega_min or command.right_motor >= a.omega_max else 0
    flags |= 4 if abs(command.left_elevon) >= a.delta_max else 0
    flags |= 8 if abs(command.right_elevon) >= a.delta_max else 0
    if a.actuator_model != FIRST_ORDER:
        motor, elevon = a.omega_rate * dt + AT_REST, a.delta_rate * dt + AT_REST
        flags |= 16 if abs(wanted.left_motor - now.left_motor) > motor else 0
        flags |= 32 if abs(wanted.right_motor - now.right_motor) > motor else 0
        flags |= 64 if abs(wanted.left_elevon - now.left_elevon) > elevon else 0
        flags |= 128 if abs(wanted.right_elevon - now.right_elevon) > elevon else 0
    return flags
