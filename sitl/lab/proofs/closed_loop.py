"""The closed loop about the hover as x' = (A - B K + M) x: the parts of M, and what a box of attitudes makes of them.

See :mod:`sitl.lab.proofs.region` for the coordinates (d1, e2, d3) of the attitude.
"""

from __future__ import annotations

import math

import numpy as np

from sitl import Airframe, Array
from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.design import linearise
from sitl.model.hover_model import force_matrix, inertia, moment_matrix

ROOT = math.sqrt(2.0)
POSITION_ROWS, VELOCITY_ROWS, ATTITUDE_ROWS, RATE_ROWS = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
INTEGRAL_ROWS = slice(12, 15)


class Interval:
    """Intervals, one per box, (n,)."""

    def __init__(self, low: Array, high: Array) -> None:
        self.low, self.high = low, high

    def __add__(self, other: Interval | float) -> Interval:
        if isinstance(other, Interval):
            return Interval(self.low + other.low, self.high + other.high)
        return Interval(self.low + other, self.high + other)

    def __neg__(self) -> Interval:
        return Interval(-self.high, -self.low)

    def __sub__(self, other: Interval) -> Interval:
        return self + -other

    def __rsub__(self, other: float) -> Interval:
        return -self + other

    def __mul__(self, other: Interval | float) -> Interval:
        if isinstance(other, Interval):
            corners = np.stack([p * q for p in (self.low, self.high) for q in (other.low, other.high)])
        else:
            corners = np.stack([self.low * other, self.high * other])
        return Interval(corners.min(0), corners.max(0))

    __rmul__ = __mul__
    __radd__ = __add__

    def square(self) -> Interval:
        """Of each, never negative."""
        ends = np.stack([self.low**2, self.high**2])
        return Interval(np.where((self.low < 0.0) & (self.high > 0.0), 0.0, ends.min(0)), ends.max(0))

    def inverse(self) -> Interval:
        """Of positive intervals."""
        return Interval(1.0 / self.high, 1.0 / self.low)


Terms = list[tuple[Interval, Array]]


def most(value: Interval) -> Array:
    """The largest magnitude of each."""
    return np.asarray(np.maximum(np.abs(value.low), np.abs(value.high)))


class AttitudeBoxes:
    """Attitude terms of M, as intervals on boxes of f = (d1, e2, d3)."""

    def __init__(self, low: Array, high: Array) -> None:
        d1, e2, d3 = (Interval(low[:, i], high[:, i]) for i in range(3))
        twice = d1.square() + d3.square()
        eta2 = 2.0 - 2.0 * ((e2 + -SQRT_HALF).square() + twice)  # 2 eta^2
        self.upright = eta2.low > 0.0
        root = Interval(np.sqrt(np.maximum(eta2.low, 0.0)), np.sqrt(np.maximum(eta2.high, 0.0)))
        self.phi = (ROOT * e2 + root + 1.0).inverse()
        self.kappa = self.phi * (twice + 2.0 * e2.square())
        d0, d2 = -self.kappa + 1.0, ROOT * e2 - self.kappa
        self.d1, self.e2, self.d3, self.d2 = d1, e2, d3, d2
        # columns of R(delta) - I, less what is affine in f; kappa (1 + d2) = (d1^2 + d3^2 + 2 e2^2) / 2 exactly
        self.nose = (
            -2.0 * (d2.square() + d3.square()),
            2.0 * (d1 * d2 - self.kappa * d3),
            (d1 + d3).square() + 2.0 * e2.square(),
        )
        self.normal = (
            -((d1 - d3).square() + 2.0 * e2.square()),
            2.0 * (d2 * d3 + self.kappa * d1),
            -2.0 * (d1.square() + d2.square()),
        )
        turned = (
            (self.nose[0] + 1.0, self.nose[1] + 2.0 * d3, self.nose[2] - 2.0 * ROOT * e2),
            (2.0 * (d1 * d2 - d0 * d3), -2.0 * twice + 1.0, 2.0 * (d2 * d3 + d0 * d1)),
            (self.normal[0] + 2.0 * ROOT * e2, self.normal[1] - 2.0 * d1, self.normal[2] + 1.0),
        )
        # columns of R(q) = R(q_bar) R(delta): body axes in the world
        self.axes = tuple((-z, y, x) for x, y, z in turned)


def size(gains: LinearGains) -> int:
    """Entries of the state: x, and the integral of a law that has one."""
    return 15 if gains.K_i.any() else 12


def feedback(gains: LinearGains) -> Array:
    """Rows that give u_bar - u of the state, (4, n)."""
    return np.hstack([gains.K, gains.K_i])[:, : size(gains)]


def linear_loop(a: Airframe, gains: LinearGains) -> Array:
    """The closed loop linearised at the hover, (n, n)."""
    n = size(gains)
    A, B = linearise.hover(a)
    loop = extended(A, n)
    if n > A.shape[0]:
        loop[INTEGRAL_ROWS, POSITION_ROWS], loop[INTEGRAL_ROWS, VELOCITY_ROWS] = np.eye(3), gains.lead * np.eye(3)
    loop[: A.shape[0]] -= B @ feedback(gains)
    return loop


def lyapunov_matrix(gains: LinearGains) -> Array:
    """V as a quadratic form of the state, (n, n)."""
    whole = np.block([[gains.S, gains.S_xi], [gains.S_xi.T, gains.S_ii]])
    return np.asarray(whole[: size(gains), : size(gains)])


def scaled(M: Array, L: Array) -> Array:
    """P M + M' P in the coordinates y = L' x, P = L L'."""
    Z = L.T @ np.linalg.solve(L, M.T).T
    return np.asarray(Z + Z.T)


def extended(M: Array, n: int) -> Array:
    """M with zeros about it, (n, n)."""
    whole = np.zeros((n, n))
    whole[: M.shape[0], : M.shape[1]] = M
    return whole


def coordinates(n: int = 12) -> Array:
    """Rows that give d1, e2, d3 of the state, (3, n)."""
    T = np.zeros((3, n))
    T[:, ATTITUDE_ROWS] = [[SQRT_HALF, 0.0, SQRT_HALF], [0.0, 1.0, 0.0], [-SQRT_HALF, 0.0, SQRT_HALF]]
    return T


def row_matrix(row: int, values: Array) -> Array:
    """M with one row."""
    M = np.zeros((values.size, values.size))
    M[row] = values
    return M


def entry_matrix(row: int, column: int, n: int) -> Array:
    """M with a one in one place."""
    M = np.zeros((n, n))
    M[row, column] = 1.0
    return M


def turning(E: Array, n: int) -> Array:
    """The kinematics eps' = E w in M."""
    M = np.zeros((n, n))
    M[ATTITUDE_ROWS, RATE_ROWS] = E
    return M


def controlled(a: Airframe, gains: LinearGains) -> Array:
    """Rows of -F_b [K K_i] / m along the nose and the normal, (2, n)."""
    return np.asarray(-force_matrix(a)[[0, 2]] @ feedback(gains) / a.m)


def tilt_matrices(a: Airframe, gains: LinearGains) -> tuple[Array, Array, Array]:
    """The parts of M that are linear in d1, e2 and d3."""
    n = size(gains)
    (c1, ce, c3), g = coordinates(n), a.g
    tx, tz = controlled(a, gains)
    by_d1 = row_matrix(3, -g * (c1 + c3)) + row_matrix(4, ROOT * g * ce - 2.0 * tz)
    by_e2 = row_matrix(3, -2.0 * g * ce + 2.0 * ROOT * tx) + row_matrix(4, ROOT * g * c1)
    by_e2 += row_matrix(5, -4.0 * g * ce + 2.0 * ROOT * tz)
    by_d3 = row_matrix(3, -g * (c1 + c3)) + row_matrix(4, 2.0 * tx) + row_matrix(5, -2.0 * g * c3)
    by_d1 += turning(0.5 * SQRT_HALF * (_cross(0) + _cross(2)), n)
    by_e2 += turning(0.5 * (np.eye(3) + _cross(1)), n)
    by_d3 += turning(0.5 * SQRT_HALF * (_cross(2) - _cross(0)), n)
    return by_d1, by_e2, by_d3


def _cross(axis: int) -> Array:
    """The matrix of the cross product with a unit vector."""
    return np.asarray(np.cross(np.eye(3)[axis], np.eye(3)).T)


def gyro_matrices(a: Airframe, n: int) -> list[Array]:
    """The parts of M that are linear in each rate: -J^-1 (w x J w), each product shared between its two rates."""
    J = inertia(a)
    made = [np.zeros((n, n)) for _ in range(3)]
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        share = -0.5 * (J[k] - J[j]) / J[i]
        made[j][9 + i, 9 + k] = made[k][9 + i, 9 + j] = share
    return made


def elevon_effect(a: Airframe, gains: LinearGains, elevon: int) -> tuple[Array, Array]:
    """Effect of an elevon's feedback, left or right: M of its moment, (n, n), and its force along z_b / m, (n,)."""
    deflection: Array = -feedback(gains)[2 + elevon]
    M = np.zeros((size(gains), size(gains)))
    M[RATE_ROWS] = np.outer(moment_matrix(a)[:, 2 + elevon] / inertia(a), deflection)
    return M, np.asarray(force_matrix(a)[2, 2 + elevon] / a.m * deflection)
