r"""Output error by multiple shooting: the plant flies recorded inputs in short shots, and its states meet the sensors.

The regression takes the reconstructed velocity for true, and what is wrong with it weakens the slopes of what depends
on it, the pitching moment above all. Here velocity and attitude are the model's own, from the beginning of each shot,
which is free but for what the reconstruction says of it; so is the gust of each shot, but for how large gusts are.
Residuals are those of all sensors, each over its deviation; beginnings and gusts are eliminated shot by shot,

.. math::
    S = \sum_s G_s^T G_s - G_s^T L_s (L_s^T L_s)^{-1} L_s^T G_s

with the slopes G_s by what is sought and L_s by the rest. The covariance is the regression's, of these sums.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from sitl import Array
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import Indices
from sitl.lab.identification.path_reconstruction import ReconstructedPath
from sitl.lab.identification.regression import BLOCK_TIME, FitProblem, Solution, jackknife, rms
from sitl.lab.identification.replay import accelerations, courses

SHOT_TIME = 1.0  # [s]
BEGINNING = np.repeat([0.03, 0.02, 0.001, 0.01], 3)  # deviation of position, velocity, attitude and rates there
BEGINNING_STEPS = np.repeat([1e-3, 1e-3, 1e-4, 1e-4, 1e-3], 3)  # differences that slopes are taken over
FREE = len(BEGINNING_STEPS)  # values of a shot: its beginning and its gust
CALM, WILD = 0.02, 1.0  # least and greatest deviation of a shot's gust [m/s]
WEIGHINGS, ITERATIONS = 4, 8  # of the sensors by what is left, and of descent in each
MORE = 1.2  # times the gusts found
EXPLAINED = 1.3  # times a sensor's own deviation that may be left
MIN_COST_DESCENT = 0.5  # descent of the cost that is no longer worth a step
SHOTS_PER_BLOCK = round(BLOCK_TIME / SHOT_TIME)


class _Run(NamedTuple):
    """One path in shots."""

    path: ReconstructedPath
    begins: Indices  # first sample of each shot, (k,)
    states: Array  # reconstructed, at the beginnings, (k, 13)
    dt: Array  # to the next sample, (n,)
    deviations: Array  # of gyro, accelerometer, attitude, velocity and position, (5,)
    gust: float  # deviation of a shot's wind from the mean one, per axis [m/s]
    shot: Indices  # of every sample, (n,)
    rows: Indices  # the shot of every residual, (m,)


class _Answer(NamedTuple):
    """The solution: unknowns, and all shots' beginnings, as differences from the reconstructed ones, and gusts."""

    x: Array  # (k,)
    beginnings: list[Array]  # position, velocity, attitude, rates and wind, (j, FREE) each


class _Shot(NamedTuple):
    """Normal equations of one shot, its beginning eliminated."""

    information: Array  # (k, k)
    pull: Array  # (k,)
    back: Array  # from a step of what is sought to one of the beginning, (FREE, k)
    own: Array  # step of the beginning without any other, (FREE,)


def refined(problem: FitProblem, rough: Solution) -> Solution:
    """A better answer and its covariance, from that of the regression; the same where its shots do not stay finite."""
    runs = [_run(path) for path in problem.paths]
    answer = _Answer(rough.x, [np.zeros((len(run.begins), FREE)) for run in runs])
    if not all(np.isfinite(part).all() for part in _residuals(problem, runs, answer)):
        return rough
    for _ in range(WEIGHINGS):
        answer = _descended(problem, runs, answer)
        left = _residuals(problem, runs, answer)
        factors = [np.sqrt(np.mean(np.concatenate(parts) ** 2)) for parts in _by_sensor(runs, left)]
        gust = _gust(answer)
        if max(factors) < EXPLAINED and gust < EXPLAINED * runs[0].gust:
            break
        runs = [
            run._replace(deviations=run.deviations * np.maximum(factors, 1.0), gust=max(gust, run.gust)) for run in runs
        ]
    shots = _shots(problem, runs, answer, _residuals(problem, runs, answer))
    blocks = [shots[i : i + SHOTS_PER_BLOCK] for i in range(0, len(shots), SHOTS_PER_BLOCK)]
    parts = [(_sum(shot.information for shot in block), _sum(shot.pull for shot in block)) for block in blocks]
    after = problem.residuals(answer.x)
    return rough._replace(
        x=answer.x,
        gust=_gust(answer),
        covariance=jackknife(parts, problem.assumed**-2.0),
        after=rms(after),
        residuals=(rough.residuals[0], after),
    )


def _gust(answer: _Answer) -> float:
    """Deviation of the shots' gusts, a little more than those found, which are drawn to zero [m/s]."""
    found = np.concatenate(answer.beginnings)[:, 12:]
    return float(np.clip(MORE * np.sqrt(np.mean(found**2)), CALM, WILD))


def _descended(problem: FitProblem, runs: Sequence[_Run], answer: _Answer) -> _Answer:
    """The minimum of the squares, by Levenberg's and Marquardt's steps."""
    prior, damping = problem.assumed**-2.0, 1e-3
    residuals = _residuals(problem, runs, answer)
    shots = _shots(problem, runs, answer, residuals)
    for _ in range(ITERATIONS):
        information = _sum(shot.information for shot in shots) + np.diag(prior)
        pull = _sum(shot.pull for shot in shots) + prior * (answer.x - problem.start)
        step = -np.linalg.solve(information + damping * np.diag(np.diag(information)), pull)
        moved = _Answer(answer.x + step, _moved_beginnings(shots, answer.beginnings, step))
        tried = _residuals(problem, runs, moved)
        gain = _cost(problem, residuals, answer.x) - _cost(problem, tried, moved.x)
        if not gain > 0.0:  # nor if it is no number
            damping *= 30.0
            if damping > 1e3:
                break
            continue
        answer, residuals, damping = moved, tried, 0.1 * damping
        if gain < MIN_COST_DESCENT:
            break
        shots = _shots(problem, runs, answer, residuals)
    return answer


def _run(path: ReconstructedPath) -> _Run:
    s = path.stretch
    time = s.time - s.time[0]
    count = max(1, round(s.seconds / SHOT_TIME))
    shot = np.minimum((time * (count / time[-1])).astype(np.int64), count - 1)
    begins = np.searchsorted(shot, np.arange(count))
    states = np.concatenate([path.position, path.velocity, path.attitude, path.rates], axis=1)[begins]
    dt = np.append(np.diff(time), 0.0)
    rows = np.concatenate([shot, shot, shot[s.attitude_at], shot[s.motion_at], shot[s.motion_at], np.arange(count)])
    noise = path.deviations
    deviations = np.array([noise.gyro, noise.accelerometer, noise.attitude, noise.velocity, noise.position])
    return _Run(path, begins, states, dt, deviations, CALM, shot, rows)


def _residuals(problem: FitProblem, runs: Sequence[_Run], answer: _Answer) -> list[Array]:
    """Of every path, over the sensors' deviations, in threes but the last, which are of beginnings: rows of _Run."""
    a, rest = problem.airframe(answer.x), problem.nuisance(answer.x)
    found = []
    for run, start, positions in zip(runs, answer.beginnings, problem.positions(a, rest.delay), strict=True):
        path, s = run.path, run.path.stretch
        states = run.states.copy()
        states[:, :6] += start[:, :6]
        states[:, 6:10] = rotations.product(rotations.of_vector(start[:, 6:9]), states[:, 6:10])
        states[:, 10:] += start[:, 9:12]
        between = np.concatenate([positions.between, positions.between[-1:]])
        winds = rest.wind + start[:, 12:]
        course = courses(states, run.begins, run.dt, between, winds, a)
        q = course[:, 6:10]
        v = np.einsum("ijk,ij->ik", rotations.matrices(q), course[:, 3:6] - winds[run.shot])
        force, _ = accelerations(v, np.ascontiguousarray(course[:, 10:]), positions.at, a)
        turned = rotations.product(s.attitude, rotations.inverse(q[s.attitude_at]))
        parts = (
            path.rates - course[:, 10:],
            s.accelerometer - rest.bias - force,
            rotations.vector_of(turned),
            s.velocity - course[s.motion_at, 3:6],
            s.position - course[s.motion_at, :3],
        )
        weighed = [(part / one).ravel() for part, one in zip(parts, run.deviations, strict=True)]
        found.append(np.concatenate([*weighed, (start / np.append(BEGINNING, np.full(3, run.gust))).ravel()]))
    return found


def _by_sensor(runs: Sequence[_Run], residuals: Sequence[Array]) -> list[list[Array]]:
    """Residuals of each of the five sensors, of all paths."""
    found: list[list[Array]] = [[] for _ in range(5)]
    for run, r in zip(runs, residuals, strict=True):
        s = run.path.stretch
        counts = (len(s.time), len(s.time), len(s.attitude_at), len(s.motion_at), len(s.motion_at))
        for kept, part in zip(found, np.split(r, 3 * np.cumsum(counts)), strict=False):
            kept.append(part)
    return found


def _cost(problem: FitProblem, residuals: Sequence[Array], x: Array) -> float:
    squares = sum(float(part @ part) for part in residuals)
    return squares + float(np.sum(((x - problem.start) / problem.assumed) ** 2))


def _shots(problem: FitProblem, runs: Sequence[_Run], answer: _Answer, here: Sequence[Array]) -> list[_Shot]:
    """Normal equations of every shot."""
    by_unknown = []
    for j, width in enumerate(problem.widths):
        step = np.zeros_like(answer.x)
        step[j] = width
        there = _residuals(problem, runs, answer._replace(x=answer.x + step))
        by_unknown.append([(after - before) / width for after, before in zip(there, here, strict=True)])
    by_beginning = []
    for j, width in enumerate(BEGINNING_STEPS):
        offset = width * (np.arange(FREE) == j)
        begun = [start + offset for start in answer.beginnings]
        there = _residuals(problem, runs, answer._replace(beginnings=begun))
        by_beginning.append([(after - before) / width for after, before in zip(there, here, strict=True)])
    found = []
    for number, run in enumerate(runs):
        G = np.stack([column[number] for column in by_unknown], axis=1)
        L = np.stack([column[number] for column in by_beginning], axis=1)
        width = np.where(np.arange(len(run.rows)) < len(run.rows) - len(run.begins), 3, FREE)
        owner = np.repeat(run.rows, width)
        order = np.argsort(owner, kind="stable")
        cuts = np.flatnonzero(np.diff(owner[order])) + 1
        found += [_shot(G[part], L[part], here[number][part]) for part in np.split(order, cuts)]
    return found


def _sum(arrays: Iterable[Array]) -> Array:
    """Sum of arrays of one shape."""
    return np.asarray(np.sum(list(arrays), axis=0))


def _shot(G: Array, L: Array, r: Array) -> _Shot:
    inner, across = L.T @ L, L.T @ G
    back, own = np.asarray(np.linalg.solve(inner, across)), np.asarray(np.linalg.solve(inner, L.T @ r))
    return _Shot(G.T @ G - across.T @ back, G.T @ r - across.T @ own, -back, -own)


def _moved_beginnings(shots: Sequence[_Shot], beginnings: Sequence[Array], step: Array) -> list[Array]:
    steps = np.array([shot.own + shot.back @ step for shot in shots])
    ends = np.cumsum([len(start) for start in beginnings])[:-1]
    return [start + part for start, part in zip(beginnings, np.split(steps, ends), strict=True)]
