"""Linear models of the hover and of level flight (report, sections 3.1.2 and 4.1).

The quaternion lives on the unit sphere, so eta = sqrt(1 - |eps|^2) moves with eps. The report holds eta still,
which leaves -sqrt2 g in its dv_z/deps_2; ``constrained=False`` is that reading.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from sitl.design.trim import Trim
from sitl.kernels.hover_model import force_matrix, inertia, moment_matrix
from sitl.model.airframe import Airframe, Array
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, ANCHOR, SIZE, P, Q, V, W

ALOFT = 1000.0  # out of the ground's reach [m]
STEP = 1e-5  # of the central differences: their error is below 1e-8
FLOWN = slice(2, 12)  # what of (p, v, eps, w) the forward model keeps: p_z and the rest


def hover(a: Airframe, *, constrained: bool = True) -> tuple[Array, Array]:
    """Hover at heading 0 of the hover model, in closed form.

    Args:
        a: The airframe.
        constrained: Whether eta moves with eps.

    Returns:
        A (12, 12) and B (12, 4) of x = (p, v, eps - eps_bar, w) and u = (T1, T2, d1 T1, d2 T2).
    """
    r = math.sqrt(2.0)
    A = np.zeros((12, 12))
    A[0:3, 3:6] = np.eye(3)
    A[3, 7], A[4, 6], A[4, 8] = 2.0 * r * a.g, -r * a.g, r * a.g
    A[5, 7] = 0.0 if constrained else -r * a.g
    A[6:9, 9:12] = np.array([[1.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 1.0]]) / (2.0 * r)
    R = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])  # R(q_bar)
    B = np.zeros((12, 4))
    B[3:6] = R @ force_matrix(a) / a.m
    B[9:12] = moment_matrix(a) / inertia(a)[:, None]
    return A, B


def forward(a: Airframe, trim: Trim, *, constrained: bool = True) -> tuple[Array, Array]:
    """Level flight north of the full plant, by central differences.

    Args:
        a: The airframe.
        trim: Where to linearise.
        constrained: Whether eta moves with eps.

    Returns:
        A (10, 10) and B (10, 4) of x = (p_z, v, eps - eps_bar, w) and u = (T1, T2 [N], d1, d2 [rad]).
    """
    x, u = _trimmed(trim)

    def rate(dx: Array, du: Array) -> Array:
        return _rate(a, x, u + du, dx, constrained=constrained)

    still_x, still_u = np.zeros(12), np.zeros(4)
    A = _differences(lambda dx: rate(dx, still_u), 12)
    B = _differences(lambda du: rate(still_x, du), 4)
    return A[FLOWN, FLOWN], B[FLOWN]


def _trimmed(trim: Trim) -> tuple[Array, Array]:
    """Rigid state and (T1, T2, d1, d2) of a trim."""
    x = np.zeros(ACTUATOR)
    x[P + 2] = ALOFT
    x[V], x[V + 2] = trim.speed * math.cos(trim.climb), trim.speed * math.sin(trim.climb)
    x[Q], x[Q + 2] = math.cos(0.5 * trim.theta), -math.sin(0.5 * trim.theta)
    return x, np.array([trim.thrust, trim.thrust, trim.delta, trim.delta])


def _rate(a: Airframe, trimmed: Array, u: Array, deviation: Array, *, constrained: bool) -> Array:
    """Derivative of (p, v, eps, w) at a deviation of the same twelve from a state, (12,)."""
    x = np.empty(ANCHOR)
    x[P:Q] = trimmed[P:Q] + deviation[:6]
    eps = trimmed[Q + 1 : W] + deviation[6:9]
    x[Q] = math.sqrt(1.0 - float(eps @ eps)) if constrained else trimmed[Q]
    x[Q + 1 : W], x[W:ACTUATOR] = eps, trimmed[W:] + deviation[9:]
    x[ACTUATOR:] = *np.sqrt(u[:2] / a.k_f), *u[2:]
    dx = np.empty(ACTUATOR)
    derivative(x, np.full(SIZE, math.nan), np.zeros(3), a, dx)
    return np.concatenate((dx[P:Q], dx[Q + 1 :]))


def _differences(f: Callable[[Array], Array], size: int) -> Array:
    """Jacobian of f at zero, (., size)."""
    steps = STEP * np.eye(size)
    return np.stack([(f(step) - f(-step)) / (2.0 * STEP) for step in steps], axis=1)
