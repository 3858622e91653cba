r"""The regression: model against sensors along the reconstructed path, and how sure its answer is.

Residuals are the accelerometer's, sample by sample, and the gyro's against the integral of the model's angular
acceleration over short spans, each from its own mean:

.. math::
    r_f = \tilde a - b_a - F(v - w, \omega, u; \theta) / m, \quad
    r_\omega = \tilde\omega - \int \dot\omega(v - w, \omega, u; \theta) \, dt - \mathrm{mean}

both white for the right model. A constant wind w, a delay of the inputs u and the accelerometer's bias b_a are found
beside the unknowns, all about what was assumed before. What is left is seldom white: the covariance is that of answers
without one block of two seconds after the other (the jackknife, each by one linear step), or the Cramer-Rao bound
where that is larger.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import stdtrit

from sitl import Airframe, Array
from sitl.lab.identification.flight_log import GRID_STEP, LEAD_TIME, Indices
from sitl.lab.identification.path_reconstruction import ReconstructedPath
from sitl.lab.identification.replay import accelerations, actuator_positions
from sitl.lab.identification.unknowns import Unknown, airframe_at

SPAN_TIME = 0.5  # over which angular acceleration is integrated [s]
BLOCK_TIME = 2.0  # of residuals, taken as independent of those of the next [s]
MIN_BLOCKS_FOR_PAIRS = 12  # fewer pairs than six tell little
ASSUMED_WIND = (5.0, 5.0, 0.5)  # assumed deviation, world NWU [m/s]
ASSUMED_DELAY = 0.01  # assumed deviation of the inputs' delay [s]
BIAS_FLOOR = 0.005  # added to the deviation of the accelerometer's bias [m/s2]
RESIDUAL_AXES = ("specific force x", "specific force y", "specific force z", "rate p", "rate q", "rate r")
FIRST_WEIGHTS = np.array([0.5, 0.5, 0.5, 0.05, 0.05, 0.05])  # deviations to begin with [m/s2], [rad/s]
WEIGHING_ROUNDS, DESCENT_STEPS = 3, 25  # of weighing, and of descent in each
SLOPE_SHARE = 1e-4  # difference that slopes are taken over, as a share of what was assumed
RATE_LIMITS, COARSE_STEP = frozenset({"omega_rate", "delta_rate"}), 0.03  # whose residuals have kinks everywhere
MAX_KEPT_COURSES = 8  # courses of the actuators
NORMAL_95, LEVEL = 1.96, 0.975  # deviations of a normal variable that hold 95 % of it; share below the upper one
WORTH_A_STEP = 0.05  # descent of the cost that is no longer worth a step


class Nuisance(NamedTuple):
    """Parameters found beside the unknowns."""

    wind: Array  # world NWU, (3,) [m/s]
    delay: float  # of the inputs [s]
    bias: Array  # of the accelerometer, (3,) [m/s2]


class Solution(NamedTuple):
    """The answer."""

    x: Array  # unknowns, then wind, delay and bias, (k,)
    covariance: Array  # (k, k)
    assumed: Array  # standard deviations before the flight, (k,)
    before: Array  # rms of the residuals at the set, (6,)
    after: Array  # (6,)
    residuals: tuple[Array, Array]  # at the set and at the answer, (n, 6) each
    gust: float = 0.0  # rms per axis, as far as it was looked for [m/s]


class FitProblem:
    """Residuals of all paths as a function of what is to be found.

    Args:
        paths: The flight.
        base: The set.
        unknowns: Of the set.
    """

    def __init__(self, paths: Sequence[ReconstructedPath], base: Airframe, unknowns: Sequence[Unknown]) -> None:
        self.paths, self._base, self.unknowns = paths, base, unknowns
        weights = np.array([path.bias_deviation**-2 for path in paths])
        self.bias = np.sum(weights * [path.accelerometer_bias for path in paths], axis=0) / weights.sum(axis=0)
        deviation = weights.sum(axis=0) ** -0.5 + BIAS_FLOOR
        self.assumed = np.array([*(u.deviation for u in unknowns), *ASSUMED_WIND, ASSUMED_DELAY, *deviation])
        fine = np.maximum(SLOPE_SHARE * self.assumed, 1e-6)
        limits = [j for j, u in enumerate(unknowns) if u.key in RATE_LIMITS]
        self.widths = np.where(np.isin(np.arange(len(fine)), limits), COARSE_STEP, fine)
        self.start = np.array([*np.zeros(len(unknowns) + 4), *self.bias])
        self._spans = [_parts(path, SPAN_TIME) for path in paths]
        blocks = [_parts(path, BLOCK_TIME) for path in paths]
        first = np.cumsum([0, *(block[-1] + 1 for block in blocks[:-1])])
        self.block = np.concatenate([block + begin for block, begin in zip(blocks, first, strict=True)])
        self._kept: dict[tuple[float, ...], list[Positions]] = {}  # of the actuators, as last asked for

    def airframe(self, x: Array) -> Airframe:
        """The airframe at an answer."""
        return airframe_at(self._base, self.unknowns, x.tolist())

    def nuisance(self, x: Array) -> Nuisance:
        """The rest of an answer."""
        rest = x[len(self.unknowns) :]
        return Nuisance(rest[:3], float(rest[3]), rest[4:7])

    def residuals(self, x: Array) -> Array:
        """Of every sample, (n, 6): specific force [m/s2], body rates [rad/s]."""
        a, rest = self.airframe(x), self.nuisance(x)
        each = zip(self.paths, self._spans, self.positions(a, rest.delay), strict=True)
        return np.concatenate([_of_path(path, span, positions, a, rest) for path, span, positions in each])

    def positions(self, a: Airframe, delay: float) -> list[Positions]:
        """Actuators of all paths, kept while neither their dynamics nor the delay change."""
        key = (delay, a.omega_rate, a.delta_rate, a.motor_tau, a.elevon_tau)
        if key not in self._kept:
            if len(self._kept) > MAX_KEPT_COURSES:
                self._kept.clear()
            self._kept[key] = [positions_along(path, a, delay) for path in self.paths]
        return self._kept[key]

    def slopes(self, x: Array) -> Array:
        """Of the residuals, (n, 6, k)."""
        here, columns = self.residuals(x), []
        for j, width in enumerate(self.widths):
            step = np.zeros_like(x)
            step[j] = width
            columns.append((self.residuals(x + step) - here) / step[j])
        return np.stack(columns, axis=2)


def _parts(path: ReconstructedPath, length: float) -> Indices:
    """The number of the part of a length [s] that each sample is in, (n,)."""
    time = path.stretch.time
    return np.asarray((time - time[0]) / length, np.int64)


class Positions(NamedTuple):
    """Actuators along a path."""

    at: Array  # the IMU's samples, (n, 4)
    between: Array  # two samples, their mean, (n - 1, 4)


def positions_along(path: ReconstructedPath, a: Airframe, delay: float) -> Positions:
    """Actuator positions that follow from the recorded commands, later by a delay [s]."""
    s = path.stretch
    before, mean = actuator_positions(s.commands, GRID_STEP, a)
    way = np.concatenate([np.zeros((1, 4)), np.cumsum(GRID_STEP * mean, axis=0)])
    grid = GRID_STEP * np.arange(len(way))
    time = np.clip(s.time - s.time[0] + LEAD_TIME - delay, 0.0, grid[-1])
    gone = np.maximum(np.diff(time), 1e-9)
    return Positions(
        at=np.stack([np.interp(time, grid[:-1], one) for one in before.T], axis=1),
        between=np.stack([np.diff(np.interp(time, grid, one)) / gone for one in way.T], axis=1),
    )


def _of_path(path: ReconstructedPath, span: Indices, positions: Positions, a: Airframe, rest: Nuisance) -> Array:
    v = np.einsum("ijk,ij->ik", path.rotation, path.velocity - rest.wind)
    w = path.rates
    force, _ = accelerations(v, w, positions.at, a)
    _, turning = accelerations(0.5 * (v[1:] + v[:-1]), 0.5 * (w[1:] + w[:-1]), positions.between, a)
    steps = np.diff(path.stretch.time)[:, None] * turning
    off = w - np.concatenate([np.zeros((1, 3)), np.cumsum(steps, axis=0)])
    count = np.bincount(span)
    for axis in range(3):
        off[:, axis] -= (np.bincount(span, off[:, axis]) / count)[span]
    return np.concatenate([path.stretch.accelerometer - rest.bias - force, off], axis=1)


def solved(problem: FitProblem) -> Solution:
    """The most likely answer and its covariance: least squares, weighed by what is left, three times."""
    x = problem.start
    first = problem.residuals(x)
    weights = FIRST_WEIGHTS
    for _ in range(WEIGHING_ROUNDS):
        x = _descended(problem, x, weights)
        last = problem.residuals(x)
        weights = rms(last)
    J = problem.slopes(x) / weights[None, :, None]
    return Solution(
        x=x,
        covariance=_covariance(problem, J, last / weights),
        assumed=problem.assumed,
        before=rms(first),
        after=rms(last),
        residuals=(first, last),
    )


def rms(residuals: Array) -> Array:
    """Root mean squares of columns."""
    return np.asarray(np.sqrt(np.mean(residuals**2, axis=0)))


def _descended(problem: FitProblem, x: Array, weights: Array) -> Array:
    """The minimum of the weighed squares and of the distance from what was assumed (Levenberg, Marquardt)."""

    def cost(r: Array, at: Array) -> float:
        return float(np.sum((r / weights) ** 2) + np.sum(((at - problem.start) / problem.assumed) ** 2))

    damping, residuals = 1e-4, problem.residuals(x)
    now = cost(residuals, x)
    for _ in range(DESCENT_STEPS):
        J = (problem.slopes(x) / weights[None, :, None]).reshape(-1, len(x))
        information = J.T @ J + np.diag(problem.assumed**-2.0)
        pull = J.T @ (residuals / weights).ravel() + (x - problem.start) / problem.assumed**2
        while damping < 1e8:
            step = -np.linalg.solve(information + damping * np.diag(np.diag(information)), pull)
            tried = problem.residuals(x + step)
            then = cost(tried, x + step)
            if then < now:
                break
            damping *= 5.0
        else:
            return x
        gain, x, residuals, now, damping = now - then, x + step, tried, then, 0.2 * damping
        if gain < WORTH_A_STEP:
            break
    return x


def _covariance(problem: FitProblem, J: Array, r: Array) -> Array:
    ends = np.flatnonzero(np.diff(problem.block)) + 1
    parts = []
    for part, left in zip(np.split(J, ends), np.split(r, ends), strict=True):
        slopes = part.reshape(-1, J.shape[2])
        parts.append((slopes.T @ slopes, slopes.T @ left.ravel()))
    return jackknife(parts, problem.assumed**-2.0)


def jackknife(parts: Sequence[tuple[Array, Array]], prior: Array) -> Array:
    r"""Covariance by leaving out one block after the other, or the Cramer-Rao bound where that is larger.

    What few blocks tell is less sure than their spread says: deviations are as much larger as Student's quantile is
    than the normal one, with the degrees of freedom of a sum of squares (Satterthwaite),

    .. math::
        \nu = 3 \left(\sum_b c_b^2\right)^2 \Big/ \sum_b c_b^4

    Errors that last longer than a block make the spread of blocks too small; so blocks of twice the length are left
    out as well, and each deviation is the larger one of the two.

    Args:
        parts: Information (k, k) and pull (k,) of each block.
        prior: Information of what was assumed, (k,).
    """
    information = sum((one for one, _ in parts), np.diag(prior))
    bound = np.linalg.inv(information)
    least = bound @ np.diag(prior) @ bound
    found, deviations = _left_out(parts, information, least)
    longer = _left_out(_pairs(parts), information, least)[1] if len(parts) >= MIN_BLOCKS_FOR_PAIRS else deviations
    scale = np.maximum.reduce([deviations, longer, np.sqrt(np.diag(bound))]) / np.sqrt(np.diag(found))
    return np.asarray(found * np.outer(scale, scale))


def _left_out(parts: Sequence[tuple[Array, Array]], information: Array, least: Array) -> tuple[Array, Array]:
    """Covariance by the spread of what leaving out each block changes, and deviations by Student's quantile."""
    changes = np.array([np.linalg.solve(information - own, pull) for own, pull in parts])
    found = changes.T @ changes * ((len(parts) - 1) / len(parts)) + least
    freedom = 3.0 * np.sum(changes**2, axis=0) ** 2 / np.sum(changes**4, axis=0)
    return found, np.sqrt(np.diag(found)) * np.maximum(stdtrit(freedom, LEVEL) / NORMAL_95, 1.0)


def _pairs(parts: Sequence[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Neighbouring blocks, two by two; an odd last one with the two before it."""
    starts = list(range(0, len(parts) - 1, 2))
    ends = [*starts[1:], len(parts)]
    return [
        (np.sum([one for one, _ in parts[i:j]], axis=0), np.sum([pull for _, pull in parts[i:j]], axis=0))
        for i, j in zip(starts, ends, strict=True)
    ]
