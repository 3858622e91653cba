"""LQR and LQI about the hover (report, sections 3.1.2 and 3.1.3)."""

from __future__ import annotations

import math

import numpy as np

from sitl.kernels.hover_model import force_matrix, inertia, moment_matrix
from sitl.kernels.parameters import Airframe, Array
from sitl.laws.hover_linear import LinearGains

INTEGRAL_WEIGHT = 0.2  # of each integrated position in the LQI's cost
LEAD = 1.3  # [s]
INTEGRAL_LIMIT = 2.0  # [m]


def hover_linearisation(a: Airframe) -> tuple[Array, Array]:
    """A (12, 12) and B (12, 4) of x = (p, v, eps - eps_bar, w) about the hover at heading 0.

    The quaternion is constrained to unit norm: the report's entry dv_z/deps_2 = -sqrt2 g comes from forgetting
    that; it is zero.
    """
    r = math.sqrt(2.0)
    A = np.zeros((12, 12))
    A[0:3, 3:6] = np.eye(3)
    A[3, 7], A[4, 6], A[4, 8] = 2.0 * r * a.g, -r * a.g, r * a.g
    A[6:9, 9:12] = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]]) / (2.0 * r)
    R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # R(q_bar)
    B = np.zeros((12, 4))
    B[3:6] = R @ force_matrix(a) / a.m
    B[9:12] = moment_matrix(a) / inertia(a)[:, None]
    return A, B


def lqr(A: Array, B: Array, Q: Array, R: Array) -> tuple[Array, Array]:
    """Gain K and cost matrix S of the infinite-horizon LQR, u = -K x, V = x' S x."""
    from scipy.linalg import solve_continuous_are  # noqa: PLC0415 - a second that only designs need

    S = solve_continuous_are(A, B, Q, R)
    return np.linalg.solve(R, B.T @ S), S


def hover_thrust(a: Airframe) -> Array:
    """Virtual commands of the hover, u_bar = m g / (2 (1 - S_ratio C_d0)) (1, 1, 0, 0), (4,)."""
    T = 0.5 * a.m * a.g / (1.0 - a.S_ratio * a.C_d0)
    return np.array([T, T, 0.0, 0.0])


def hover_gains(a: Airframe, *, integral: bool = True) -> LinearGains:
    """Gains of the linear hover law with Q = I, R = I as in the report; V is always the LQR's.

    With ``integral``, K is the LQI's less what the lead of the integral gives back (see
    :func:`sitl.laws.hover_linear.integrate`).
    """
    A, B = hover_linearisation(a)
    K, S = lqr(A, B, np.eye(12), np.eye(4))
    K_i = np.zeros((4, 3))
    if integral:
        A_i = np.zeros((15, 15))
        A_i[:12, :12], A_i[12:, :3] = A, np.eye(3)
        B_i = np.vstack([B, np.zeros((3, 4))])
        weights = np.diag([1.0] * 12 + [INTEGRAL_WEIGHT] * 3)
        full, _ = lqr(A_i, B_i, weights, np.eye(4))
        K, K_i = full[:, :12].copy(), full[:, 12:].copy()
        K[:, :3] -= LEAD * K_i
    return LinearGains(np.ascontiguousarray(K), K_i, S, hover_thrust(a), LEAD, INTEGRAL_LIMIT)
