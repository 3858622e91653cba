"""Trims of the full plant: attitude, thrust and elevons of straight flight at a speed (report, section 4.1).

In symmetric flight without rates the moment fixes the elevons' share of the normal force whatever the thrust is,
so that the attitude, then the thrust and the elevons, follow in closed form. A constant acceleration along the path
only adds to the weight; with it the same closed form says how hard the vehicle may brake. A turn has no closed form:
its equations are solved by continuation from straight flight.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl.model.airframe import Airframe, Array
from sitl.kernels.quaternion import from_euler, multiply, rotate_inverse
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, P, Q, V, W

Values: TypeAlias = float | Array
Flags: TypeAlias = npt.NDArray[np.bool_]
HARDEST = 20.0  # deceleration beyond which nobody looks [m/s2]
GRID = 0.05  # of decelerations in which a limit is bracketed [m/s2]
ALOFT = 1000.0  # out of the ground's reach [m]
TURN_STEP = 0.1  # of the continuation, in turn rate [rad/s] or bank [rad]
BALANCED = 1e-9  # residual of a solved turn [m/s2, rad/s2]


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


class TurningTrim(NamedTuple):
    """A steady turn without sideslip, about the vertical, climbing or not; NaN where none was found.

    Its velocity is that of the moment at which it flies north, the world frame NWU.
    """

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    turn_rate: float  # about the vertical, to the left positive [rad/s]
    bank: float  # of the wings about the velocity, into a left turn positive [rad]
    incidence: float  # of the nose over the velocity [rad]
    q: Array  # attitude, (4,)
    rates: Array  # of the body, (3,) [rad/s]
    thrust: Array  # left and right [N]
    delta: Array  # left and right [rad]
    omega: Array  # left and right [rad/s]
    margin: float  # what the more deflected elevon has left [rad]
    motor_margin: float  # what the motor nearer to a limit has left [rad/s]

    @property
    def exists(self) -> bool:
        """Whether the actuators can hold it."""
        return self.margin >= 0.0 and self.motor_margin >= 0.0

    @property
    def theta(self) -> float:
        """The nose above the horizon [rad]."""
        w, i, j, k = self.q
        return float(np.arcsin(np.clip(2.0 * (i * k - w * j), -1.0, 1.0)))


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
    theta, thrust, delta, omega, motor_margin = (float(value) for value in balance(a, speed, accel, climb))
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
        _, _, delta, _, _ = balance(a, speed, -deceleration, climb)
        return np.asarray(np.abs(delta) <= a.delta_max - reserve)

    def held(deceleration: Array) -> Flags:
        _, _, _, _, motor_margin = balance(a, speed, -deceleration, climb)
        return np.asarray(elevons(deceleration) & (motor_margin >= 0.0))

    return BrakingLimit(_edge(held, speed.shape), _edge(elevons, speed.shape))


def turning_trim(a: Airframe, speed: float, turn_rate: float, climb: float = 0.0) -> TurningTrim:
    """The steady turn at a rate.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        turn_rate: About the vertical, to the left positive [rad/s].
        climb: Angle of the path above the horizon [rad].
    """
    return _turn(a, speed, climb, turn_rate, banked=False)


def banked_trim(a: Airframe, speed: float, bank: float, climb: float = 0.0) -> TurningTrim:
    """The steady turn at a bank.

    Args:
        a: The airframe.
        speed: Through the air [m/s], > 0: without speed a bank is no turn.
        bank: Of the wings about the velocity, into a left turn positive [rad].
        climb: Angle of the path above the horizon [rad].
    """
    return _turn(a, speed, climb, bank, banked=True)


def _turn(a: Airframe, speed: float, climb: float, asked: float, *, banked: bool) -> TurningTrim:
    """Follow the turn from straight flight to what is asked; each step starts where the last two point."""
    from scipy.optimize import root  # noqa: PLC0415 - a second that only designs need

    start = level_trim(a, speed, climb)
    now = np.array((start.theta - climb, 0.0, start.thrust, start.thrust, start.delta, start.delta))
    before, steps = now, math.ceil(abs(asked) / TURN_STEP)
    for step in range(1, steps + 1 if np.isfinite(now).all() else 1):
        known = asked * step / steps

        def residual(unknown: Array, known: float = known) -> Array:
            return _unbalanced(a, speed, climb, unknown, known, banked=banked)

        found = root(residual, 2.0 * now - before, tol=1e-13)
        before, now = now, found.x
        if not np.abs(residual(now)).max() < BALANCED:
            now = np.full(6, np.nan)
            break
    return _described(a, speed, climb, now, asked, banked=banked)


def _attitude(climb: float, bank: float, incidence: float) -> Array:
    """Attitude of a vehicle that flies north: nose up from the velocity, banked about it, (4,)."""
    return multiply(from_euler(-bank, -climb, 0.0), from_euler(0.0, -incidence, 0.0))


def _unbalanced(a: Airframe, speed: float, climb: float, unknown: Array, known: float, *, banked: bool) -> Array:
    """What a turn leaves of the accelerations [m/s2, rad/s2], (6,).

    Args:
        a: The airframe.
        speed: [m/s].
        climb: [rad].
        unknown: Incidence, bank or turn rate whichever is not known, both thrusts and both elevons, (6,).
        known: The other of bank and turn rate.
        banked: Whether it is the bank that is known.
    """
    bank, turn_rate = (known, unknown[1]) if banked else (unknown[1], known)
    x, dx = np.zeros(ANCHOR), np.empty(ACTUATOR)
    x[P + 2], x[V], x[V + 2] = ALOFT, speed * math.cos(climb), speed * math.sin(climb)
    x[Q:W] = _attitude(climb, bank, unknown[0])
    x[W:ACTUATOR] = rotate_inverse(x[Q:W], np.array((0.0, 0.0, turn_rate)))
    x[ACTUATOR:] = *np.sqrt(np.maximum(unknown[2:4], 0.0) / a.k_f), *unknown[4:]
    derivative(x, np.full(SIZE, math.nan), np.zeros(3), a, dx)
    dx[V + 1] -= turn_rate * x[V]  # the turn's own acceleration, to the left of north
    return np.concatenate((dx[V:Q], dx[W:]))


def _described(a: Airframe, speed: float, climb: float, solved: Array, known: float, *, banked: bool) -> TurningTrim:
    bank, turn_rate = (known, float(solved[1])) if banked else (float(solved[1]), known)
    q, thrust, delta = _attitude(climb, bank, solved[0]), solved[2:4], solved[4:]
    omega = np.sqrt(np.maximum(thrust, 0.0) / a.k_f)
    rates = rotate_inverse(q, np.array((0.0, 0.0, turn_rate)))
    margin = a.delta_max - float(np.abs(delta).max())
    motor_margin = float(np.minimum(omega - a.omega_min, a.omega_max - omega).min())
    return TurningTrim(
        speed, climb, turn_rate, bank, float(solved[0]), q, rates, thrust, delta, omega, margin, motor_margin
    )


def balance(a: Airframe, speed: Values, accel: Values, climb: Values) -> tuple[Array, Array, Array, Array, Array]:
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
