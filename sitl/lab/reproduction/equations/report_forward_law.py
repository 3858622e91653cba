r"""The report's own line-of-sight law for forward flight (report, section 4.2), with its slips as options.

The velocity is turned towards the target by a moment Gamma; a state of the law, u_bar = (T1 - T2, delta1 + delta2,
delta1 - delta2), makes the model's moment M follow it; the sum of the thrusts holds the speed
along the nose:

.. math::
    \Gamma &= -k_c \, \epsilon_e - k_d \, \omega + \omega \times J \omega, \qquad
    \dot{\bar u} = -k_u \, (\partial M / \partial \bar u)^{\#} \, (M(u') - \Gamma) \\
    T_1 + T_2 &= k_p (v_c - v_{b,x}) + k_i \int (v_c - v_{b,x}) \, dt

Corrected against the report: eps_e, an axis of the world, is turned into the body before it serves as a moment; the
second root of q_e has its missing minus; the PI integrates the error, not v_bx; sign(eta_e) is always one, because
the eta_e of two directions is a square root. ``swapped`` keeps the report's M_y, in which T1 - T2 and T1 + T2 are
exchanged, and ``singular_floor`` the lower bound of singular values that the report needs because of it. The vehicle
does not fly this law: it controls neither bank nor sideslip, which only works for targets in the vertical plane.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl import Actuators, Airframe, Array, Body, Vector
from sitl.compiled import subroutine
from sitl.lab.reproduction.equations.airspeed_model import moment, moment_jacobian
from sitl.model.phi_theory import effective_speed
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import cross, norm, scaled, subtract

INTEGRAL = 3  # index of the speed's integral in the law's state (u_bar, integral)


class ReportForwardGains(NamedTuple):
    """Gains, and which of the report's two slips are left in."""

    a: Airframe  # of the inverted model
    k_c: float = 0.3  # line of sight [N m]
    k_d: float = 0.1  # rates [N m s]
    k_u: float = 50.0  # convergence of the moment [1/s]
    k_p: float = 1.0  # speed [N s/m]
    k_i: float = 0.5  # its integral [N/m]
    swapped: int = 0  # 1: M_y as the report types it
    singular_floor: float = 0.0  # lower bound of singular values over the largest


class ReportTarget(NamedTuple):
    """Place to fly to, and the speed."""

    position: Vector  # world NWU [m]
    speed: float  # wanted airspeed along the nose v_c [m/s]


@subroutine
def start(now: Actuators, gains: ReportForwardGains) -> Array:
    """The law's state (u_bar, integral) whose first command equals the present actuators, (4,)."""
    w1, w2, d1, d2 = now
    k = gains.a.k_f
    return np.array((k * (w1 * w1 - w2 * w2), d1 + d2, d1 - d2, k * (w1 * w1 + w2 * w2) / gains.k_i))


@subroutine
def control(body: Body, wind: Vector, target: ReportTarget, gains: ReportForwardGains, dt: float, law: Array) -> Array:
    """One tick of the law: thrusts [N] and deflections [rad] (T1, T2, delta1, delta2), (4,).

    Args:
        body: Position and velocity world NWU, attitude, body rates.
        wind: Velocity of the air, world NWU [m/s].
        target: Where to fly to.
        gains: Gains of the law.
        dt: Tick [s].
        law: u_bar and the integral, (4,), changed in place; limited to what the actuators can give.
    """
    a = gains.a
    air = rotate_inverse(body.attitude, subtract(body.velocity, wind))
    low, high = 2.0 * a.k_f * a.omega_min * a.omega_min, 2.0 * a.k_f * a.omega_max * a.omega_max
    off = target.speed - air.x
    total = min(max(gains.k_p * off + gains.k_i * law[INTEGRAL], low), high)
    if (total < high or off < 0.0) and (total > low or off > 0.0):
        law[INTEGRAL] += dt * off
    wanted = wanted_moment(body, target.position, gains)
    command = np.array((total, law[0], law[1], law[2]))
    M, J = model(np.array((air.x, air.y, air.z)), effective_speed(air, body.rates, a), command, gains)
    rate = limited_inverse(J, gains.singular_floor) @ (M - np.array((wanted.x, wanted.y, wanted.z)))
    for i in range(3):
        law[i] -= dt * gains.k_u * rate[i]
    return _within_limits(total, law, a)


@subroutine
def _within_limits(total: float, law: Array, a: Airframe) -> Array:
    """The actuators' command within their limits, (4,); u_bar is changed in place to match it."""
    low, high = a.k_f * a.omega_min * a.omega_min, a.k_f * a.omega_max * a.omega_max
    T1 = min(max(0.5 * (total + law[0]), low), high)
    T2 = min(max(0.5 * (total - law[0]), low), high)
    d1 = min(max(0.5 * (law[1] + law[2]), -a.delta_max), a.delta_max)
    d2 = min(max(0.5 * (law[1] - law[2]), -a.delta_max), a.delta_max)
    law[0], law[1], law[2] = T1 - T2, d1 + d2, d1 - d2
    return np.array((T1, T2, d1, d2))


@subroutine
def line_of_sight(body: Body, target: Vector) -> tuple[Vector, float]:
    """Vector part of q_e, from the direction of the target to that of the velocity, world, and the angle [rad].

    u_c × u_v / (2 cos(theta / 2)) is the report's expression without its 0/0 at alignment. If the two are opposite, any
    axis would do: that of the vertical plane is chosen.
    """
    to, v = subtract(target, body.position), body.velocity
    distance, speed = norm(to), norm(v)
    if distance < 1e-9 or speed < 1e-9:
        return Vector(0.0, 0.0, 0.0), 0.0
    u_c, u_v = scaled(to, 1.0 / distance), scaled(v, 1.0 / speed)
    cosine = min(max(u_c.x * u_v.x + u_c.y * u_v.y + u_c.z * u_v.z, -1.0), 1.0)
    angle = math.acos(cosine)
    if cosine < -1.0 + 1e-12:
        return Vector(0.0, 1.0, 0.0), angle
    return scaled(cross(u_c, u_v), 1.0 / math.sqrt(2.0 * (1.0 + cosine))), angle


@subroutine
def wanted_moment(body: Body, target: Vector, gains: ReportForwardGains) -> Vector:
    """Moment Gamma that turns the velocity to the target, body frame [N m]."""
    a, w = gains.a, body.rates
    axis, _ = line_of_sight(body, target)
    stiff = rotate_inverse(body.attitude, axis)
    return Vector(
        -gains.k_c * stiff.x - gains.k_d * w.x + (a.J3 - a.J2) * w.y * w.z,
        -gains.k_c * stiff.y - gains.k_d * w.y + (a.J1 - a.J3) * w.x * w.z,
        -gains.k_c * stiff.z - gains.k_d * w.z + (a.J2 - a.J1) * w.x * w.y,
    )


@subroutine
def model(v_b: Array, eta: float, command: Array, gains: ReportForwardGains) -> tuple[Array, Array]:
    """Moment M(u'), (3,) [N m], and its Jacobian by u_bar, (3, 3), with M_y corrected or as typed.

    Args:
        v_b: Velocity relative to the air, body frame, (3,) [m/s].
        eta: sqrt(|v_b|^2 + mu c^2 |w|^2) [m/s].
        command: u', (4,).
        gains: The airframe and which M_y.
    """
    a = gains.a
    M, J = moment(v_b, eta, command, a), moment_jacobian(v_b, eta, command, a)
    if gains.swapped:
        arm, slip = a.Delta_r * a.xi_m / a.xi_f, 0.5 * a.S_ratio * a.C_l * a.xi_f
        total, differ, both, apart = command[0], command[1], command[2], command[3]
        M[1] -= arm * slip * (differ - total) * (both - apart)
        J[1, 0] = -arm * slip * both
        J[1, 1] -= arm * slip * (differ - total)
        J[1, 2] = -arm * slip * total
    return M, J


@subroutine
def limited_inverse(J: Array, floor: float) -> Array:
    """Inverse by singular values, each raised to at least ``floor`` times the largest, (3, 3)."""
    left, singular, right = np.linalg.svd(J)
    lower_bound = max(floor * singular[0], 1e-12)
    inverse = np.zeros((3, 3))
    for k in range(3):
        scale = 1.0 / max(singular[k], lower_bound)
        for i in range(3):
            for j in range(3):
                inverse[i, j] += scale * right[k, i] * left[j, k]
    return inverse
