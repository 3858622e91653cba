"""LQR and LQI about the hover (report, sections 3.1.2 and 3.1.3)."""

from __future__ import annotations

import numpy as np

from sitl.control.allocation import Virtual
from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.design.matrices import product, riccati, solve, transposed
from sitl.design.rounding import rounded_matrix
from sitl.design.scaling import UNIT_SCALE, Scale, scale_of
from sitl.model.airframe import STALL, Airframe, Array

INTEGRAL_WEIGHT = 0.2  # of each integrated position in the LQI's cost
GENTLE_EFFORT, GENTLE_INTEGRAL_WEIGHT = 5.0, 1.0  # what the vehicle flies
ATTITUDE = slice(6, 9)  # of x
LEAD = 1.3  # [s]
INTEGRAL_LIMIT = 2.0  # [m]
REACH, BOUND = 6.0, 40.0  # of the position error [m], of the integral [m s]
# Of the point that is followed, at most: with an integral, which adds to it, none of our designs is then faster than
# the speed limit by more than 10 %, and none is slowed down on steps that it flies within the limit.
HEADWAY, STALL_HEADWAY = 1.4, 1.2  # [s]


def lqr(A: Array, B: Array, Q: Array, R: Array) -> tuple[Array, Array]:
    """Gain K and cost matrix S of the infinite-horizon LQR, u = -K x, V = x' S x; stacks of matrices give stacks.

    Raises:
        SitlError: If there is none: something unstable cannot be controlled, or is not seen by the cost.
    """
    S = riccati(A, B, Q, R)
    return solve(R, product(transposed(B), S)), S


def lqi(A: Array, B: Array, Q: Array, R: Array, weight: float) -> tuple[Array, Array]:
    """Gains K and K_i of the LQR whose state is continued by x_i, the integral of the first three entries of x.

    Args:
        A: State matrix, (n, n).
        B: Input matrix, (n, m).
        Q: Weights of x, (n, n).
        R: Weights of u, (m, m).
        weight: Weight of each entry of x_i.

    Returns:
        K (m, n) and K_i (m, 3) of u = -K x - K_i x_i.
    """
    n, m = B.shape
    A_i = np.zeros((n + 3, n + 3))
    A_i[:n, :n], A_i[n:, :3] = A, np.eye(3)
    Q_i = weight * np.eye(n + 3)
    Q_i[:n, :n] = Q
    K, _ = lqr(A_i, np.vstack([B, np.zeros((3, m))]), Q_i, R)
    return np.ascontiguousarray(K[:, :n]), np.ascontiguousarray(K[:, n:])


def hover_thrust(a: Airframe) -> Virtual:
    """Virtual commands of the hover, u_bar = m g / (2 (1 - S_ratio C_d0)) (1, 1, 0, 0)."""
    T = 0.5 * a.m * a.g / (1.0 - a.S_ratio * a.C_d0)
    return Virtual(T, T, 0.0, 0.0)


def hover_gains(
    a: Airframe,
    *,
    integral: bool = True,
    effort: float = 1.0,
    integral_weight: float = INTEGRAL_WEIGHT,
    attitude_weight: float = 1.0,
) -> LinearGains:
    """Gains of the linear hover law with Q = I and, as in the report, R = I by default; V is always the LQR's.

    A vehicle of another size has the weights by their units, so that V is as large of a like deviation.

    With ``integral``, K is the LQI's less what the lead of the integral gives back (see
    :func:`sitl.control.hover_linear.integrate`).

    Args:
        a: The airframe.
        integral: Whether to design the LQI instead of the LQR.
        effort: Weight rho of R = rho I.
        integral_weight: Of each integrated position in the LQI's cost.
        attitude_weight: Of each entry of eps - eps_bar.
    """
    A, B = linearise.hover(a)
    size = scale_of(a)
    Q, R = _weights(size), effort * np.eye(4) / (size.mass * size.mass)
    Q[ATTITUDE, ATTITUDE] *= attitude_weight
    K, S = lqr(A, B, Q, R)
    K_i = np.zeros((4, 3))
    if integral:
        K, K_i = lqi(A, B, Q, R, integral_weight / (size.length * size.time) ** 2)
        K[:, :3] -= LEAD * size.time * K_i
    return law(a, K, K_i, S / size.time, size)


def _weights(size: Scale) -> Array:
    """Q = I of the deviation in the units of a vehicle's size, (12, 12)."""
    per_unit = np.repeat((1.0 / size.length, size.time / size.length, 1.0, size.time), 3)
    return np.diag(per_unit * per_unit)


def gentle_hover_gains(a: Airframe, *, integral: bool = True) -> LinearGains:
    """The same with R = 5 I, which settles sooner and loses fewer flights."""
    return hover_gains(a, integral=integral, effort=GENTLE_EFFORT, integral_weight=GENTLE_INTEGRAL_WEIGHT)


def law(a: Airframe, K: Array, K_i: Array, S: Array, size: Scale = UNIT_SCALE) -> LinearGains:
    """The law that flies with these gains, rounded, and the limits of a vehicle's size."""
    gains = LinearGains(
        K=rounded_matrix(K),
        K_i=rounded_matrix(K_i),
        S=rounded_matrix(S),
        u_bar=hover_thrust(a),
        lead=LEAD * size.time,
        integral_limit=INTEGRAL_LIMIT * size.length,
        reach=REACH * size.length,
        bound=BOUND * size.length * size.time,
    )
    most = size.time * (STALL_HEADWAY if a.aerodynamics == STALL else HEADWAY)
    along, aside = (float(gap) for gap in rounded_matrix(np.minimum(headways(a, gains.K), most)))
    return gains._replace(headway=along, headway_aside=aside)


def headways(a: Airframe, K: Array) -> Array:
    """Position errors that a gain turns into one m/s, along the belly's heading and across it, (2,) [s]."""
    A, B = linearise.hover(a)
    moving = slice(3, 12)  # of x: all but the position
    loop = A[moving, moving] - product(B[moving], K[:, moving])
    speeds = solve(loop, product(B[moving], K[:, :2]))
    return -1.0 / np.array((speeds[0, 0], speeds[1, 1]))
