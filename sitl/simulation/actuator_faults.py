"""Injected failures of motors and elevons: what becomes of commands on their way to the plant."""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.airframe import FIRST_ORDER, Airframe
from sitl.model.arithmetic import clipped
from sitl.model.state import Actuators
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import GARBAGE, HEALTHY, OFF, STUCK, TOO_SLOW

SLOWNESS = 10.0  # a slow actuator takes so many times as long
GARBAGE_PERIODS = 25  # control periods that a random command lasts
_BITS = 0xFFFFFFFF


class ActuatorFaults(NamedTuple):
    """Fault of each actuator: HEALTHY, OFF, STUCK, GARBAGE or TOO_SLOW."""

    left_motor: int = HEALTHY
    right_motor: int = HEALTHY
    left_elevon: int = HEALTHY
    right_elevon: int = HEALTHY
    seed: int = 0  # of random commands


NO_FAULTS = ActuatorFaults()
ACTUATOR_FAILURES = frozenset({HEALTHY, OFF, STUCK, GARBAGE, TOO_SLOW})


class Travel(NamedTuple):
    """Ends of an actuator's travel."""

    low: float
    high: float


@kernel
def is_whole(faults: ActuatorFaults) -> bool:
    """Whether no actuator fails."""
    return faults.left_motor + faults.right_motor + faults.left_elevon + faults.right_elevon == HEALTHY


@kernel
def share_drawn(seed: int, actuator: int, turn: int) -> float:
    """A number from 0 to 1 at random, the same in compiled code and in Python: 32-bit integers, mixed."""
    h = (seed * 1103 + actuator * 40503 + turn * 2654435) & _BITS
    h = ((h ^ (h >> 15)) * 0x2C1B3C6D) & _BITS
    h = ((h ^ (h >> 12)) * 0x297A2D39) & _BITS
    return ((h ^ (h >> 15)) & _BITS) / 4294967296.0


@kernel
def _failed(fault: int, wanted: float, now: float, travel: Travel, step: float, drawn: float) -> float:
    """Position of an actuator with a fault; ``step`` is as far as a slow one comes in a period."""
    if fault == OFF:  # the motor's current or the servo's torque is gone; an elevon trails with the air
        return 0.0
    if fault == STUCK:
        return now
    if fault == GARBAGE:
        return travel.low + (travel.high - travel.low) * drawn
    if fault == TOO_SLOW:
        return now + clipped(wanted - now, -step, step)
    return wanted


@kernel
def failing(
    wanted: Actuators, now: Actuators, faults: ActuatorFaults, is_armed: bool, period: int, a: Airframe
) -> Actuators:
    """Commands as failed actuators follow them.

    Args:
        wanted: Commands within their limits.
        now: Where the actuators are.
        faults: Of each.
        is_armed: Whether the motors have current: without it they stop, failed or not.
        period: Control periods flown.
        a: The airframe as it is.
    """
    turn = period // GARBAGE_PERIODS
    speeds, angles = Travel(a.omega_min, a.omega_max), Travel(-a.delta_max, a.delta_max)
    rate = a.actuator_model != FIRST_ORDER
    left, right = wanted.left_motor - now.left_motor, wanted.right_motor - now.right_motor
    up, down = wanted.left_elevon - now.left_elevon, wanted.right_elevon - now.right_elevon
    motor, elevon = a.omega_rate * PERIOD / SLOWNESS, a.delta_rate * PERIOD / SLOWNESS
    return Actuators(
        _failed(
            faults.left_motor if is_armed else HEALTHY, wanted.left_motor, now.left_motor, speeds,
            motor if rate else abs(left) / SLOWNESS, share_drawn(faults.seed, 0, turn),
        ),
        _failed(
            faults.right_motor if is_armed else HEALTHY, wanted.right_motor, now.right_motor, speeds,
            motor if rate else abs(right) / SLOWNESS, share_drawn(faults.seed, 1, turn),
        ),
        _failed(
            faults.left_elevon, wanted.left_elevon, now.left_elevon, angles,
            elevon if rate else abs(up) / SLOWNESS, share_drawn(faults.seed, 2, turn),
        ),
        _failed(
            faults.right_elevon, wanted.right_elevon, now.right_elevon, angles,
            elevon if rate else abs(down) / SLOWNESS, share_drawn(faults.seed, 3, turn),
        ),
    )  # fmt: skip
