r"""Products, linear equations and the Riccati equation, to the same bit on every processor.

BLAS and LAPACK add in an order that depends on the processor, and some of them fuse multiplications with additions.
Here every number comes from additions, multiplications and divisions of whole arrays, entry by entry, in the order of
the loops below; IEEE 754 leaves no choice in any of them. Every function takes stacks of matrices, (..., n, m), so that
a schedule's fifty designs cost little more than one.
"""

from __future__ import annotations

import numpy as np

from sitl.errors import SitlError
from sitl.model.airframe import Array

MAX_DOUBLINGS = 40
SHIFTS = 10.0, 23.0, 4.0  # of the Cayley transform [1/s]; any but an eigenvalue of A serves poles from 0.2 to 300 rad/s
SETTLED = 1e-15  # relative change of S at which it is left alone
SOLVED = 1e-10  # residual of the Riccati equation that is still a solution, relative to its terms


def product(A: Array, B: Array) -> Array:
    """A B, (..., n, k) by (..., k, m)."""
    total = A[..., :, 0, None] * B[..., None, 0, :]
    for k in range(1, A.shape[-1]):
        total += A[..., :, k, None] * B[..., None, k, :]
    return np.asarray(total)


def transposed(A: Array) -> Array:
    """Each matrix transposed."""
    return np.asarray(np.swapaxes(A, -1, -2))


def symmetric(A: Array) -> Array:
    """Each matrix's symmetric part."""
    return np.asarray(0.5 * (A + transposed(A)))


def solve(A: Array, B: Array) -> Array:
    """A^-1 B by elimination with row pivoting, (..., n, n) by (..., n, m); infinities or NaN where A is singular."""
    n = A.shape[-1]
    shape = np.broadcast_shapes(A.shape[:-2], B.shape[:-2])
    both = np.concatenate((np.broadcast_to(A, (*shape, n, n)), np.broadcast_to(B, (*shape, n, B.shape[-1]))), axis=-1)
    rows = both.reshape(-1, n, both.shape[-1])
    stack = np.arange(len(rows))
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(n):
            pivot = k + np.abs(rows[:, k:, k]).argmax(axis=1)
            chosen = rows[stack, pivot]
            rows[stack, pivot] = rows[:, k]
            rows[:, k] = chosen / chosen[:, k, None]
            share = rows[:, :, k].copy()
            share[:, k] = 0.0
            rows[:, :, k:] -= share[:, :, None] * rows[:, None, k, k:]
    return np.asarray(both[..., n:])


def is_positive(A: Array) -> bool:
    """Whether every symmetric matrix of a stack is positive definite: all pivots of its elimination are."""
    rest = A.copy()
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for k in range(A.shape[-1] - 1):
            column = rest[..., k + 1 :, k]
            rest[..., k + 1 :, k + 1 :] -= column[..., :, None] * (column / rest[..., k, k, None])[..., None, :]
        return bool((np.diagonal(rest, axis1=-2, axis2=-1) > 0.0).all())


def riccati(A: Array, B: Array, Q: Array, R: Array) -> Array:
    r"""The stabilising S of A' S + S A - S B R^-1 B' S + Q = 0, by the structure-preserving doubling algorithm.

    A Cayley transform with a shift makes the Hamiltonian's left half plane the unit disc; each step then squares the
    closed loop, and with it the distance from the solution (Chu, Fan and Lin 2005).

    Args:
        A: State matrices, (..., n, n).
        B: Input matrices, (..., n, m).
        Q: Weights of the state, (n, n) or (..., n, n), positive semidefinite.
        R: Weights of the input, (m, m) or (..., m, m), positive definite.

    Raises:
        SitlError: If an equation has no stabilising solution, or none that double precision can tell.
    """
    by_R = symmetric(product(B, solve(R, transposed(B))))  # B R^-1 B'
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for shift in SHIFTS:
            S = _doubled(*_discrete(A, by_R, Q, shift))
            drift, cost = product(transposed(A), S), product(S, product(by_R, S))
            if (_size(drift + transposed(drift) - cost + Q) < SOLVED * (_size(drift) + _size(cost))).all():
                return S
    raise SitlError("no gain of least cost: the Riccati equation has no solution that double precision can tell")


def _doubled(E: Array, G: Array, S: Array) -> Array:
    """Limit of S under the doubling iteration."""
    n, one = E.shape[-1], np.eye(E.shape[-1])
    for _ in range(MAX_DOUBLINGS):
        by_GS = solve(one + product(G, S), np.concatenate((E, product(G, transposed(E))), axis=-1))
        step = symmetric(product(transposed(E), product(S, by_GS[..., :n])))
        E, G, S = product(E, by_GS[..., :n]), symmetric(G + product(E, by_GS[..., n:])), S + step
        if not (_size(step) > SETTLED * _size(S)).any():
            break
    return S


def _discrete(A: Array, G: Array, Q: Array, shift: float) -> tuple[Array, Array, Array]:
    """The Hamiltonian of (A, G, Q) through the Cayley transform: where the doubling starts."""
    n, one = A.shape[-1], np.eye(A.shape[-1])
    shifted = A - shift * one
    by_shifted = solve(shifted, np.concatenate((np.broadcast_to(one, A.shape), G), axis=-1))
    inverse, inverse_G = by_shifted[..., :n], by_shifted[..., n:]
    W = solve(transposed(shifted) + product(Q, inverse_G), one)
    return (
        one + 2.0 * shift * transposed(W),
        symmetric(2.0 * shift * product(inverse_G, W)),
        symmetric(2.0 * shift * product(W, product(Q, inverse))),
    )


def _size(M: Array) -> Array:
    """Largest entry of each matrix."""
    return np.asarray(np.abs(M).max(axis=(-2, -1), keepdims=True))
