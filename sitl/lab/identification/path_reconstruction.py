r"""Flight path reconstruction: what the sensors say together of attitude and velocity, without any model of forces.

Gyro and accelerometer say how attitude and velocity change from sample to sample, the measured attitudes and motion
where they are; the sensors' constant biases are found with them. About the measured attitudes the errors
:math:`\theta` are small, and in the world frame each axis is a chain of its own,

.. math::
    \theta_{i+1} - \theta_i = m_i - R_i b \, \Delta t, \qquad \theta_k = z_k

so that least squares has banded normal equations; likewise velocity and position. Biases come last, by the Schur
complement.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import solveh_banded

from sitl import Array
from sitl.lab.identification import rotations
from sitl.lab.identification.flight_log import FlightStretch, Indices

GYRO_BIAS, ACCELEROMETER_BIAS = 0.05, 0.5  # assumed standard deviations [rad/s], [m/s2]
TURNS = 3  # of linearisation, and of weighing the measurements by what they miss
KINEMATIC_ERROR = 1e-5  # of a position's change over one sample [m]


class SensorDeviations(NamedTuple):
    """Standard deviations of one sample."""

    gyro: float  # [rad/s]
    accelerometer: float  # [m/s2]
    attitude: float  # [rad]
    position: float  # [m]
    velocity: float  # [m/s]


ASSUMED = SensorDeviations(gyro=0.005, accelerometer=0.3, attitude=0.01, position=0.05, velocity=0.1)
MIN_DEVIATIONS = SensorDeviations(gyro=0.002, accelerometer=0.05, attitude=5e-4, position=0.005, velocity=0.005)


@dataclass(frozen=True)
class ReconstructedPath:
    """A stretch as it was flown, one row per IMU sample."""

    stretch: FlightStretch
    attitude: Array  # (n, 4)
    rotation: Array  # body to world, (n, 3, 3)
    velocity: Array  # world NWU, (n, 3) [m/s]
    position: Array  # world NWU, (n, 3) [m]
    rates: Array  # of the gyro without its bias, (n, 3) [rad/s]
    gyro_bias: Array  # (3,) [rad/s]
    accelerometer_bias: Array  # (3,) [m/s2]
    bias_deviation: Array  # of the accelerometer's, (3,) [m/s2]
    deviations: SensorDeviations  # of the measurements, by what is left of them


def reconstructed(stretch: FlightStretch, g: float) -> ReconstructedPath:
    """The path of a stretch.

    Args:
        stretch: What was measured.
        g: Gravity [m/s2].
    """
    noise = ASSUMED._replace(gyro=_noise(stretch.gyro, MIN_DEVIATIONS.gyro))
    noise = noise._replace(accelerometer=_noise(stretch.accelerometer, MIN_DEVIATIONS.accelerometer))
    q, bias = rotations.interpolated(stretch.time, stretch.time[stretch.attitude_at], stretch.attitude), np.zeros(3)
    for _ in range(TURNS):
        q, bias, missed = _attitude(stretch, q, bias, noise)
        noise = noise._replace(attitude=max(missed, MIN_DEVIATIONS.attitude))
    R = rotations.matrices(q)
    motion = _motion(stretch, R, g, noise)
    for _ in range(TURNS - 1):
        noise = noise._replace(
            position=max(motion.missed[0], MIN_DEVIATIONS.position),
            velocity=max(motion.missed[1], MIN_DEVIATIONS.velocity),
        )
        motion = _motion(stretch, R, g, noise)
    return ReconstructedPath(
        stretch=stretch,
        attitude=q,
        rotation=R,
        velocity=motion.velocity,
        position=motion.position,
        rates=stretch.gyro - bias,
        gyro_bias=bias,
        accelerometer_bias=motion.bias,
        bias_deviation=motion.bias_deviation,
        deviations=noise,
    )


def _noise(samples: Array, least: float) -> float:
    """White noise of a sensor by its third differences, which leave nothing of what is smooth."""
    third = np.diff(samples, n=3, axis=0)
    return max(float(np.median(np.abs(third))) / (0.6745 * math.sqrt(20.0)), least)


class _Chain(NamedTuple):
    """Banded normal equations of a chain, and its residuals as a function of states and right-hand sides."""

    bands: Array  # upper form
    rhs: Callable[[Array, Array], Array]  # of changes (n - 1, 3) and measurements, for three axes
    residuals: Callable[[Array, Array, Array], Array]  # of states besides, weighted


def _with_bias(
    chain: _Chain, changes: Array, turned: Array, measured: Array, prior: float, expected: Array
) -> tuple[Array, Array, Array]:
    """States (k, 3), bias (3,) and its covariance, where changes are ``changes - turned @ bias``.

    Args:
        chain: The chain.
        changes: Of every step, by world axis, (n - 1, 3).
        turned: How a bias acts on them, (n - 1, 3, 3).
        measured: Measurements, (j, 3).
        prior: Deviation of the bias assumed.
        expected: Bias at which the changes were made, counted from zero, (3,).
    """
    none = np.zeros_like(measured)
    columns = [chain.rhs(changes, measured)] + [chain.rhs(-turned[:, :, j], none) for j in range(3)]
    solved = solveh_banded(chain.bands, np.concatenate(columns, axis=1)).reshape(-1, 4, 3)
    missed = chain.residuals(solved[:, 0], changes, measured)
    slopes = np.stack([chain.residuals(solved[:, 1 + j], -turned[:, :, j], none) for j in range(3)], axis=1)
    information = slopes.T @ slopes + np.eye(3) / prior**2
    bias = np.linalg.solve(information, -slopes.T @ missed - expected / prior**2)
    states = solved[:, 0] + np.einsum("ijk,j->ik", solved[:, 1:], bias)
    return states, np.asarray(bias), np.asarray(np.linalg.inv(information))


def _attitude(s: FlightStretch, q: Array, bias: Array, noise: SensorDeviations) -> tuple[Array, Array, float]:
    """Better attitudes, a better gyro bias, and how far off the measured attitudes are, rms [rad]."""
    dt = np.diff(s.time)
    turned = rotations.of_vector((0.5 * (s.gyro[1:] + s.gyro[:-1]) - bias) * dt[:, None])
    changes = rotations.vector_of(rotations.product(rotations.product(q[:-1], turned), rotations.inverse(q[1:])))
    measured = rotations.vector_of(rotations.product(s.attitude, rotations.inverse(q[s.attitude_at])))
    chain = _walk(1.0 / (noise.gyro * dt), s.attitude_at, 1.0 / noise.attitude)
    by_bias = rotations.matrices(q[:-1]) * dt[:, None, None]
    theta, change, _ = _with_bias(chain, changes, by_bias, measured, GYRO_BIAS, bias)
    off = measured - theta[s.attitude_at]
    return rotations.unit(rotations.product(rotations.of_vector(theta), q)), bias + change, float(off.std())


def _walk(steady: Array, at: Indices, known: float) -> _Chain:
    """States x whose changes are known to 1 / steady (n - 1,), and which are measured at some samples to 1 / known."""
    weight = steady**2
    bands = np.zeros((2, len(steady) + 1))
    bands[1, :-1] += weight
    bands[1, 1:] += weight
    bands[0, 1:] = -weight
    np.add.at(bands[1], at, known**2)

    def rhs(changes: Array, measured: Array) -> Array:
        pull = np.zeros((len(steady) + 1, 3))
        pull[:-1] -= weight[:, None] * changes
        pull[1:] += weight[:, None] * changes
        np.add.at(pull, at, known**2 * measured)
        return pull

    def residuals(x: Array, changes: Array, measured: Array) -> Array:
        steps = steady[:, None] * (np.diff(x, axis=0) - changes)
        return np.concatenate([steps.ravel(), (known * (x[at] - measured)).ravel()])

    return _Chain(bands, rhs, residuals)


class _Motion(NamedTuple):
    velocity: Array
    position: Array
    bias: Array
    bias_deviation: Array
    missed: tuple[float, float]  # rms of the measured positions [m] and velocities [m/s]


def _motion(s: FlightStretch, R: Array, g: float, noise: SensorDeviations) -> _Motion:
    dt = np.diff(s.time)
    world = np.einsum("ijk,ik->ij", R, s.accelerometer) - np.array([0.0, 0.0, g])
    changes = 0.5 * (world[1:] + world[:-1]) * dt[:, None]
    by_bias = 0.5 * (R[1:] + R[:-1]) * dt[:, None, None]
    chain = _integrator(dt, 1.0 / (noise.accelerometer * dt), s, noise)
    measured = np.concatenate([s.velocity, s.position])
    x, bias, covariance = _with_bias(chain, changes, by_bias, measured, ACCELEROMETER_BIAS, np.zeros(3))
    velocity, position = x[0::2], x[1::2]
    missed = (float((position[s.motion_at] - s.position).std()), float((velocity[s.motion_at] - s.velocity).std()))
    return _Motion(velocity, position, bias, np.sqrt(np.diag(covariance)), missed)


def _integrator(dt: Array, steady: Array, s: FlightStretch, noise: SensorDeviations) -> _Chain:
    """States velocity and position in turn: changes of velocity known, positions its integral, both measured."""
    n = len(dt) + 1
    weight, half, at = steady**2, 0.5 * dt, s.motion_at
    tight = 1.0 / (KINEMATIC_ERROR + noise.accelerometer * dt**2) ** 2
    known_v, known_p = 1.0 / noise.velocity, 1.0 / noise.position
    bands = np.zeros((4, 2 * n))
    diagonal, first, second, third = bands[3], bands[2], bands[1], bands[0]
    diagonal[0:-2:2] += weight + tight * half**2
    diagonal[2::2] += weight + tight * half**2
    diagonal[1:-2:2] += tight
    diagonal[3::2] += tight
    first[1:-2:2] += tight * half  # v_i with p_i
    first[2::2] += tight * half  # p_i with v_i+1
    first[3::2] -= tight * half  # v_i+1 with p_i+1
    second[2::2] += tight * half**2 - weight  # v_i with v_i+1
    second[3::2] -= tight  # p_i with p_i+1
    third[3::2] -= tight * half  # v_i with p_i+1
    np.add.at(diagonal, 2 * at, known_v**2)
    np.add.at(diagonal, 2 * at + 1, known_p**2)

    def rhs(changes: Array, measured: Array) -> Array:
        pull = np.zeros((2 * n, 3))
        pull[0:-2:2] -= weight[:, None] * changes
        pull[2::2] += weight[:, None] * changes
        np.add.at(pull, 2 * at, known_v**2 * measured[: len(at)])
        np.add.at(pull, 2 * at + 1, known_p**2 * measured[len(at) :])
        return pull

    def residuals(x: Array, changes: Array, measured: Array) -> Array:
        v, p = x[0::2], x[1::2]
        slips = np.sqrt(tight)[:, None] * (np.diff(p, axis=0) - half[:, None] * (v[1:] + v[:-1]))
        parts = [
            steady[:, None] * (np.diff(v, axis=0) - changes),
            slips,
            known_v * (v[at] - measured[: len(at)]),
            known_p * (p[at] - measured[len(at) :]),
        ]
        return np.concatenate([part.ravel() for part in parts])

    return _Chain(bands, rhs, residuals)
