"""A plain quadrotor: the plant on which the report first flew the zero-moment law (section 3.2).

No air but the thrust: m v' = R(q) F_b u - m g e_3, J w' = M_b u - w × J w, with u the four thrusts. The rotors are
the front, left, back and right one of a cross in the body frame FLU; neighbours turn opposite ways. The state is
the rigid part of :mod:`sitl.kernels.state`.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from sitl.model.airframe import Array
from sitl.kernels.state import ACTUATOR, P, Q, V, W


class Quadrotor(NamedTuple):
    """Constants of a quadrotor."""

    m: float  # mass [kg]
    J1: float  # principal inertia about x_b [kg m2]
    J2: float  # principal inertia about y_b [kg m2]
    J3: float  # principal inertia about z_b [kg m2]
    g: float  # gravity [m/s2]
    arm: float  # rotor axis to centre of mass [m]
    torque: float  # reaction torque per thrust [m]
    T_max: float  # largest thrust of a rotor [N]


def force_matrix() -> Array:
    """Input matrix F_b of the forces, (3, 4): all thrusts along z_b."""
    return np.vstack([np.zeros((2, 4)), np.ones((1, 4))])


def moment_matrix(a: Quadrotor) -> Array:
    """Input matrix M_b of the moments, (3, 4)."""
    lever, turn = a.arm, a.torque
    return np.array([[0.0, lever, 0.0, -lever], [-lever, 0.0, lever, 0.0], [turn, -turn, turn, -turn]])


@njit(cache=True)
def derivative(x: Array, force: float, mx: float, my: float, mz: float, a: Quadrotor, dx: Array) -> None:
    """Right-hand side of the equations of motion, written into ``dx`` (13,).

    Args:
        x: Rigid state (p, v, q, w), (13,).
        force: Along z_b [N].
        mx, my, mz: Moments, body frame [N m].
        a: The quadrotor.
        dx: Receives the derivative.
    """
    qw, qx, qy, qz = x[Q], x[Q + 1], x[Q + 2], x[Q + 3]
    p, q, r = x[W], x[W + 1], x[W + 2]
    dx[P], dx[P + 1], dx[P + 2] = x[V], x[V + 1], x[V + 2]
    dx[V] = 2.0 * (qx * qz + qw * qy) * force / a.m
    dx[V + 1] = 2.0 * (qy * qz - qw * qx) * force / a.m
    dx[V + 2] = (1.0 - 2.0 * (qx * qx + qy * qy)) * force / a.m - a.g
    dx[Q] = 0.5 * (-qx * p - qy * q - qz * r)
    dx[Q + 1] = 0.5 * (qw * p + qy * r - qz * q)
    dx[Q + 2] = 0.5 * (qw * q + qz * p - qx * r)
    dx[Q + 3] = 0.5 * (qw * r + qx * q - qy * p)
    dx[W] = (mx - (a.J3 - a.J2) * q * r) / a.J1
    dx[W + 1] = (my - (a.J1 - a.J3) * p * r) / a.J2
    dx[W + 2] = (mz - (a.J2 - a.J1) * p * q) / a.J3


@njit(cache=True)
def quadrotor_step(x: Array, u: Array, a: Quadrotor, dt: float) -> bool:
    """Advance the rigid state by ``dt`` in place (Runge-Kutta 4, quaternion kept unit).

    Args:
        x: Rigid state (p, v, q, w), (13,).
        u: Thrusts of the front, left, back and right rotor, (4,) [N]; cut to 0..T_max.
        a: The quadrotor.
        dt: Step [s].

    Returns:
        Whether a thrust was cut.
    """
    T = np.empty(4)
    cut = False
    for i in range(4):
        T[i] = min(max(u[i], 0.0), a.T_max)
        cut = cut or T[i] != u[i]
    force = T[0] + T[1] + T[2] + T[3]
    mx, my = a.arm * (T[1] - T[3]), a.arm * (T[2] - T[0])
    mz = a.torque * (T[0] - T[1] + T[2] - T[3])
    k, middle = np.empty((4, ACTUATOR)), np.empty(ACTUATOR)
    derivative(x, force, mx, my, mz, a, k[0])
    for stage in range(1, 4):
        h = dt if stage == 3 else 0.5 * dt
        for i in range(ACTUATOR):
            middle[i] = x[i] + h * k[stage - 1, i]
        derivative(middle, force, mx, my, mz, a, k[stage])
    for i in range(ACTUATOR):
        x[i] += dt / 6.0 * (k[0, i] + 2.0 * k[1, i] + 2.0 * k[2, i] + k[3, i])
    n = math.sqrt(x[Q] ** 2 + x[Q + 1] ** 2 + x[Q + 2] ** 2 + x[Q + 3] ** 2)
    for i in range(Q, Q + 4):
        x[i] /= n
    return cut
