"""Trims of the full plant: attitude, thrust and elevons of straight flight at a speed (report, section 4.1).

In symmetric flight without rates the moment fixes the elevons' share of the normal force whatever the thrust is,
so that the attitude, then the thrust and the elevons, follow in closed form. A constant acceleration along the path
only adds to the weight; with it the same closed form says how hard the vehicle may brake.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl.kernels.parameters import Airframe, Array

Values: TypeAlias = float | Array
Flags: TypeAlias = npt.NDArray[np.bool_]
HARDEST = 20.0  # deceleration beyond which nobody looks [m/s2]
GRID = 0.05  # of decelerations in which a limit is bracketed [m/s2]


class Trim(NamedTuple):
    """Straight flight at a speed, whether the actuators can hold it or not."""

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]
    omega: float  # of each propeller [rad/s]; 0 where the thrust would have to be negative
    margin: float  # what the elevons have left [rad]; negative: outside their limits
    motor_margin: float  # what the motors have left to their nearer limit [rad/s]
    accel: float = 0.0  # along the path [m/s2]

    @property
    def exists(self) -> bool:
        """Whether the actuators can hold it."""
        return self.margin >= 0.0 and self.motor_margin >= 0.0


class BrakingLimit(NamedTuple):
    """Largest decelerations along the path that a speed allows [m/s2].

    Negative: the vehicle cannot even hold that speed and has to gain at least as much. NaN: nothing helps.
    """

    held: Array  # motors within their limits, elevons within theirs less the reserve
    elevons: Array  # elevons alone, the motors giving whatever it takes, even a push


def level_trim(a: Airframe, speed: float, climb: float = 0.0) -> Trim:
    """The trim at a speed.

    The nose's elevation does not depend on the elevons' effectiveness, only on the ratio xi_f / xi_m: that is the
    elevons' download over the wing's lift when their moments cancel.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        climb: Angle of the path above the horizon [rad], level by default.
    """
    return decelerating_trim(a, speed, 0.0, climb)


def decelerating_trim(a: Airframe, speed: float, accel: float, climb: float = 0.0) -> Trim:
    """What flying a straight path at a constant acceleration takes as it passes a speed.

    It is quasi-steady: the slow turn of the nose that goes with the changing speed is left out.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        accel: Along the path [m/s2]; braking is negative.
        climb: Angle of the path above the horizon [rad].
    """
    theta, thrust, delta, omega, motor_margin = (float(value) for value in _balance(a, speed, accel, climb))
    return Trim(speed, climb, theta, thrust, delta, omega, a.delta_max - abs(delta), motor_margin, accel)


def braking_limit(a: Airframe, speed: Values, climb: Values = 0.0, reserve: float = 0.0) -> BrakingLimit:
    """How hard the vehicle may brake as it passes each of some speeds.

    The limit is the end of the decelerations that can be reached from steady flight without leaving the limits.

    Args:
        a: The airframe.
        speed: Through the air, any shape [m/s], >= 0.
        climb: Angle of the path above the horizon, of a shape that goes with it [rad].
        reserve: What the elevons shall have left for control [rad].

    Returns:
        Both limits, in the common shape, not beyond 20 m/s2.
    """
    speed, climb = np.broadcast_arrays(np.asarray(speed, dtype=float), np.asarray(climb, dtype=float))

    def elevons(deceleration: Array) -> Flags:
        _, _, delta, _, _ = _balance(a, speed, -deceleration, climb)
        return np.asarray(np.abs(delta) <= a.delta_max - reserve)

    def held(deceleration: Array) -> Flags:
        _, _, _, _, motor_margin = _balance(a, speed, -deceleration, climb)
        return np.asarray(elevons(deceleration) & (motor_margin >= 0.0))

    return BrakingLimit(_edge(held, speed.shape), _edge(elevons, speed.shape))


def _balance(a: Airframe, speed: Values, accel: Values, climb: Values) -> tuple[Array, Array, Array, Array, Array]:
    """Nose elevation, thrust, elevon, propeller speed and what the motors have left, in the common shape."""
    h, weight, push = 0.5 * a.rho * a.S * speed, a.m * (a.g + accel * np.sin(climb)), a.m * accel * np.cos(climb)
    lift = h * a.C_l * (1.0 - a.xi_f / a.xi_m) * speed  # of wing and elevons together, per sine of incidence
    theta = np.arctan2(weight + lift * np.sin(climb), push + lift * np.cos(climb))
    vx, vz = speed * np.cos(theta - climb), -speed * np.sin(theta - climb)

    # 2 (1 - X C_d0) T = F_x + h C_d0 (vx - xi_f delta vz) makes T = T0 + T1 delta
    both = 2.0 * (1.0 - a.S_ratio * a.C_d0)
    axial = push * np.cos(theta) + weight * np.sin(theta)
    T0, T1 = (axial + h * a.C_d0 * vx) / both, -h * a.C_d0 * a.xi_f * vz / both
    # and the elevons' force, 2 delta C_l xi_f (X T + h vx / 2) = -h C_l vz xi_f / xi_m, a quadratic in delta
    delta = _root(a.S_ratio * T1, a.S_ratio * T0 + 0.5 * h * vx, -0.5 * h * vz / a.xi_m)
    with np.errstate(invalid="ignore"):  # without a root there is no thrust either
        thrust = T0 + T1 * delta
        omega = np.sqrt(np.maximum(thrust, 0.0) / a.k_f)
    return theta, thrust, delta, omega, np.minimum(omega - a.omega_min, a.omega_max - omega)


def _root(quadratic: Array, linear: Array, constant: Array) -> Array:
    """The root of quadratic x^2 + linear x = constant that continues constant / linear; infinite without one."""
    discriminant = linear * linear + 4.0 * quadratic * constant
    slope = linear + np.copysign(np.sqrt(np.maximum(discriminant, 0.0)), linear)
    exists = (discriminant >= 0.0) & (slope != 0.0)
    root = np.where(exists, 2.0 * constant / np.where(exists, slope, 1.0), np.inf)
    return np.where(constant == 0.0, 0.0, root)


def _edge(feasible: Callable[[Array], Flags], shape: tuple[int, ...]) -> Array:
    """Largest deceleration that is feasible and so is all between it and none, or else the largest below none."""
    steps = round(HARDEST / GRID)
    grid: Array = np.linspace(-HARDEST, HARDEST, 2 * steps + 1).reshape(-1, *(1 for _ in shape))
    fits = feasible(grid)
    up, down = ~fits[steps:], fits[steps::-1]
    low = GRID * np.where(fits[steps], np.argmax(up, axis=0) - 1, -np.argmax(down, axis=0))
    open_end, never = fits[steps] & ~up.any(axis=0), ~down.any(axis=0)
    high = low + GRID
    for _ in range(30):
        middle = 0.5 * (low + high)
        inside = feasible(middle)
        low, high = np.where(inside, middle, low), np.where(inside, high, middle)
    return np.where(never, np.nan, np.where(open_end, HARDEST, low))
