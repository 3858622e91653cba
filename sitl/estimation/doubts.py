"""Doubt of gyroscope and accelerometer: once they have led the belief astray, they count for less for a while.

Which of them did it, field and satellites tell. Where both contradict the belief, each little by little, attitude and
gyroscope are wrong. Where the field agrees and the speed does not, the accelerometer is, and the model's force stands
in for it; tilt is then no longer felt, and a field that contradicts the attitude acquits the accelerometer. A place
alone that is elsewhere tells of neither. Under motion capture the attitude of the poses tells which of them it was, or
that the poses are wrong.
"""

from __future__ import annotations

from sitl.compiled import kernel, subroutine
from sitl.estimation.filter import SLOW_STEP, Filter
from sitl.estimation.fusion import MISTRUSTED_TIME, POSE_ATTITUDE, SATELLITE_VELOCITY
from sitl.estimation.kalman import reset_block
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    ERRORS,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
)
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import ACCELEROMETER, FIRST_DELAYED, GNSS, GYROSCOPE, MAGNETOMETER

DOUBTED_TURN, DOUBTED_RATE, DOUBTED_FORCE = 0.3, 0.2, 2.0  # of attitude and biases [rad], [rad/s], [m/s2]
DOUBTED_PLACE = 1.0  # of position and velocity [m], [m/s]
DOUBTED_TIME = 600.0  # how long gyroscope and accelerometer count for less: to the end of most flights [s]
LOOSE_TURN, LOOSE_RATE = 0.03, 0.05  # what a doubted gyroscope adds to attitude and bias [rad/sqrt(s)], [rad/s/sqrt(s)]
BOTH_TIME = 0.2  # that field and satellites have to be refused for [s]
FIELD_TIME = 1.0  # likewise the field alone, while the accelerometer is doubted [s]
FIELD_LINE, SATELLITE_LINE = MAGNETOMETER - FIRST_DELAYED, GNSS - FIRST_DELAYED


@kernel
def both_refused(f: Filter, period: int) -> bool:
    """Whether field and satellites have begun to contradict the belief, neither of them by a leap."""
    since, leapt = f.refused_since, f.leapt
    if since[FIELD_LINE] < 0.0 or since[SATELLITE_LINE] < 0.0:
        return False
    gradually = leapt[FIELD_LINE] == 0.0 and leapt[SATELLITE_LINE] == 0.0 and leapt[SATELLITE_VELOCITY] == 0.0
    return bool(gradually and (period - max(since[FIELD_LINE], since[SATELLITE_LINE])) * PERIOD >= BOTH_TIME)


@kernel
def wrongly_doubted(f: Filter, period: int) -> bool:
    """Whether the field contradicts the attitude, little by little, though it is the accelerometer that is doubted."""
    since, doubted = f.refused_since[FIELD_LINE], period < f.doubted_until[ACCELEROMETER]
    gradually = since >= 0.0 and f.leapt[FIELD_LINE] == 0.0
    return bool(doubted and gradually and (period - since) * PERIOD >= FIELD_TIME)


@subroutine
def doubt_course(f: Filter, period: int) -> None:
    """Believe field and satellites again, and doubt what both contradict: attitude, velocity and inertial biases."""
    reset_block(f.covariance, POSITION_ERROR, DOUBTED_PLACE * DOUBTED_PLACE)
    reset_block(f.covariance, VELOCITY_ERROR, DOUBTED_PLACE * DOUBTED_PLACE)
    doubt_gyroscope(f, period)
    f.doubted_until[ACCELEROMETER] = -1.0
    for slot in (FIELD_LINE, SATELLITE_LINE, SATELLITE_VELOCITY):
        f.refused_at[slot] = -1e9
    f.refused_since[FIELD_LINE] = f.refused_since[SATELLITE_LINE] = -1.0


@subroutine
def doubt_gyroscope(f: Filter, period: int) -> None:
    """Doubt attitude and both biases, and for a while the gyroscope."""
    reset_block(f.covariance, ATTITUDE_ERROR, DOUBTED_TURN * DOUBTED_TURN)
    reset_block(f.covariance, GYRO_BIAS_ERROR, DOUBTED_RATE * DOUBTED_RATE)
    reset_block(f.covariance, ACCEL_BIAS_ERROR, DOUBTED_FORCE * DOUBTED_FORCE)
    f.doubted_until[GYROSCOPE] = period + DOUBTED_TIME / PERIOD


@subroutine
def doubt_accelerometer(f: Filter, period: int) -> None:
    """Doubt the accelerometer for a while."""
    reset_block(f.covariance, ACCEL_BIAS_ERROR, DOUBTED_FORCE * DOUBTED_FORCE)
    f.doubted_until[ACCELEROMETER] = period + DOUBTED_TIME / PERIOD


@subroutine
def doubt_after_reset(f: Filter, period: int) -> None:
    """Doubt what has led the belief astray, which has just been set to a place that it had refused."""
    outdoors = f.settings.states == ERRORS
    attitude_fits = f.refused_since[FIELD_LINE] < 0.0 if outdoors else not _refused_lately(f, POSE_ATTITUDE, period)
    if not attitude_fits:
        doubt_gyroscope(f, period)
    elif not outdoors or _refused_lately(f, SATELLITE_VELOCITY, period):
        doubt_accelerometer(f, period)


@kernel
def poses_are_wrong(f: Filter, line: int, period: int) -> bool:
    """Whether poses contradict the belief that is right: their places did before their attitudes did.

    A gyroscope that is wrong turns the belief first and then moves it; an accelerometer never turns it.
    """
    both = _refused_lately(f, line, period) and _refused_lately(f, POSE_ATTITUDE, period)
    return bool(both and f.first_refused_at[POSE_ATTITUDE] > f.first_refused_at[line])


@kernel
def _refused_lately(f: Filter, slot: int, period: int) -> bool:
    return bool((period - f.refused_at[slot]) * PERIOD < MISTRUSTED_TIME)


@subroutine
def loosen_doubted(f: Filter, period: int) -> None:
    """Let what a doubted instrument tells become less sure by a slow step."""
    P, until = f.covariance, f.doubted_until
    for k in range(3):
        if period < until[GYROSCOPE]:
            P[ATTITUDE_ERROR + k, ATTITUDE_ERROR + k] += LOOSE_TURN * LOOSE_TURN * SLOW_STEP
            P[GYRO_BIAS_ERROR + k, GYRO_BIAS_ERROR + k] += LOOSE_RATE * LOOSE_RATE * SLOW_STEP
