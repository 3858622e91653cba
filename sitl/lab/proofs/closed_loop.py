"""The closed loop about the hover as x' = (A - B K + M) x: the parts of M, and what a box of attitudes makes of them.

See :mod:`sitl.lab.proofs.region` for the coordinates (d1, e2, d3) of the attitude.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import Airframe, Array
from sitl.control.hover_linear import SQRT_HALF, LinearGains
from sitl.design import linearise
from sitl.model.aerodynamics import force_matrix, inertia, moment_matrix

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


# Loss of V's decrease by sampling, the period of delay and the actuators' way to their commands.
#
# Where no rate limit is met, an actuator has reached its command by the end of the period in which that is in force. So
# it lies, at any time, between two commands of the last ``DELAY`` seconds, and differs from what the law would ask for
# now by at most the integral of the command's rate over that time. With the error e_j of each channel, |e_j| <= f_j
# times the integral of |rate_j| over the last h_j, the functional
#
# .. math:: V + \sum_j r_j \int_{t-h_j}^t (s - t + h_j) \, \dot u_j(s)^2 ds
#
# has the derivative V' + sum_j r_j (h_j u_j'^2 - int u_j'^2), and by Cauchy and Schwarz the last integral is at least
# e_j^2 / (h_j f_j^2). V' and the rates are linear in the state and the errors, so what is left is a quadratic form; the
# errors are eliminated from it (Schur complement), and a matrix remains that is taken off that of V' alone.
#
# Channels: the thrusts; deflection times thrust, whose error is T times that of the deflection, plus the deflection
# times that of the thrust; and the integral, which grows by what was sampled up to a period ago.


SAMPLING = 0.002  # period of the control [s]: that of sitl.simulation.flight
DELAY = 3.0 * SAMPLING  # from the sample of a command to the end of the way to the next one
SHARE = 0.05  # of squares: (a + b)^2 <= (1 + SHARE) a^2 + (1 + 1 / SHARE) b^2
TURNED = 0.2  # of a channel's part in the functional, against the turn of its force
BALANCE = 0.7  # of the rates' rows: all eigenvalues are then of the size of V' / V
FACTORS = (0.25, 0.5, 0.8, 1.25, 2.0, 4.0)  # by which weights are tried to be better
ROUNDS = 12


class Channels(NamedTuple):
    """Errors of the input, one per channel, and the rates that they come of, one per row."""

    columns: Array  # (n, c), what an error does to the state's rate, upright
    force: Array  # (c,), force per error over the mass, which turns with the attitude [1/kg]
    rows: Array  # (k, n), rates by the state's rate
    row: npt.NDArray[np.int64]  # (c,), of each channel
    delays: Array  # (c,), h_j [s]
    factors: Array  # (c,), f_j
    also: Array | None = None  # (c, k), ones where a rate is a vector whose length counts, besides the channel's row


def channels(a: Airframe, gains: LinearGains, thrust_ratio: float, deflection: float, more: float) -> Channels:
    """The channels of a law.

    Args:
        a: The airframe.
        gains: The law.
        thrust_ratio: Of two thrusts DELAY apart, at most.
        deflection: The largest it asks for [rad].
        more: Effectiveness of the elevons in the stream of the own motion, at most.
    """
    n = size(gains)
    B = np.vstack([linearise.hover(a)[1], np.zeros((n - 12, 4))])
    columns, rows, row = [B, B[:, 2:]], [-feedback(gains)], [0, 1, 2, 3, 0, 1]
    thrust_ratio, crossed = more * thrust_ratio, more * (thrust_ratio + 1.0) * deflection
    delays, factors = [DELAY] * 6, [1.0, 1.0, thrust_ratio, thrust_ratio, crossed, crossed]
    if n > INTEGRAL_ROWS.start:
        grown, grows = np.zeros((n, 3)), np.zeros((3, n))
        grown[INTEGRAL_ROWS] = np.eye(3)
        grows[:, POSITION_ROWS], grows[:, VELOCITY_ROWS] = np.eye(3), gains.lead * np.eye(3)
        columns, rows, row = [*columns, grown], [*rows, grows], [*row, 4, 5, 6]
        delays, factors = delays + [SAMPLING] * 3, factors + [1.0] * 3
    C = np.hstack(columns)
    force = np.linalg.norm(C[VELOCITY_ROWS], axis=0)
    return Channels(C, force, np.vstack(rows), np.array(row), np.array(delays), np.array(factors))


class Lift(NamedTuple):
    """The matrix of V' and of the rates, by y = L' x, where V = |y|^2: lifted it is affine in the loop's matrix.

    It is positive where the functional falls. Without channels it is that of V' alone.
    """

    L: Array
    base: Array  # (n + k, n + k), of the linear loop
    rows: Array  # (k, n), by the state's rate, weighed

    def of(self, M: Array) -> Array:
        """Lift of M, which is subtracted from the base, (n + k, n + k)."""
        k, rates = len(self.rows), np.linalg.solve(self.L, (self.rows @ M).T)
        return np.block([[scaled(M, self.L), -rates], [-rates.T, np.zeros((k, k))]])


def plain_lift(F: Array, L: Array) -> Lift:
    """Of a linear loop F whose commands are in force at once."""
    return Lift(L, -scaled(F, L), np.zeros((0, len(L))))


def lift(F: Array, L: Array, at: Channels, turn: float, others: Sequence[Array] = ()) -> Lift | None:
    """Of a linear loop F with these channels, the weights being the best for F alone, or for F + M of others, too.

    Args:
        F: The linear loop.
        L: Of V.
        at: The channels.
        turn: Largest change of a unit vector by the attitudes of the set.
        others: Each M.

    Returns:
        The lift, or None where no weights prove anything even of F.
    """

    def left(weights: Array) -> float:
        made = _lift(F, L, at, turn, weights)
        if made is None:
            return -np.inf
        return min(float(np.linalg.eigvalsh(W)[0]) for W in (made.base, *(made.base - made.of(M) for M in others)))

    rates = np.linalg.norm(at.rows @ F @ np.linalg.inv(L).T, axis=1)[at.row]
    weights = at.factors * np.linalg.norm(L.T @ at.columns, axis=0) / np.maximum(rates, 1e-9)
    best = left(weights)
    for _ in range(ROUNDS):
        before = best
        for j in range(weights.size):
            for factor in FACTORS:
                tried = weights.copy()
                tried[j] *= factor
                if (value := left(tried)) > best:
                    weights, best = tried, value
        if best <= before:
            break
    return _lift(F, L, at, turn, weights)


def _lift(F: Array, L: Array, at: Channels, turn: float, weights: Array) -> Lift | None:
    held: Array = np.bincount(at.row, weights * at.delays, len(at.rows)).astype(np.float64)
    pull = (held if at.also is None else held + (weights * at.delays) @ at.also) * (1.0 + SHARE)
    root = BALANCE * np.sqrt(pull)
    turned = turn * at.force
    # The force of an error turns with the attitude: in V' and, less than SHARE, in the rates.
    tilted = np.linalg.norm(at.rows[:, VELOCITY_ROWS], axis=1)[:, None] * turned
    D = weights / (at.delays * at.factors**2)
    turns = turned @ (turned / (TURNED * D))
    D = (1.0 - TURNED) * D - turned.size / SHARE * (pull @ tilted**2)
    if D.min() <= 0.0:
        return None
    rates, direct = root[:, None] * (at.rows @ F @ np.linalg.inv(L).T), root[:, None] * (at.rows @ at.columns)
    drive, falling = L.T @ at.columns, L[VELOCITY_ROWS]
    W = -scaled(F, L) - turns * falling.T @ falling - (drive / D) @ drive.T
    corner = rates + (direct / D) @ drive.T
    own = BALANCE**2 * np.eye(len(root)) - (direct / D) @ direct.T
    return Lift(L, np.block([[W, corner.T], [corner, own]]), root[:, None] * at.rows)
