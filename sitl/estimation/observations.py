"""What each reading tells the filter: its innovation, its derivative by the errors, its variance.

Every function here takes the filter ``f`` and the instruments ``i``, both records, and one reading; it corrects
the filter and leaves how well the reading agreed.
"""

from __future__ import annotations

from sitl.compiled import kernel, subroutine
from sitl.control.wind_estimator import normal_slope
from sitl.estimation.belief import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    GNSS_DRIFT_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    Belief,
    corrected,
    with_wind,
)
from sitl.estimation.filter import (
    SLOW_STEP,
    Step,
    get_belief,
    get_model,
    get_wind_settings,
    put_belief,
)
from sitl.estimation.kalman import correct
from sitl.model.aerodynamics import wrench
from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion, conjugate, multiply, rotate, rotate_inverse, small_rotation
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, scaled, subtract
from sitl.sensors.draws import vector_at
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    BAROMETER,
    FIRST_LINE,
    GNSS,
    HAS_ATTITUDE,
    MAGNETOMETER,
    PITOT,
    POSITION_VARIANCE,
    get_specification,
)
from sitl.storage import Kept

NO_OTHER = -1
POSITION_ERROR_TIME = 5.0  # how long an airspeed, and what it does to the static pressure, lasts [s]


@kernel
def _set(H: Array, first: int, value: Vector) -> None:
    H[first], H[first + 1], H[first + 2] = value.x, value.y, value.z


@subroutine
def _fuse(f: Kept, first: int, innovation: float, variance: float) -> float:
    """Correct by a scalar whose derivative stands in H; see :func:`sitl.estimation.kalman.correct`."""
    n, gate = f["settings"]["states"], f["settings"]["gate"]
    return correct(f["covariance"], f["H"], f["PH"], f["errors"], n, first, innovation, variance, gate)


@subroutine
def _note(f: Kept, line: int, period: int, worst: float, total: float, scalars: int) -> bool:
    """Note how well a reading agreed; whether all of it was fused."""
    f["ratio"][line] = worst
    f["squares"][line] += total
    f["scalars"][line] += scalars
    gate = f["settings"]["gate"]
    if worst <= gate * gate:
        f["fused_at"][line] = period
        f["refused_since"][line] = -1.0
        return True
    if f["refused_since"][line] < 0.0:
        f["refused_since"][line] = period
    return False


@kernel
def _correct_belief(f: Kept) -> None:
    put_belief(f, 0, corrected(get_belief(f, 0), f["errors"]))


@subroutine
def _fuse_vector(
    f: Kept, line: int, period: int, first: int, other: int, innovation: Vector, level: float, up: float
) -> bool:
    """Correct by three scalars, each the sum of two errors.

    Args:
        f: The filter.
        line: Of the instrument.
        period: Of the reading.
        first: First of the three errors that the reading shows.
        other: First of three more, or NO_OTHER.
        innovation: Of the three.
        level: Variance of the first two.
        up: Variance of the third.
    """
    H = f["H"]
    worst = total = 0.0
    for axis in range(3):
        H[first + axis] = 1.0
        if other != NO_OTHER:
            H[other + axis] = 1.0
        value = innovation.x if axis == 0 else (innovation.y if axis == 1 else innovation.z)
        ratio = _fuse(f, 0, value, up if axis == 2 else level)
        worst, total = max(worst, ratio), total + ratio
    _correct_belief(f)
    return _note(f, line, period, worst, total, 3)


@subroutine
def observe_satellites(f: Kept, i: Kept, reading: Array, age: float, period: int) -> bool:
    """Position and velocity of the satellite receiver; ``age`` is how long before the horizon they were read [s]."""
    b, spec = get_belief(f, 0), get_specification(i, 0).gnss
    there = add(add_scaled(b.position, b.velocity, -age), b.gnss_drift)
    moved = subtract(vector_at(reading, 0), there)
    level, up = spec.noise_level * spec.noise_level, spec.noise_up * spec.noise_up
    fits = _fuse_vector(f, GNSS - FIRST_LINE, period, POSITION_ERROR, GNSS_DRIFT_ERROR, moved, level, up)
    b = get_belief(f, 0)
    faster = subtract(vector_at(reading, 3), b.velocity)
    level, up = spec.velocity_noise_level * spec.velocity_noise_level, spec.velocity_noise_up * spec.velocity_noise_up
    return _fuse_vector(f, GNSS - FIRST_LINE, period, VELOCITY_ERROR, NO_OTHER, faster, level, up) and fits


@subroutine
def observe_height(f: Kept, i: Kept, reading: Array, age: float, period: int) -> None:
    """The barometer's height."""
    b, spec, H = get_belief(f, 0), get_specification(i, 0).barometer, f["H"]
    through = subtract(b.velocity, b.wind)
    wrong = spec.position_error * dot(through, through) / (2.0 * get_model(f, 0).g)
    # What the air does to the static pressure lasts as long as the airspeed: it wanders like a drift.
    f["covariance"][BAROMETER_DRIFT_ERROR, BAROMETER_DRIFT_ERROR] += (
        2.0 * wrong * wrong / (POSITION_ERROR_TIME * spec.timing.rate)
    )
    H[POSITION_ERROR + 2], H[BAROMETER_DRIFT_ERROR] = 1.0, 1.0
    innovation = reading[0] - (b.position.z - age * b.velocity.z + b.barometer_drift)
    ratio = _fuse(f, 0, innovation, spec.noise * spec.noise + spec.step * spec.step / 12.0)
    _correct_belief(f)
    _note(f, BAROMETER - FIRST_LINE, period, ratio, ratio, 1)


@subroutine
def observe_field(f: Kept, i: Kept, reading: Array, age: float, rates: Vector, period: int) -> None:
    """The magnetic field, by the body's axes; ``rates`` are the body's at the horizon [rad/s]."""
    b, spec = get_belief(f, 0), get_specification(i, 0).magnetometer
    earth = Vector(spec.field_north, spec.field_west, spec.field_up)
    q = multiply(b.attitude, small_rotation(scaled(rates, -age)))
    field = rotate_inverse(q, earth)
    innovation = subtract(vector_at(reading, 0), add(field, b.magnetic_bias))
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    x, y, z = Vector(1.0, 0.0, 0.0), Vector(0.0, 1.0, 0.0), Vector(0.0, 0.0, 1.0)
    worst, total = _fuse_turned(f, x, innovation.x, cross(x, field), MAGNETIC_BIAS_ERROR, variance), 0.0
    total += worst
    ratio = _fuse_turned(f, y, innovation.y, cross(y, field), MAGNETIC_BIAS_ERROR, variance)
    worst, total = max(worst, ratio), total + ratio
    ratio = _fuse_turned(f, z, innovation.z, cross(z, field), MAGNETIC_BIAS_ERROR, variance)
    worst, total = max(worst, ratio), total + ratio
    _correct_belief(f)
    _note(f, MAGNETOMETER - FIRST_LINE, period, worst, total, 3)


@subroutine
def _fuse_turned(f: Kept, axis: Vector, innovation: float, by_attitude: Vector, bias: int, variance: float) -> float:
    """Correct by one axis of a vector in the body frame that has a bias of its own."""
    _set(f["H"], ATTITUDE_ERROR, by_attitude)
    _set(f["H"], bias, axis)
    return _fuse(f, 0, innovation, variance)


@subroutine
def observe_pose(f: Kept, line: int, reading: Array, age: float, rates: Vector, period: int) -> bool:
    """Position and, where it has one, attitude from motion capture or from outside."""
    b = get_belief(f, 0)
    there = add_scaled(b.position, b.velocity, -age)
    moved, variance = subtract(vector_at(reading, 0), there), reading[POSITION_VARIANCE]
    fits = _fuse_vector(f, line, period, POSITION_ERROR, NO_OTHER, moved, variance, variance)
    if reading[HAS_ATTITUDE] == 0.0:
        return fits
    b = get_belief(f, 0)
    q = multiply(multiply(b.attitude, small_rotation(scaled(rates, -age))), small_rotation(b.misalignment))
    off = multiply(conjugate(q), Quaternion(reading[3], reading[4], reading[5], reading[6]))
    twice = 2.0 if off.w >= 0.0 else -2.0
    turn, variance = Vector(twice * off.x, twice * off.y, twice * off.z), reading[ATTITUDE_VARIANCE]
    return _fuse_vector(f, line, period, ATTITUDE_ERROR, MISALIGNMENT_ERROR, turn, variance, variance) and fits


@subroutine
def observe_airspeed(f: Kept, i: Kept, reading: Array, period: int) -> None:
    """The pitot's airspeed, which tells of the wind alone: a wrong tube shall not move the vehicle."""
    b, gains, H = get_belief(f, 0), get_wind_settings(f, 0), f["H"]
    if reading[0] <= gains.min_pitot:
        return
    ahead = Vector(1.0, 0.0, 0.0)
    nose = rotate(b.attitude, ahead)
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    _set(H, VELOCITY_ERROR, nose)
    _set(H, WIND_ERROR, scaled(nose, -1.0))
    _set(H, ATTITUDE_ERROR, cross(ahead, v_b))
    rate = get_specification(i, 0).pitot.timing.rate
    ratio = _fuse(f, WIND_ERROR, reading[0] - v_b.x, gains.pitot_noise * gains.pitot_noise * rate)
    _correct_belief(f)
    _note(f, PITOT - FIRST_LINE, period, ratio, ratio, 1)


@subroutine
def observe_wing(f: Kept, step: Step, has_tube: bool) -> None:
    """The force across the wing, which tells of the wind alone: a wrong model shall not move the vehicle."""
    b, gains, a, H = get_belief(f, 0), get_wind_settings(f, 0), get_model(f, 0), f["H"]
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    F, _ = wrench(v_b, subtract(step.rates, b.gyro_bias), step.actuators, a)
    lightness = 1.0 / a.m
    slope = normal_slope(v_b, step.actuators, a)
    # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed.
    slope = Vector(lightness * (slope.x if has_tube else 0.0), lightness * slope.y, lightness * slope.z)
    by_wind = rotate(b.attitude, slope)
    _set(H, WIND_ERROR, by_wind)
    _set(H, VELOCITY_ERROR, scaled(by_wind, -1.0))
    _set(H, ATTITUDE_ERROR, cross(v_b, slope))
    H[ACCEL_BIAS_ERROR + 2] = 1.0
    wrong = f["settings"]["model_share"] * lightness * F.z
    variance = (gains.normal_noise * gains.normal_noise + wrong * wrong * f["settings"]["model_time"]) / SLOW_STEP
    _fuse(f, WIND_ERROR, step.force.z - b.accel_bias.z - lightness * F.z, variance)
    _correct_belief(f)


@kernel
def nose_wind_fading(b: Belief, time: float) -> Belief:
    """The belief with the wind along the nose a slow step nearer to calm: without a tube nothing tells it."""
    nose = rotate(b.attitude, Vector(1.0, 0.0, 0.0))
    wind = add_scaled(b.wind, nose, -dot(b.wind, nose) * SLOW_STEP / time)
    return with_wind(b, wind)
