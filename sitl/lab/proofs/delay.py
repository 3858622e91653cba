r"""Loss of V's decrease by sampling, the period of delay and the actuators' way to their commands.

Where no rate limit is met, an actuator has reached its command by the end of the period in which that is in force. So
it lies, at any time, between two commands of the last ``DELAY`` seconds, and differs from what the law would ask for
now by at most the integral of the command's rate over that time. With the error e_j of each channel, |e_j| <= f_j
times the integral of |rate_j| over the last h_j, the functional

.. math:: V + \sum_j r_j \int_{t-h_j}^t (s - t + h_j) \, \dot u_j(s)^2 ds

has the derivative V' + sum_j r_j (h_j u_j'^2 - int u_j'^2), and by Cauchy and Schwarz the last integral is at least
e_j^2 / (h_j f_j^2). V' and the rates are linear in the state and the errors, so what is left is a quadratic form; the
errors are eliminated from it (Schur complement), and a matrix remains that is taken off that of V' alone.

Channels: the thrusts; deflection times thrust, whose error is T times that of the deflection, plus the deflection
times that of the thrust; and the integral, which grows by what was sampled up to a period ago.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sitl import Airframe, Array
from sitl.control.hover_linear import LinearGains
from sitl.design import linearise
from sitl.lab.proofs.closed_loop import INTEGRAL_ROWS, POSITION_ROWS, VELOCITY_ROWS, feedback, scaled, size

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
