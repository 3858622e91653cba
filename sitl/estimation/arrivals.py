"""Readings as they arrive: each fused when the filter comes to its time, refused, or believed against the filter."""

from __future__ import annotations

from sitl.compiled import subroutine
from sitl.estimation.doubts import both_refused, doubt_after_reset, doubt_course, poses_are_wrong, wrongly_doubted
from sitl.estimation.filter import Filter, Step, put_nominal, put_resets
from sitl.estimation.fusion import SATELLITE_VELOCITY, paired_slot
from sitl.estimation.kalman import reset_block
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    ERRORS,
    POSITION_ERROR,
    VELOCITY_ERROR,
    with_attitude,
    with_position,
    with_velocity,
)
from sitl.estimation.observations import Arrived, antenna_place, observe_reading
from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector, norm, subtract
from sitl.sensors.draws import PERIOD, SLOW_PERIODS, vector_at
from sitl.sensors.instruments import (
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    HAS_ATTITUDE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    N_DELAYED,
    PITOT,
    READING_SIZE,
    Instruments,
    drop,
)
from sitl.storage import value_of

REFUSED_TIME = 1.0  # readings refused for so long are right, and the filter is wrong [s]
LANDED_TIME = 2.0  # on the ground for so long it has landed [s]
MAX_LEAP = 5.0  # from a place to the next one that is told: what leaps farther is no place [m]
REPEATED = 4.0  # readings that repeat the one before so often in a row are those of a stuck instrument
MIN_TURN_DEVIATION = 0.05  # variance floor of an attitude that is set anew, as a deviation [rad]


@subroutine
def fuse_arrived(f: Filter, i: Instruments, horizon: int, period: int, step: Step) -> None:
    """Fuse all readings up to the horizon, each line in its order; what has not arrived by now is too late."""
    outdoors = f.settings.states == ERRORS
    for line in range(N_DELAYED):
        while i.waiting[line] > 0.0:
            at = int(i.first[line])
            sampled = i.sampled[line, at]
            if sampled > horizon:
                break
            if i.arrives[line, at] > period or sampled <= horizon - SLOW_PERIODS:
                f.late[line] += 1.0
            elif outdoors or line == PITOT - FIRST_DELAYED or line >= MOTION_CAPTURE - FIRST_DELAYED:
                if not _is_repeated(f, line, i.readings[line, at]):
                    _fuse(f, i, i.readings[line, at], Arrived(line, (horizon - sampled) * PERIOD, period), step)
                for k in range(READING_SIZE):
                    f.before[line, k] = i.readings[line, at, k]
            drop(line, i)


@subroutine
def _is_repeated(f: Filter, line: int, reading: Array) -> bool:
    """Whether an instrument tells the same number over and over, which none does whose numbers are noisy."""
    same = line != EXTERNAL_POSE - FIRST_DELAYED
    for k in range(READING_SIZE):
        same = same and reading[k] == f.before[line, k]
    f.repeated[line] = f.repeated[line] + 1.0 if same else 0.0
    return bool(f.repeated[line] >= REPEATED)


@subroutine
def _fuse(f: Filter, i: Instruments, reading: Array, arrived: Arrived, step: Step) -> None:
    """Fuse one reading, and judge what it tells of the belief."""
    fits = observe_reading(f, i, reading, arrived, step)
    line, _, period = arrived
    instrument = line + FIRST_DELAYED
    if instrument == MAGNETOMETER:
        if wrongly_doubted(f, period):
            doubt_course(f, period)
            put_resets(f, f.resets + 1)
    elif fits:
        return
    elif instrument == GNSS:
        _hear_satellites(f, i, line, reading, period)
    elif _is_wrong(f, line, reading, period):
        if f.standing_time < LANDED_TIME and poses_are_wrong(f, line, period):
            f.failed[instrument] = 1.0
            return
        _set_place(f, vector_at(reading, 0), value_of(f.nominal.velocity), 0.25)
        _has_been_reset(f, line, period)
        if reading[HAS_ATTITUDE] > 0.0:
            _set_attitude(f, Quaternion(reading[3], reading[4], reading[5], reading[6]))


@subroutine
def _hear_satellites(f: Filter, i: Instruments, line: int, reading: Array, period: int) -> None:
    """Correct a belief that is wrong, by readings that it refuses."""
    if both_refused(f, period):
        doubt_course(f, period)
        put_resets(f, f.resets + 1)
    elif _is_wrong(f, line, reading, period):
        place = subtract(vector_at(reading, 0), antenna_place(value_of(f.nominal.attitude), i))
        _set_place(f, place, vector_at(reading, 3), 1.0)
        _has_been_reset(f, line, period)


@subroutine
def _is_wrong(f: Filter, line: int, reading: Array, period: int) -> bool:
    """Whether readings that agree among themselves were all refused for so long that they must be right."""
    since = f.refused_since[line]
    if since < 0.0:
        return False
    # On the ground a pose that is wrong leads nowhere.
    if f.standing_time < LANDED_TIME or line == GNSS - FIRST_DELAYED:
        if f.leapt[line] > 0.0 or f.leapt[paired_slot(line)] > 0.0:
            _declare_failed(f, line, period)
            return False
        if f.failed[line + FIRST_DELAYED] > 0.0:
            return False
    leap = norm(subtract(vector_at(reading, 0), vector_at(f.before[line], 0)))
    if leap > MAX_LEAP:
        f.refused_since[line] = period
        return False
    return bool((period - since) * PERIOD > REFUSED_TIME)


@subroutine
def _declare_failed(f: Filter, line: int, period: int) -> None:
    """Believe an instrument no more whose places leapt off long ago and have not come back.

    A belief that becomes less sure would let them in again by and by. A receiver tells a velocity by other means than
    the place: that is believed until it is refused too.
    """
    long_ago = (period - f.refused_since[line]) * PERIOD > REFUSED_TIME
    keeps_velocity = line == GNSS - FIRST_DELAYED and f.refused_at[SATELLITE_VELOCITY] < period
    if f.leapt[line] > 0.0 and f.refused_at[line] == period and long_ago and not keeps_velocity:
        f.failed[line + FIRST_DELAYED] = 1.0


@subroutine
def _has_been_reset(f: Filter, line: int, period: int) -> None:
    """Note it, and doubt what has led the belief astray."""
    put_resets(f, f.resets + 1)
    doubt_after_reset(f, period)
    f.refused_since[line] = -1.0
    f.fused_at[line], f.failed[line + FIRST_DELAYED] = period, 0.0


@subroutine
def _set_place(f: Filter, place: Vector, velocity: Vector, variance: float) -> None:
    """Take position and velocity from a reading."""
    b = value_of(f.nominal)
    reset_block(f.covariance, POSITION_ERROR, variance)
    reset_block(f.covariance, VELOCITY_ERROR, variance)
    put_nominal(f, with_velocity(with_position(b, place), velocity))


@subroutine
def _set_attitude(f: Filter, q: Quaternion) -> None:
    """Take the attitude from a reading."""
    reset_block(f.covariance, ATTITUDE_ERROR, MIN_TURN_DEVIATION * MIN_TURN_DEVIATION)
    put_nominal(f, with_attitude(value_of(f.nominal), q))
