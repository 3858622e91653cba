"""Observation of each reading: its innovation, its derivative by the errors, its variance.

Every function here takes the filter ``f`` and the instruments ``i``, both records, and one reading; it corrects
the filter and leaves how well the reading agreed.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.estimation.air_readings import observe_airspeed
from sitl.estimation.filter import SLOW_STEP, Filter, Step, put_standing_time
from sitl.estimation.fusion import (
    NO_OTHER,
    POSE_ATTITUDE,
    SATELLITE_VELOCITY,
    Agreement,
    correct_nominal,
    fuse,
    innovation_ratio_of,
    may_be_fused,
    note,
    put_vector,
    sum_of_errors,
)
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
)
from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion, conjugate, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, norm, scaled, subtract
from sitl.sensors.draws import PERIOD, vector_at
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    BAROMETER,
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    HAS_ATTITUDE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    PITOT,
    POSITION_VARIANCE,
    Instruments,
)
from sitl.storage import value_of

MIN_FIELD = 1e-9  # whose direction is known [T]
NO_POSE_TIME = 2.0  # after so long without a pose the velocity is integrated alone [s]
# On the ground the velocity is taken as zero, unless its estimated vertical part is larger than this, or than so many
# of its deviations: then it is still falling [m/s], [-].
STANDING_VERTICAL_SPEED, STANDING_SPEED_DOUBT = 1.0, 2.0
STANDING_SPEED_DEVIATION = 0.5  # of that zero [m/s]


class Arrived(NamedTuple):
    """Origin and age of a reading that is fused."""

    line: int  # of the instrument
    age: float  # how long before the horizon it was read [s]
    period: int  # now


class VectorSource(NamedTuple):
    """Instrument that tells a vector, and the errors that this shows."""

    line: int  # of the instrument
    slot: int  # where it is noted that it was refused: the line, or SATELLITE_VELOCITY or POSE_ATTITUDE
    first: int  # first of three errors
    other: int  # first of three more, added to those, or NO_OTHER


class VectorInnovation(NamedTuple):
    """Innovation of a vector, and its variances."""

    value: Vector
    level: float  # variance of the first two
    up: float  # variance of the third
    repeats: float  # readings that tell as much as one whose noise were new
    arm: Vector  # what turns with the body, of whose end it is told, body FLU


@subroutine
def _fuse_vector(f: Filter, source: VectorSource, period: int, innovation: VectorInnovation, allowed: bool) -> bool:
    """Correct by three scalars, each the sum of two errors; by none if one of them does not fit.

    Args:
        f: The filter.
        source: Of the reading.
        period: Of the reading.
        innovation: Of the three.
        allowed: Whether the state may be corrected; else the innovation is only tested.
    """
    moved, level, up, repeats, arm = innovation
    worst = total = 0.0
    for axis in range(3):
        _derive(f, source, axis, arm)
        ratio = innovation_ratio_of(f, _part(moved, axis), up if axis == 2 else level)
        worst, total = max(worst, ratio), total + ratio
    fits = may_be_fused(f, source.slot, period, worst) and allowed
    if fits:
        worst = total = 0.0
        for axis in range(3):
            _derive(f, source, axis, arm)
            ratio = fuse(f, 0, _part(moved, axis), repeats * (up if axis == 2 else level))
            worst, total = max(worst, ratio), total + ratio
        correct_nominal(f)
    return note(f, source.line, period, Agreement(worst, total, 3), fits)


@subroutine
def _derive(f: Filter, source: VectorSource, axis: int, arm: Vector) -> None:
    """The derivative of one of the three: the sum of two errors, and what a turn moves at the end of an arm."""
    other = source.other + axis if source.other != NO_OTHER else NO_OTHER
    sum_of_errors(f.H, source.first + axis, other)
    if arm.x == 0.0 and arm.y == 0.0 and arm.z == 0.0:
        return
    along = Vector(1.0 if axis == 0 else 0.0, 1.0 if axis == 1 else 0.0, 1.0 if axis == 2 else 0.0)
    turned = cross(arm, rotate_inverse(value_of(f.nominal.attitude), along))
    f.H[ATTITUDE_ERROR] += turned.x
    f.H[ATTITUDE_ERROR + 1] += turned.y
    f.H[ATTITUDE_ERROR + 2] += turned.z


@kernel
def _part(value: Vector, axis: int) -> float:
    return value.x if axis == 0 else (value.y if axis == 1 else value.z)


@kernel
def antenna_place(q: Quaternion, i: Instruments) -> Vector:
    """From the centre of mass to the antenna, world NWU [m]."""
    return rotate(q, value_of(i.specification.mounting.antenna))


@subroutine
def observe_satellites(f: Filter, i: Instruments, reading: Array, age: float, rates: Vector, period: int) -> bool:
    """Position and velocity of the satellite receiver's antenna.

    Args:
        f: The filter.
        i: The instruments.
        reading: Position and velocity.
        age: How long before the horizon they were read [s].
        rates: Body rates at the horizon [rad/s].
        period: Now.
    """
    b, spec, repeats = value_of(f.nominal), value_of(i.specification.gnss), f.settings.gnss_repeats
    antenna = value_of(i.specification.mounting.antenna)
    there = add(add(add_scaled(b.position, b.velocity, -age), b.gnss_drift), rotate(b.attitude, antenna))
    moved = subtract(vector_at(reading, 0), there)
    level, up = spec.noise_level * spec.noise_level, spec.noise_up * spec.noise_up
    line = GNSS - FIRST_DELAYED
    since = f.refused_since[line]
    source = VectorSource(line, line, POSITION_ERROR, GNSS_DRIFT_ERROR)
    fits = _fuse_vector(f, source, period, VectorInnovation(moved, level, up, repeats, antenna), True)
    refused = f.refused_since[line] >= 0.0
    b = value_of(f.nominal)
    swing = cross(rates, antenna)
    faster = subtract(vector_at(reading, 3), add(b.velocity, rotate(b.attitude, swing)))
    level, up = spec.velocity_noise_level * spec.velocity_noise_level, spec.velocity_noise_up * spec.velocity_noise_up
    source = VectorSource(line, SATELLITE_VELOCITY, VELOCITY_ERROR, NO_OTHER)
    fits = _fuse_vector(f, source, period, VectorInnovation(faster, level, up, repeats, swing), True) and fits
    _refuse_as_one(f, line, refused, since, period)
    return fits


@subroutine
def _refuse_as_one(f: Filter, line: int, refused: bool, since: float, period: int) -> None:
    """Count a reading as refused of which the first part was, or the second.

    Args:
        f: The filter.
        line: Of the instrument.
        refused: Whether the first part was.
        since: Since when its readings were refused before this one.
        period: Of the reading.
    """
    if refused or f.refused_since[line] >= 0.0:
        f.refused_since[line] = since if since >= 0.0 else period


@subroutine
def observe_height(f: Filter, i: Instruments, reading: Array, age: float, period: int) -> None:
    """The barometer's height."""
    b, spec, H = value_of(f.nominal), value_of(i.specification.barometer), f.H
    P, through = f.covariance, subtract(b.velocity, b.wind)
    square = dot(through, through) + P[WIND_ERROR, WIND_ERROR] + P[WIND_ERROR + 1, WIND_ERROR + 1]
    head = square / (2.0 * f.model.g)  # the dynamic pressure, as a height
    innovation = reading[0] - (b.position.z - age * b.velocity.z + b.barometer_drift - b.static_port * head)
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    sum_of_errors(H, POSITION_ERROR + 2, BAROMETER_DRIFT_ERROR)
    H[STATIC_PORT_ERROR] = -head
    ratio = innovation_ratio_of(f, innovation, variance)
    fits = may_be_fused(f, BAROMETER - FIRST_DELAYED, period, ratio)
    if fits:
        sum_of_errors(H, POSITION_ERROR + 2, BAROMETER_DRIFT_ERROR)
        H[STATIC_PORT_ERROR] = -head
        ratio = fuse(f, 0, innovation, variance)
        correct_nominal(f)
    note(f, BAROMETER - FIRST_DELAYED, period, Agreement(ratio, ratio, 1), fits)


@subroutine
def observe_field(f: Filter, i: Instruments, reading: Array, age: float, rates: Vector, period: int) -> None:
    """The magnetic field, by the body's axes; ``rates`` are the body's at the horizon [rad/s]."""
    b, spec = value_of(f.nominal), value_of(i.specification.magnetometer)
    earth = Vector(spec.field_north, spec.field_west, spec.field_up)
    q = multiply(b.attitude, small_rotation(scaled(rates, -age)))
    field = rotate_inverse(q, earth)
    innovation = subtract(vector_at(reading, 0), add(field, b.magnetic_bias))
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    worst = total = 0.0
    for k in range(3):
        _field_along(f.H, k, field)
        ratio = innovation_ratio_of(f, _part(innovation, k), variance)
        worst, total = max(worst, ratio), total + ratio
    worst = max(worst, _strength_ratio(f, subtract(vector_at(reading, 0), b.magnetic_bias), norm(earth), variance))
    fits = may_be_fused(f, MAGNETOMETER - FIRST_DELAYED, period, worst)
    if fits:
        worst = total = 0.0
        for k in range(3):
            _field_along(f.H, k, field)
            ratio = fuse(f, 0, _part(innovation, k), variance)
            worst, total = max(worst, ratio), total + ratio
        correct_nominal(f)
    note(f, MAGNETOMETER - FIRST_DELAYED, period, Agreement(worst, total, 3), fits)


@subroutine
def _strength_ratio(f: Filter, field: Vector, earth: float, variance: float) -> float:
    """The squared innovation over its variance of the field's strength, which no attitude changes.

    A magnetometer that fails must not be fused because the attitude has become uncertain, which then follows it.

    Args:
        f: The filter.
        field: As read, less the bias [T].
        earth: Strength of the earth's field [T].
        variance: Of a reading [T2].
    """
    strength = max(norm(field), MIN_FIELD)
    put_vector(f.H, MAGNETIC_BIAS_ERROR, scaled(field, 1.0 / strength))
    return innovation_ratio_of(f, strength - earth, variance)


@subroutine
def _field_along(H: Array, k: int, field: Vector) -> None:
    """The derivative of the field along the body's axis ``k``, which has a bias of its own."""
    axis = Vector(1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
    put_vector(H, ATTITUDE_ERROR, cross(axis, field))
    put_vector(H, MAGNETIC_BIAS_ERROR, axis)


@subroutine
def observe_pose(f: Filter, line: int, reading: Array, age: float, rates: Vector, period: int) -> bool:
    """Position and, where it has one, attitude from motion capture or from outside."""
    b, none = value_of(f.nominal), Vector(0.0, 0.0, 0.0)
    there = add_scaled(b.position, b.velocity, -age)
    moved, variance = subtract(vector_at(reading, 0), there), reading[POSITION_VARIANCE]
    since = f.refused_since[line]
    source = VectorSource(line, line, POSITION_ERROR, NO_OTHER)
    fits = _fuse_vector(f, source, period, VectorInnovation(moved, variance, variance, 1.0, none), True)
    refused, placed_at = f.refused_since[line] >= 0.0, f.fused_at[line]
    if reading[HAS_ATTITUDE] == 0.0:
        return fits
    b = value_of(f.nominal)
    q = multiply(multiply(b.attitude, small_rotation(scaled(rates, -age))), small_rotation(b.misalignment))
    off = multiply(conjugate(q), Quaternion(reading[3], reading[4], reading[5], reading[6]))
    twice = 2.0 if off.w >= 0.0 else -2.0
    turn, variance = Vector(twice * off.x, twice * off.y, twice * off.z), reading[ATTITUDE_VARIANCE]
    # Where a place is off that has not leapt, the belief is wrong or the pose: its attitude is not believed before it
    # is known which.
    known = not refused or f.leapt[line] > 0.0 or f.failed[line + FIRST_DELAYED] > 0.0
    source = VectorSource(line, POSE_ATTITUDE, ATTITUDE_ERROR, MISALIGNMENT_ERROR)
    fits = _fuse_vector(f, source, period, VectorInnovation(turn, variance, variance, 1.0, none), known) and fits
    f.fused_at[line] = placed_at  # an attitude alone is no help with the place
    _refuse_as_one(f, line, refused, since, period)
    return fits


@subroutine
def observe_reading(f: Filter, i: Instruments, reading: Array, arrived: Arrived, step: Step) -> bool:
    """Fuse a reading of any instrument; whether the filter believed it, of those that tell a place."""
    line, age, period = arrived
    instrument, rates = line + FIRST_DELAYED, subtract(step.rates, value_of(f.nominal.gyro_bias))
    if instrument == MAGNETOMETER:
        observe_field(f, i, reading, age, rates, period)
    elif instrument == BAROMETER:
        observe_height(f, i, reading, age, period)
    elif instrument == PITOT:
        observe_airspeed(f, i, reading, period, step)
    elif instrument == GNSS:
        return observe_satellites(f, i, reading, age, rates, period)
    else:
        return observe_pose(f, line, reading, age, rates, period)
    return True


@subroutine
def observe_standing(f: Filter, period: int) -> None:
    """A vehicle that the ground stops, and that nothing has told its place for a while, stands still.

    What its inertial readings have added up to would move it on, and the law after it.
    """
    velocity = value_of(f.nominal.velocity)
    capture = max(f.fused_at[MOTION_CAPTURE - FIRST_DELAYED], f.fused_at[EXTERNAL_POSE - FIRST_DELAYED])
    is_told = f.settings.states == ERRORS or (period - capture) * PERIOD < NO_POSE_TIME
    put_standing_time(f, f.standing_time + SLOW_STEP if f.on_ground else 0.0)
    doubt = math.sqrt(max(f.covariance[VELOCITY_ERROR + 2, VELOCITY_ERROR + 2], 0.0))
    if is_told or not f.on_ground or abs(velocity.z) > max(STANDING_VERTICAL_SPEED, STANDING_SPEED_DOUBT * doubt):
        return
    for axis in range(3):
        sum_of_errors(f.H, VELOCITY_ERROR + axis, NO_OTHER)
        fuse(f, 0, -_part(velocity, axis), STANDING_SPEED_DEVIATION * STANDING_SPEED_DEVIATION)
    correct_nominal(f)
