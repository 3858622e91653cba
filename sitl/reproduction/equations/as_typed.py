"""The report's equations as typed, slips included: its printed matrices were computed with them.

Nothing here flies; the corrected equations are those of :mod:`sitl.model` and :mod:`sitl.design`. x is
(p_z, v, eps, w, eta), (11,); u is (T1, T2, D1, D2), where the report uses D both as delta T and as delta.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitl import Airframe
from sitl.design import linearise
from sitl.model.airframe import Array
from sitl.model.hover_model import inertia, moment_matrix

PRINTED_SPEED = 5.0  # of the printed forward trim [m/s]
DYNAMIC_PRESSURE_SLIP = 1.15  # unexplained factor on every dynamic-pressure term of the printed forward trim


def cross_matrix(v: Array) -> Array:
    """[v]× of a vector."""
    return np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])


def typed_moment_matrix(a: Airframe) -> Array:
    """M_b of section 3.1.2 as typed: roll without S/(4 S_p) and with xi_m for xi_f; yaw by the motors alone."""
    M = moment_matrix(a)
    roll = a.a_y * a.C_l * a.xi_m
    M[0, 2:] = -roll, roll
    M[2] = -a.p_y, a.p_y, 0.0, 0.0
    return M


def typed_hover_linearisation(a: Airframe) -> tuple[Array, Array]:
    """A and B of section 3.1.2 as printed: unconstrained quaternion, typed roll term."""
    A, B = linearise.hover(a, constrained=False)
    B[9:12] = typed_moment_matrix(a) / inertia(a)[:, None]
    return A, B


def typed_forces(v_b: Array, w: Array, T: Array, D: Array, a: Airframe) -> tuple[Array, Array]:
    """Force and moment of section 2.2.2 with the unit slip: D is delta T in the slipstream and delta in the air."""
    h = 0.5 * DYNAMIC_PRESSURE_SLIP * a.rho * a.S * float(np.linalg.norm(v_b))
    X, both, differ = a.S_ratio, float(D[0] + D[1]), D[0] - D[1]
    coupling = a.Delta_r * a.C_l / a.c
    F = np.array(
        [
            (1.0 - X * a.C_d0) * T.sum() - h * a.C_d0 * v_b[0] + 0.5 * h * a.xi_f * a.C_d0 * v_b[2] * both,
            -h * coupling * a.b * w[2] - 0.5 * h * coupling * a.xi_f * both * a.b * w[0],
            -X * a.C_l * a.xi_f * both - h * a.C_l * v_b[2] - 0.5 * h * a.xi_f * a.C_l * v_b[0] * both,
        ]
    )
    # The arm [a_i] has the sign of the typed frame in the air and that of FLU in the slipstream.
    roll_slip = -a.a_y * a.C_l * a.xi_m + 0.5 * h * a.a_y * a.C_l * a.xi_f * v_b[0]
    M = np.array(
        [
            a.k_m / a.k_f * (T[0] - T[1]) + roll_slip * differ,
            -a.Delta_r * a.C_l * (a.xi_m * both * (X + 0.5 * h * v_b[0]) + h * v_b[2]),
            -a.p_y * (T[0] - T[1]) + 0.5 * h * a.a_y * a.C_d0 * a.xi_f * v_b[2] * differ,
        ]
    )
    return F, M + typed_damping(w, both, h, a)


def typed_damping(w: Array, both: float, h: float, a: Airframe) -> Array:
    """-rho S eta / 2 B Phi(m w) w, which lacks one factor B, and the elevons' term, which has both.

    The elevons couple roll into yaw: hence the +0.41 of the printed A, an unstable yaw rate.
    """
    Phi_mw = 0.5 * np.array([[a.C_lp, 0.0, a.C_lr], [0.0, a.C_mq, 0.0], [a.C_np, 0.0, a.C_nr]])
    B, Delta = np.diag([a.b, a.c, a.b]), a.xi_m * both * cross_matrix(np.array([0.0, 1.0, 0.0]))
    return h * B @ Phi_mw @ (0.5 * Delta @ B - np.eye(3)) @ w


def typed_derivative(x: Array, u: Array, a: Airframe) -> Array:
    """d/dt of (p_z, v, eps, w); the quaternion is unconstrained; Simulink's term with gain 1/2 keeps it unit."""
    v, eps, w = x[1:4], x[4:7], x[7:10]
    eta = x[10]
    R = np.eye(3) + 2.0 * eta * cross_matrix(eps) + 2.0 * cross_matrix(eps) @ cross_matrix(eps)
    F, M = typed_forces(R.T @ v, w, u[:2], u[2:], a)
    J = inertia(a)
    eps_dot = 0.5 * (eta * w + np.cross(eps, w)) + 0.5 * (1.0 - eta**2 - eps @ eps) * eps
    return np.concatenate(([v[2]], R @ F / a.m - [0.0, 0.0, a.g], eps_dot, (M - np.cross(w, J * w)) / J))


def typed_trim(a: Airframe) -> tuple[float, float, float]:
    """Angle theta [rad], thrust T per motor [N] and D of the printed 5 m/s point."""
    from scipy.optimize import fsolve  # noqa: PLC0415 - a second that only designs need

    def residual(z: Array) -> tuple[float, float, float]:
        x = trim_state(z[0])
        f = typed_derivative(x, np.array([z[1], z[1], z[2], z[2]]), a)
        return float(f[1]), float(f[3]), float(f[8])

    theta, thrust, product = fsolve(residual, [math.radians(60.0), 2.0, 0.9])
    return float(theta), float(thrust), float(product)


def forward_matrices(a: Airframe) -> tuple[Array, Array]:
    """A (10, 10) and B (10, 4) of section 4.1 as printed."""
    theta, thrust, product = typed_trim(a)
    x, u = trim_state(theta), np.array([thrust, thrust, product, product])
    return (
        jacobian(lambda x: typed_derivative(x, u, a), x, 10),
        jacobian(lambda u: typed_derivative(x, u, a), u, 4),
    )


def trim_state(theta: float) -> Array:
    """State of level flight north at PRINTED_SPEED, nose up by theta."""
    x = np.zeros(11)
    x[1], x[5], x[10] = PRINTED_SPEED, -math.sin(theta / 2.0), math.cos(theta / 2.0)
    return x


def jacobian(f: Callable[[Array], Array], x: Array, n: int) -> Array:
    """Central differences over the first n entries of x."""
    columns = []
    for k in range(n):
        step = np.zeros_like(x)
        step[k] = 1e-6
        columns.append((f(x + step) - f(x - step)) / 2e-6)
    return np.array(columns).T
