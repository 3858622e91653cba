"""Trims of the full plant in straight flight: attitude, thrust and elevons at a speed (report, section 4.1).

In symmetric flight without rates the moment fixes the elevons' share of the normal force whatever the thrust is,
so that the attitude, then the thrust and the elevons, follow in closed form. A constant acceleration along the path
only adds to the weight; with it the same closed form says how hard the vehicle may brake. Turns: see
:mod:`sitl.design.turn`.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeAlias

import numpy as np

from sitl.compiled import entry, kernel, subroutine
from sitl.model.aerodynamics import slopes, wrench
from sitl.model.airframe import REPORT, Airframe, Array, elevon_arm
from sitl.model.arithmetic import arctangent, clipped, sine_cosine
from sitl.model.propeller import speed_for
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

Values: TypeAlias = float | Array
MAX_DECELERATION = 20.0  # to which limits are looked for [m/s2]
INCIDENCES = 60  # at which a balance of a wing that stalls is sought
MAX_INCIDENCE = 2.4  # [rad]
COARSE_PASSES, TRIM_PASSES = 8, 32  # of the thrust and the elevons at one of them, and in the end
TRIM_GRIP = 0.05  # of both elevons, in air that they do not meet [N/rad]
MAX_DELTA = 1.5  # [rad]
GRID = 0.05  # of decelerations in which a limit is bracketed [m/s2]
HALVINGS = 30  # of that bracket


class Trim(NamedTuple):
    """Straight flight at a speed, whether the actuators can hold it or not."""

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]; infinite where no angle balances
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
    """Trim at one instant of a straight path flown at a constant acceleration.

    It is quasi-steady: the slow turn of the nose that goes with the changing speed is left out.

    Args:
        a: The airframe.
        speed: Through the air [m/s], >= 0.
        accel: Along the path [m/s2]; braking is negative.
        climb: Angle of the path above the horizon [rad].
    """
    return trims(a, speed, climb, accel)[0]


def trims(a: Airframe, speed: Values, climb: Values = 0.0, accel: Values = 0.0) -> list[Trim]:
    """The trims at speeds, climbs and accelerations of shapes that go together, row by row."""
    speed, climb, accel = (
        x.ravel() for x in np.broadcast_arrays(*(np.asarray(x, float) for x in (speed, climb, accel)))
    )
    rows = balances(a, speed, climb, accel).tolist()
    return [
        Trim(
            speed=at,
            climb=path,
            theta=theta,
            thrust=thrust,
            delta=delta,
            omega=omega,
            margin=a.delta_max - abs(delta),
            motor_margin=motor_margin,
            accel=along,
        )
        for at, path, along, (theta, thrust, delta, omega, motor_margin) in zip(
            speed.tolist(), climb.tolist(), accel.tolist(), rows, strict=True
        )
    ]


def braking_limit(a: Airframe, speed: Values, climb: Values = 0.0, reserve: float = 0.0) -> BrakingLimit:
    """The greatest deceleration of the vehicle at each of some speeds.

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
    limits = _limits(a, speed.ravel(), climb.ravel(), a.delta_max - reserve)
    return BrakingLimit(*limits.reshape(2, *speed.shape))


class Balance(NamedTuple):
    """Attitude, thrust and elevons that straight flight takes."""

    theta: float  # nose above the horizon [rad]
    thrust: float  # of each motor [N]
    delta: float  # of each elevon [rad]; infinite where no angle balances
    omega: float  # of each propeller [rad/s]
    motor_margin: float  # what the motors have left to their nearer limit [rad/s]


class Asked(NamedTuple):
    """Straight flight, and the forces that it takes."""

    speed: float  # through the air [m/s]
    climb: float  # angle of the path above the horizon [rad]
    weight: float  # upwards [N]
    push: float  # level, ahead [N]


@subroutine
def balance(a: Airframe, speed: float, climb: float, accel: float) -> Balance:
    """Straight flight at a speed, a climb and an acceleration along the path; see :class:`Trim`."""
    return _balance(a, speed, climb, accel) if a.aerodynamics == REPORT else _sought_balance(a, speed, climb, accel)


@subroutine
def _balance(a: Airframe, speed: float, climb: float, accel: float) -> Balance:
    """In closed form, of the aerodynamics that are linear in the incidence."""
    rise, run = sine_cosine(climb)
    h, weight, push = 0.5 * a.rho * a.S * speed, a.m * (a.g + accel * rise), a.m * accel * run
    lift = h * a.C_l * (1.0 - a.xi_f / a.xi_m) * speed  # of wing and elevons together, per sine of incidence
    theta = arctangent(weight + lift * rise, push + lift * run)
    up, ahead = sine_cosine(theta)
    across, along = sine_cosine(theta - climb)
    vx, vz = speed * along, -speed * across

    # 2 (1 - X C_d0) T = F_x + h C_d0 (vx - xi_f delta vz) makes T = T0 + T1 delta
    both = 2.0 * (1.0 - a.S_ratio * a.C_d0)
    T0, T1 = (push * ahead + weight * up + h * a.C_d0 * vx) / both, -h * a.C_d0 * a.xi_f * vz / both
    # and the elevons' force, 2 delta C_l xi_f (X T + h vx / 2) = -h C_l vz xi_f / xi_m, a quadratic in delta
    delta = _root(a.S_ratio * T1, a.S_ratio * T0 + 0.5 * h * vx, -0.5 * h * vz / a.xi_m)
    thrust = T0 + T1 * delta
    return _held(theta, thrust, delta, vx, a)


@kernel
def _held(theta: float, thrust: float, delta: float, inflow: float, a: Airframe) -> Balance:
    omega = speed_for(thrust, inflow, a)
    return Balance(
        theta=theta, thrust=thrust, delta=delta, omega=omega, motor_margin=min(omega - a.omega_min, a.omega_max - omega)
    )


@subroutine
def _sought_balance(a: Airframe, speed: float, climb: float, accel: float) -> Balance:
    """By search from the least incidence on: a wing that stalls may balance at several."""
    rise, run = sine_cosine(climb)
    asked = Asked(speed, climb, weight=a.m * (a.g + accel * rise), push=a.m * accel * run)
    low = 0.0
    before = _across(low, asked, COARSE_PASSES, a)
    for step in range(1, INCIDENCES + 1):
        high = step * (MAX_INCIDENCE / INCIDENCES)
        after = _across(high, asked, COARSE_PASSES, a)
        if (before <= 0.0) != (after <= 0.0):
            break
        low, before = high, after
    high = min(low + MAX_INCIDENCE / INCIDENCES, MAX_INCIDENCE)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        value = _across(middle, asked, TRIM_PASSES, a)
        if (value <= 0.0) == (before <= 0.0):
            low = middle
        else:
            high = middle
    thrust, delta, vx = _trimmed(low, asked, TRIM_PASSES, a)
    return _held(climb + low, thrust, delta, vx, a)


@kernel
def _trimmed(incidence: float, asked: Asked, passes: int, a: Airframe) -> tuple[float, float, float]:
    """Thrust [N] and elevons [rad] that give the axial force and no moment at an incidence, and the air along x_b."""
    across, along = sine_cosine(incidence)
    up, ahead = sine_cosine(asked.climb + incidence)
    v = Vector(asked.speed * along, 0.0, -asked.speed * across)
    wanted = asked.push * ahead + asked.weight * up
    thrust, delta = 0.5 * wanted, 0.0
    for _ in range(passes):
        stream = slopes(v, thrust, thrust, a)
        grip = max(stream.left_elevon + stream.right_elevon, TRIM_GRIP)
        omega = speed_for(thrust, v.x, a)
        F, M = wrench(v, Vector(0.0, 0.0, 0.0), Actuators(omega, omega, delta, delta), a)
        delta = clipped(delta + M.y / (elevon_arm(a) * grip), -MAX_DELTA, MAX_DELTA)
        thrust += 0.5 * (wanted - F.x) / (1.0 - a.S_ratio * a.C_d0)
    return thrust, delta, v.x


@kernel
def _across(incidence: float, asked: Asked, passes: int, a: Airframe) -> float:
    """Force along z_b that is left unbalanced at an incidence, thrust and elevons trimmed [N]."""
    thrust, delta, vx = _trimmed(incidence, asked, passes, a)
    up, ahead = sine_cosine(asked.climb + incidence)
    across, _ = sine_cosine(incidence)
    omega = speed_for(thrust, vx, a)
    F, _ = wrench(
        Vector(vx, 0.0, -asked.speed * across), Vector(0.0, 0.0, 0.0), Actuators(omega, omega, delta, delta), a
    )
    return F.z - (asked.weight * ahead - asked.push * up)


@kernel
def _root(quadratic: float, linear: float, constant: float) -> float:
    """The root of quadratic x^2 + linear x = constant that continues constant / linear; infinite without one."""
    discriminant = linear * linear + 4.0 * quadratic * constant
    size = math.sqrt(max(discriminant, 0.0))
    slope = linear + (size if linear >= 0.0 else -size)
    if constant == 0.0:
        return 0.0
    return 2.0 * constant / slope if discriminant >= 0.0 and slope != 0.0 else math.inf


@entry
def balances(a: Airframe, speed: Array, climb: Array, accel: Array) -> Array:
    """Of each entry of three arrays (n,) the :class:`Balance`, (n, 5)."""
    rows = np.empty((speed.size, 5))
    for i in range(speed.size):
        theta, thrust, delta, omega, motor_margin = balance(a, speed[i], climb[i], accel[i])
        rows[i, 0], rows[i, 1], rows[i, 2], rows[i, 3], rows[i, 4] = theta, thrust, delta, omega, motor_margin
    return rows


@entry
def _limits(a: Airframe, speed: Array, climb: Array, room: float) -> Array:
    """Both braking limits at each speed, held and elevons alone, (2, n)."""
    limits = np.empty((2, speed.size))
    for i in range(speed.size):
        limits[0, i] = _edge(a, speed[i], climb[i], room, True)
        limits[1, i] = _edge(a, speed[i], climb[i], room, False)
    return limits


@subroutine
def _edge(a: Airframe, speed: float, climb: float, room: float, motors: bool) -> float:
    """Largest deceleration that is feasible and so is all between it and none, or else the largest below none."""
    last, low, found = int(MAX_DECELERATION / GRID + 0.5), 0, _feasible(a, speed, climb, 0.0, room, motors)
    if found:
        while low < last and _feasible(a, speed, climb, GRID * (low + 1), room, motors):
            low += 1
        if low == last:
            return MAX_DECELERATION
    while not found and low > -last:
        low -= 1
        found = _feasible(a, speed, climb, GRID * low, room, motors)
    inside, outside = GRID * low, GRID * (low + 1)
    for _ in range(HALVINGS):
        middle = 0.5 * (inside + outside)
        if _feasible(a, speed, climb, middle, room, motors):
            inside = middle
        else:
            outside = middle
    return inside if found else math.nan


@kernel
def _feasible(a: Airframe, speed: float, climb: float, deceleration: float, room: float, motors: bool) -> bool:
    """Whether the elevons stay within their room, and the motors, if they count, within their limits."""
    flown = balance(a, speed, climb, -deceleration)
    return abs(flown.delta) <= room and (flown.motor_margin >= 0.0 or not motors)
