r"""Least cost under linear matrix inequalities, by Newton's method along the central path.

Over X = S^-1 and Y = K X, minimise tr S such that at every corner

.. math:: M_c = -(A X - B_c Y) - (A X - B_c Y)' - 2 \alpha X - X X - \rho Y' Y \succ 0 .

For a growing weight t the minimum of t tr X^-1 - sum log det M_c is followed (Boyd and Vandenberghe, Convex
Optimization, chapter 11). It lies strictly inside the inequalities, and costs at most (rows of all M_c) / t more than
need be. The arithmetic is that of :mod:`sitl.design.matrices`; a logarithm, whose last bit depends on the machine, is
never taken: a step is judged by the slope where it ends.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.design.lqr import lqr
from sitl.design.matrices import is_positive, product, solve, symmetric, transposed
from sitl.errors import SitlError
from sitl.model.airframe import Array

GAP = 1e-8  # of the cost above the least, relative
GROWTH = 10.0  # of the weight t from one centre to the next
CENTRED = 1e-10  # square of Newton's decrement at a centre
NEAR = 0.01  # of the same: from here on each step squares it, or rounding keeps it
MAX_NEWTON_STEPS = 50  # of Newton's method to a centre
SHARES = tuple(1.0 / 2**k for k in range(20))  # of a Newton step


class Problem(NamedTuple):
    """The inequalities where all states are of like size, z = T x, by unknowns v: X = sum v_k X_k, Y = sum v_k Y_k."""

    cost: Array  # (n, n), of tr(cost X^-1)
    X: Array  # (k, n, n)
    W: Array  # (k, n + m, n), root of what states and inputs cost: of M_c it takes off W' W
    linear: Array  # (corners, k, n, n), what of M_c is linear


def least_cost(A: Array, corners: Array, decay: float, effort: float) -> tuple[Array, Array]:
    """K (m, n) and S (n, n) of least trace S.

    Args:
        A: State matrix, (n, n).
        corners: Input matrices, (corners, n, m), each the first with its columns amplified, or the first itself.
        decay: alpha [1/s], >= 0.
        effort: rho > 0.

    Raises:
        SitlError: If double precision does not suffice.
    """
    n, m = corners.shape[1:]
    K, S = lqr(A + decay * np.eye(n), corners[0], np.eye(n), effort * np.eye(m))
    T = np.sqrt(np.diagonal(S))
    problem = _problem(A, corners, decay, effort, T)
    # An LQR bears any amplification, so that the least effective corner's keeps every inequality.
    X = 0.5 * symmetric(solve(S / T / T[:, None], np.eye(n)))
    v = np.concatenate((X[np.triu_indices(n)], product(K / T, X).ravel()))
    weight, degree = corners.shape[0] * n / _cost(problem, v), corners.shape[0] * n
    while degree / weight > GAP * _cost(problem, v):
        weight *= GROWTH
        v = _centred(problem, v, weight)
    X, Y = _combined(problem.X, v), v[n * (n + 1) // 2 :].reshape(m, n)
    inverse = symmetric(solve(X, np.eye(n)))
    return product(Y, inverse) * T, inverse * T * T[:, None]


def _problem(A: Array, corners: Array, decay: float, effort: float, T: Array) -> Problem:
    n, m = corners.shape[1:]
    A, corners = A * T[:, None] / T, corners * T[:, None]
    rows, columns = np.triu_indices(n)
    k = rows.size
    X, Y = np.zeros((k + m * n, n, n)), np.zeros((k + m * n, m, n))
    X[np.arange(k), rows, columns] = X[np.arange(k), columns, rows] = 1.0
    Y[k:] = np.eye(m * n).reshape(-1, m, n)
    drift = product(A, X) - product(corners[:, None], Y)
    W = np.concatenate((X / T[:, None], np.sqrt(effort) * Y), axis=1)
    return Problem(np.diag(T * T), X, W, -drift - transposed(drift) - 2.0 * decay * X)


def _combined(basis: Array, v: Array) -> Array:
    """Sum of v_k times the k-th matrix of a basis (..., k, n, m), (..., n, m)."""
    flat = basis.reshape(*basis.shape[:-2], -1)
    return np.asarray(product(v[None], flat).reshape(*basis.shape[:-3], *basis.shape[-2:]))


def _overlaps(left: Array, right: Array) -> Array:
    """Sum of all products of entries of each matrix with each other's, (k, n, m) with (l, n, m) giving (k, l)."""
    return product(left.reshape(len(left), -1), transposed(right.reshape(len(right), -1)))


def _cost(problem: Problem, v: Array) -> float:
    inverse = solve(_combined(problem.X, v), np.eye(problem.cost.shape[0]))
    return float(_overlaps(problem.cost[None], inverse[None])[0, 0])


def _inequalities(problem: Problem, v: Array) -> tuple[Array, Array, Array]:
    """X, W and all M_c."""
    W = _combined(problem.W, v)
    return _combined(problem.X, v), W, _combined(problem.linear, v) - product(transposed(W), W)


def _slopes(problem: Problem, v: Array, weight: float) -> tuple[Array, Array]:
    """First and second derivatives of t tr(cost X^-1) - sum log det M_c by the unknowns, (k,) and (k, k)."""
    X, W, M = _inequalities(problem, v)
    one = np.eye(X.shape[-1])
    inverse, G = symmetric(solve(X, one)), symmetric(solve(M, one))
    pull = product(inverse, product(problem.cost, inverse))
    cross = product(transposed(W), problem.W)
    slope = problem.linear - cross - transposed(cross)  # dM_c / dv_k
    first = -weight * _overlaps(problem.X, pull[None])[:, 0]
    second = 2.0 * weight * _overlaps(product(inverse, problem.X), transposed(product(pull, problem.X)))
    for by, inside in zip(slope, G, strict=True):
        bent = product(inside, by)
        first = first - _overlaps(by, inside[None])[:, 0]
        second = second + _overlaps(bent, transposed(bent)) + 2.0 * _overlaps(problem.W, product(problem.W, inside))
    return first, second


def _centred(problem: Problem, v: Array, weight: float) -> Array:
    """The minimum for one weight, from a point within the inequalities."""
    (first, second), before = _slopes(problem, v, weight), NEAR
    for _ in range(MAX_NEWTON_STEPS):
        step = -solve(second, first[:, None])[:, 0]
        decrement = -_dot(first, step)
        if not decrement > CENTRED or (decrement >= before and before < NEAR):
            return v  # or as near to it as double precision tells
        before = decrement
        for share in SHARES:
            if _inside(problem, v + share * step):
                ahead, second = _slopes(problem, v + share * step, weight)
                if _dot(ahead, step) <= 0.5 * decrement:
                    break  # not far beyond the least along the step
        else:
            return v
        v, first = v + share * step, ahead
    raise SitlError("the linear matrix inequalities take more steps than double precision allows")


def _inside(problem: Problem, v: Array) -> bool:
    X, _, M = _inequalities(problem, v)
    return is_positive(X) and is_positive(M)


def _dot(a: Array, b: Array) -> float:
    return float(product(a[None], b[:, None])[0, 0])
