r"""The error-state Kalman filter's two steps on its covariance, as loops over arrays.

Prediction, with :math:`P` of the errors numbered in :mod:`sitl.estimation.nominal_state`:

.. math::
    P \leftarrow \Phi P \Phi^\top + Q,

where :math:`\Phi` couples position, velocity, attitude and the two inertial biases, lets the wind decay to the steady
wind and every other error to nothing.
Correction by one scalar at a time, so that nothing is inverted. See J. Solà, *Quaternion kinematics for the
error-state Kalman filter*, arXiv 1711.02508, whose local (body) attitude error this is.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    ERRORS,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    STEADY_WIND_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
)
from sitl.estimation.strapdown import Increment
from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.vectors import Vector, cross, scaled

MIN_VARIANCE = 1e-18  # what rounding must not take a variance below
TURN_TIME = 1.0  # that a turn takes [s]
HEADING_BENDS = 5e-4  # variance that accelerometer biases gain by that of the heading in a second [m2/s4/rad2]


class ErrorModel(NamedTuple):
    """Changes of the errors in a step by themselves, (ERRORS,) each."""

    decay: Array  # share that is left; 1 where an error does not decay
    process_noise: Array  # variance gained


class ErrorState(NamedTuple):
    """Estimated errors and their covariance, with room for a correction; all changed in place."""

    P: Array  # covariance, (ERRORS, ERRORS)
    H: Array  # derivative of a reading by the errors, (ERRORS,); zero between corrections
    PH: Array  # room for P H, (ERRORS,)
    errors: Array  # estimated so far, (ERRORS,)
    n: int  # how many of them are used


class ScalarReading(NamedTuple):
    """One scalar to be fused."""

    innovation: float  # the reading less what the belief makes of it, before any of the errors
    variance: float
    gate: float  # largest innovation, in its standard deviations
    caution: float  # variance for which the reading corrects less than it tells; 0 where it corrects all errors


class Columns(NamedTuple):
    """A 3 x 3 matrix by its columns."""

    x: Vector
    y: Vector
    z: Vector


@kernel
def _axes(q: Quaternion, k: float) -> Columns:
    """The matrix k R(q)."""
    x, y, z = Vector(k, 0.0, 0.0), Vector(0.0, k, 0.0), Vector(0.0, 0.0, k)
    return Columns(rotate(q, x), rotate(q, y), rotate(q, z))


@kernel
def _turned_arm(q: Quaternion, arm: Vector) -> Columns:
    """The matrix -R(q) [arm]×."""
    x, y, z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
    return Columns(rotate(q, cross(x, arm)), rotate(q, cross(y, arm)), rotate(q, cross(z, arm)))


@kernel
def _back(q: Quaternion) -> Columns:
    """The matrix R(q)' ."""
    x, y, z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
    return Columns(rotate_inverse(q, x), rotate_inverse(q, y), rotate_inverse(q, z))


@kernel
def _times(M: Columns, a: float, b: float, c: float) -> Vector:
    x, y, z = scaled(M.x, a), scaled(M.y, b), scaled(M.z, c)
    return Vector(x.x + y.x + z.x, x.y + y.y + z.y, x.z + y.z + z.z)


@subroutine
def _half_predicted(P: Array, out: Array, n: int, q: Quaternion, i: Increment, decay: Array) -> None:
    """Write (Phi P)' to ``out``; done twice it is Phi P Phi', transposed and so itself."""
    t = i.time
    axes = _axes(q, 1.0)
    place, speed, turn = _turned_arm(q, i.position), _turned_arm(q, i.velocity), _back(i.rotation)
    for j in range(n):
        vx, vy, vz = P[VELOCITY_ERROR, j], P[VELOCITY_ERROR + 1, j], P[VELOCITY_ERROR + 2, j]
        ax, ay, az = P[ATTITUDE_ERROR, j], P[ATTITUDE_ERROR + 1, j], P[ATTITUDE_ERROR + 2, j]
        g = _times(axes, P[ACCEL_BIAS_ERROR, j], P[ACCEL_BIAS_ERROR + 1, j], P[ACCEL_BIAS_ERROR + 2, j])
        moved, pushed, turned = _times(place, ax, ay, az), _times(speed, ax, ay, az), _times(turn, ax, ay, az)
        out[j, POSITION_ERROR] = P[POSITION_ERROR, j] + t * vx + moved.x - 0.5 * t * t * g.x
        out[j, POSITION_ERROR + 1] = P[POSITION_ERROR + 1, j] + t * vy + moved.y - 0.5 * t * t * g.y
        out[j, POSITION_ERROR + 2] = P[POSITION_ERROR + 2, j] + t * vz + moved.z - 0.5 * t * t * g.z
        out[j, VELOCITY_ERROR] = vx + pushed.x - t * g.x
        out[j, VELOCITY_ERROR + 1] = vy + pushed.y - t * g.y
        out[j, VELOCITY_ERROR + 2] = vz + pushed.z - t * g.z
        out[j, ATTITUDE_ERROR] = turned.x - t * P[GYRO_BIAS_ERROR, j]
        out[j, ATTITUDE_ERROR + 1] = turned.y - t * P[GYRO_BIAS_ERROR + 1, j]
        out[j, ATTITUDE_ERROR + 2] = turned.z - t * P[GYRO_BIAS_ERROR + 2, j]
        for k in range(GYRO_BIAS_ERROR, n):
            out[j, k] = decay[k] * P[k, j]
        for k in range(WIND_ERROR, WIND_ERROR + 3):
            out[j, k] += (1.0 - decay[k]) * P[k + STEADY_WIND_ERROR - WIND_ERROR, j]


@subroutine
def predict(P: Array, work: Array, n: int, q: Quaternion, i: Increment, model: ErrorModel) -> None:
    """The covariance after an increment.

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        work: Room for as much.
        n: How many of the states are used.
        q: Attitude at the increment's beginning.
        i: The increment.
        model: What becomes of the errors by themselves.
    """
    _half_predicted(P, work, n, q, i, model.decay)
    _half_predicted(work, P, n, q, i, model.decay)
    for k in range(n):
        for j in range(k):
            mean = 0.5 * (P[k, j] + P[j, k])
            P[k, j] = mean
            P[j, k] = mean
        P[k, k] += model.process_noise[k]


@kernel
def innovation_ratio(P: Array, H: Array, n: int, innovation: float, variance: float) -> float:
    """The squared innovation over its variance, of a reading that is not used yet; see :class:`ErrorState`."""
    innovation_variance = variance
    for j in range(n):
        if H[j] != 0.0:
            for k in range(n):
                if H[k] != 0.0:
                    innovation_variance += H[j] * P[j, k] * H[k]
    return innovation * innovation / innovation_variance


@subroutine
def correct(state: ErrorState, reading: ScalarReading, first: int, count: int) -> float:
    """Correction by one scalar reading, unless its innovation is beyond the gate.

    Args:
        state: The errors, with the derivative of the reading in H, which is set to zero on return.
        reading: The reading.
        first: 0 to correct all errors; else only some from here on, and the others are only considered.
        count: How many those are.

    Returns:
        The squared innovation over its variance.
    """
    P, H, PH, errors, n = state
    for k in range(n):
        PH[k] = 0.0
    residual = reading.innovation
    for j in range(n):
        h = H[j]
        if h != 0.0:
            residual -= h * errors[j]
            for k in range(n):
                PH[k] += h * P[j, k]
    innovation_variance = reading.variance
    for j in range(n):
        innovation_variance += H[j] * PH[j]
        H[j] = 0.0
    ratio = residual * residual / innovation_variance
    if ratio > reading.gate * reading.gate:
        return ratio
    gain = 1.0 / (innovation_variance + reading.caution)
    own = gain * (2.0 - gain * innovation_variance) if reading.caution > 0.0 else gain
    _update_errors(state, first, count, residual, Taken(gain, own))
    return ratio


class Taken(NamedTuple):
    """Shares that a reading takes of uncertainty, over the product of two covariances with it."""

    gain: float  # of the innovation, and of the covariance of what is corrected with what is not
    own: float  # of the covariance of what is corrected


@kernel
def _update_errors(state: ErrorState, first: int, count: int, residual: float, taken: Taken) -> None:
    """Apply a reading to the covariance and to the errors."""
    P, _, PH, errors, n = state
    gain, own = taken
    if first == 0:
        for k in range(n):
            errors[k] += PH[k] * (residual * gain)
            for j in range(n):
                P[k, j] -= (PH[k] * PH[j]) * gain
            P[k, k] = max(P[k, k], MIN_VARIANCE)
        return
    for k in range(first, first + count):
        errors[k] += PH[k] * (residual * gain)
        for j in range(n):
            if j < first or j >= first + count:
                shared = (PH[k] * PH[j]) * gain
                P[k, j] -= shared
                P[j, k] -= shared
            else:
                P[k, j] -= (PH[k] * PH[j]) * own
        P[k, k] = max(P[k, k], MIN_VARIANCE)


@subroutine
def turn_errors(P: Array, n: int, turn: Vector) -> None:
    """The covariance once the attitude is corrected: its error is one from the corrected attitude (Solà, eq. 287).

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        n: How many of the states are used.
        turn: What was taken off the attitude's error, body frame [rad].
    """
    half = scaled(turn, 0.5)
    a = ATTITUDE_ERROR
    for j in range(n):
        x, y, z = P[a, j], P[a + 1, j], P[a + 2, j]
        P[a, j] = x - (half.y * z - half.z * y)
        P[a + 1, j] = y - (half.z * x - half.x * z)
        P[a + 2, j] = z - (half.x * y - half.y * x)
    for j in range(n):
        x, y, z = P[j, a], P[j, a + 1], P[j, a + 2]
        P[j, a] = x - (half.y * z - half.z * y)
        P[j, a + 1] = y - (half.z * x - half.x * z)
        P[j, a + 2] = z - (half.x * y - half.y * x)


@subroutine
def inflate_biases(P: Array, up: Vector, dt: float) -> None:
    """Let the accelerometer's biases vary the more, the less the heading is known.

    A hover tells tilt and biases together, along axes that the heading gives: in first order their difference would be
    known as exactly as if the heading were right.

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        up: The world's vertical, body frame.
        dt: Time gone by [s].
    """
    a = ATTITUDE_ERROR
    squares = up.x * up.x * P[a, a] + up.y * up.y * P[a + 1, a + 1] + up.z * up.z * P[a + 2, a + 2]
    crossed = up.x * up.y * P[a, a + 1] + up.x * up.z * P[a, a + 2] + up.y * up.z * P[a + 1, a + 2]
    gained = HEADING_BENDS * dt * (squares + 2.0 * crossed)
    for k in range(ACCEL_BIAS_ERROR, ACCEL_BIAS_ERROR + 3):
        P[k, k] += gained


@subroutine
def inflate_turned(P: Array, turn: float, misaligned: float, g: float, dt: float) -> None:
    """Let attitude and accelerometer biases vary while the vehicle turns, as inertial axes that lie askew make them.

    A turn by the angle a is turned wrong by ``misaligned`` a across its axis, and the force that is felt lies along
    other axes after it. That lasts: an angular velocity counts as if it did for ``TURN_TIME``.

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        turn: By which it has turned [rad].
        misaligned: Deviation of the axes [rad].
        g: Gravity [m/s2].
        dt: Time gone by [s].
    """
    gained = misaligned * misaligned * turn * turn * (TURN_TIME / dt)
    for k in range(3):
        P[ATTITUDE_ERROR + k, ATTITUDE_ERROR + k] += gained
        P[ACCEL_BIAS_ERROR + k, ACCEL_BIAS_ERROR + k] += gained * g * g


@subroutine
def transform_row(P: Array, H: Array, PH: Array, n: int, row: int) -> None:
    """The covariance once one error has become a sum of errors.

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        H: What of every error it becomes the sum of, (ERRORS,); set to zero on return.
        PH: Room for P H, (ERRORS,).
        n: How many of the states are used.
        row: Number of the error.
    """
    for k in range(n):
        PH[k] = 0.0
    for j in range(n):
        h = H[j]
        if h != 0.0:
            for k in range(n):
                PH[k] += h * P[j, k]
    variance = 0.0
    for j in range(n):
        variance += H[j] * PH[j]
        H[j] = 0.0
    for k in range(n):
        P[row, k] = PH[k]
        P[k, row] = PH[k]
    P[row, row] = max(variance, MIN_VARIANCE)


@subroutine
def reset_block(P: Array, first: int, variance: float) -> None:
    """Forget three errors, which are then of this variance and of nothing else."""
    for k in range(first, first + 3):
        for j in range(ERRORS):
            P[k, j] = 0.0
            P[j, k] = 0.0
        P[k, k] = variance
