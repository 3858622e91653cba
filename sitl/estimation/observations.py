"""What each reading tells the filter: its innovation, its derivative by the errors, its variance.

Every function here takes the filter ``f`` and the instruments ``i``, both records, and one reading; it corrects
the filter and leaves how well the reading agreed.
"""

from __future__ import annotations

import math

from sitl.compiled import kernel, subroutine
from sitl.estimation.air import body_deviations, shaken, told_by_wing, turn_tube
from sitl.estimation.belief import (
    ACCEL_BIAS_ERROR,
    AIR_ERRORS,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    GNSS_DRIFT_ERROR,
    MAGNETIC_BIAS_ERROR,
    MISALIGNMENT_ERROR,
    POSITION_ERROR,
    STATIC_PORT_ERROR,
    STEADY_WIND_ERROR,
    TUBE_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    WING_ERROR,
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
from sitl.estimation.kalman import correct, restart, surprise, turn_errors
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
    LINES,
    MAGNETOMETER,
    MOTION_CAPTURE,
    PITOT,
    POSITION_VARIANCE,
    get_specification,
)
from sitl.storage import Kept
from sitl.timing import PERIOD

NO_OTHER = -1
WING = LINES  # where the wing's innovations are counted, beside the lines
WING_NOISE = 0.12  # of the force across the wing, mean of a slow step, unshaken [m/s2]
WING_LACKS = 0.1  # what its model may lack whatever the force is [m/s2]
WING_DOUBT = 1.2  # of one reading beside its noise: what the model lacks and keeps lacking [m/s2]
UNKNOWN_TIME = 10.0  # how long the effect of a wind lasts that no reading tells [s]
SATELLITE_VELOCITY, POSE_ATTITUDE = LINES, LINES + 1  # slots beside the lines: they are refused by themselves
MISTRUSTED_TIME = 0.5  # after a reading that was refused, none is fused for so long: garbage fits now and then [s]
TUBE_DEAD = 2.0  # how far beyond its threshold a reading has to be that is not expected [m/s]
TUBE_LEAP = 3.0  # more than an airspeed changes from one reading to the next [m/s]
TUBE_DOUBTED = 3.0  # after a reading that was refused, the tube checks nothing for so long [s]
TUBE_FORGIVEN = 5.0  # refused for so long without leaps, the tube is right and the wind was believed wrong [s]
# A belief goes astray little by little: where a reading that was right just before is far off, the instrument is wrong.
LATELY = 0.3  # since the last refusal: what comes sooner is not the first [s]
LEAPT = 16.0  # far off, in gates, squared
JUST_BEFORE = 1.0  # since an instrument last helped: after a longer silence the belief may be what went astray [s]


@kernel
def _set(H: Array, first: int, value: Vector) -> None:
    H[first], H[first + 1], H[first + 2] = value.x, value.y, value.z


@subroutine
def _fuse(f: Kept, first: int, innovation: float, variance: float) -> float:
    """Correct by a scalar whose derivative stands in H; see :func:`sitl.estimation.kalman.correct`."""
    n, gate = f["settings"]["states"], f["settings"]["gate"]
    return correct(f["covariance"], f["H"], f["PH"], f["errors"], n, first, AIR_ERRORS, innovation, variance, gate)


@subroutine
def _surprise(f: Kept, innovation: float, variance: float) -> float:
    """The squared innovation over its variance of a scalar whose derivative stands in H, which is set to zero."""
    ratio = surprise(f["covariance"], f["H"], f["settings"]["states"], innovation, variance)
    f["H"][:] = 0.0
    return ratio


@subroutine
def _fits(f: Kept, slot: int, period: int, worst: float) -> bool:
    """Whether a reading agrees with the belief and may be fused; ``slot`` is its line, or one beside the lines."""
    at, gate = f["refused_at"], f["settings"]["gate"]
    if worst > gate * gate:
        if (period - at[slot]) * PERIOD > LATELY:
            f["leapt"][slot] = 1.0 if worst > LEAPT * gate * gate and _helped_lately(f, slot, period) else 0.0
        at[slot] = period
        return False
    if (period - at[slot]) * PERIOD > LATELY:
        f["leapt"][slot] = 0.0
    return bool((period - at[slot]) * PERIOD > MISTRUSTED_TIME)


@kernel
def _helped_lately(f: Kept, slot: int, period: int) -> bool:
    """Whether the instrument of a slot was right just before."""
    beside = GNSS if slot == SATELLITE_VELOCITY else MOTION_CAPTURE
    line = slot if slot < LINES else beside - FIRST_LINE
    return bool((period - f["fused_at"][line]) * PERIOD < JUST_BEFORE)


@subroutine
def _note(f: Kept, line: int, period: int, worst: float, total: float, scalars: int, fused: bool) -> bool:
    """Note how well a reading agreed; whether it was fused."""
    f["ratio"][line] = worst
    f["squares"][line] += total
    f["scalars"][line] += scalars
    gate = f["settings"]["gate"]
    if worst <= gate * gate:
        f["refused_since"][line] = -1.0
        f["fused_at"][line] = period if fused else f["fused_at"][line]
        return fused
    if f["refused_since"][line] < 0.0:
        f["refused_since"][line] = period
    return False


@subroutine
def _correct_belief(f: Kept) -> None:
    """Take the estimated errors out of the belief."""
    errors = f["errors"]
    turn = Vector(errors[ATTITUDE_ERROR], errors[ATTITUDE_ERROR + 1], errors[ATTITUDE_ERROR + 2])
    if turn.x != 0.0 or turn.y != 0.0 or turn.z != 0.0:
        turn_errors(f["covariance"], f["settings"]["states"], turn)
    put_belief(f, 0, corrected(get_belief(f, 0), f["errors"]))


@subroutine
def _fuse_vector(
    f: Kept, line: int, slot: int, period: int, first: int, other: int, innovation: Vector, level: float, up: float
) -> bool:
    """Correct by three scalars, each the sum of two errors; by none if one of them does not fit.

    Args:
        f: The filter.
        line: Of the instrument.
        slot: Where it is noted that it was refused: the line, or SATELLITE_VELOCITY.
        period: Of the reading.
        first: First of the three errors that the reading shows.
        other: First of three more, or NO_OTHER.
        innovation: Of the three.
        level: Variance of the first two.
        up: Variance of the third.
    """
    worst = total = 0.0
    for axis in range(3):
        _sum_of_errors(f["H"], first + axis, other + axis if other != NO_OTHER else NO_OTHER)
        ratio = _surprise(f, _part(innovation, axis), up if axis == 2 else level)
        worst, total = max(worst, ratio), total + ratio
    fits = _fits(f, slot, period, worst)
    if fits:
        worst = total = 0.0
        for axis in range(3):
            _sum_of_errors(f["H"], first + axis, other + axis if other != NO_OTHER else NO_OTHER)
            ratio = _fuse(f, 0, _part(innovation, axis), up if axis == 2 else level)
            worst, total = max(worst, ratio), total + ratio
        _correct_belief(f)
    return _note(f, line, period, worst, total, 3, fits)


@kernel
def _part(value: Vector, axis: int) -> float:
    return value.x if axis == 0 else (value.y if axis == 1 else value.z)


@kernel
def _sum_of_errors(H: Array, first: int, other: int) -> None:
    H[first] = 1.0
    if other != NO_OTHER:
        H[other] = 1.0


@subroutine
def observe_satellites(f: Kept, i: Kept, reading: Array, age: float, period: int) -> bool:
    """Position and velocity of the satellite receiver; ``age`` is how long before the horizon they were read [s]."""
    b, spec = get_belief(f, 0), get_specification(i, 0).gnss
    there = add(add_scaled(b.position, b.velocity, -age), b.gnss_drift)
    moved = subtract(vector_at(reading, 0), there)
    level, up = spec.noise_level * spec.noise_level, spec.noise_up * spec.noise_up
    line = GNSS - FIRST_LINE
    since = f["refused_since"][line]
    fits = _fuse_vector(f, line, line, period, POSITION_ERROR, GNSS_DRIFT_ERROR, moved, level, up)
    refused = f["refused_since"][line] >= 0.0
    b = get_belief(f, 0)
    faster = subtract(vector_at(reading, 3), b.velocity)
    level, up = spec.velocity_noise_level * spec.velocity_noise_level, spec.velocity_noise_up * spec.velocity_noise_up
    fits = _fuse_vector(f, line, SATELLITE_VELOCITY, period, VELOCITY_ERROR, NO_OTHER, faster, level, up) and fits
    _refuse_as_one(f, line, refused, since, period)
    return fits


@subroutine
def _refuse_as_one(f: Kept, line: int, refused: bool, since: float, period: int) -> None:
    """Count a reading as refused of which the first part was, or the second.

    Args:
        f: The filter.
        line: Of the instrument.
        refused: Whether the first part was.
        since: Since when its readings were refused before this one.
        period: Of the reading.
    """
    if refused or f["refused_since"][line] >= 0.0:
        f["refused_since"][line] = since if since >= 0.0 else period


@subroutine
def observe_height(f: Kept, i: Kept, reading: Array, age: float, period: int) -> None:
    """The barometer's height."""
    b, spec, H = get_belief(f, 0), get_specification(i, 0).barometer, f["H"]
    P, through = f["covariance"], subtract(b.velocity, b.wind)
    square = dot(through, through) + P[WIND_ERROR, WIND_ERROR] + P[WIND_ERROR + 1, WIND_ERROR + 1]
    head = square / (2.0 * get_model(f, 0).g)  # the dynamic pressure, as a height
    innovation = reading[0] - (b.position.z - age * b.velocity.z + b.barometer_drift - b.static_port * head)
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    _sum_of_errors(H, POSITION_ERROR + 2, BAROMETER_DRIFT_ERROR)
    H[STATIC_PORT_ERROR] = -head
    ratio = _surprise(f, innovation, variance)
    fits = _fits(f, BAROMETER - FIRST_LINE, period, ratio)
    if fits:
        _sum_of_errors(H, POSITION_ERROR + 2, BAROMETER_DRIFT_ERROR)
        H[STATIC_PORT_ERROR] = -head
        ratio = _fuse(f, 0, innovation, variance)
        _correct_belief(f)
    _note(f, BAROMETER - FIRST_LINE, period, ratio, ratio, 1, fits)


@subroutine
def observe_field(f: Kept, i: Kept, reading: Array, age: float, rates: Vector, period: int) -> None:
    """The magnetic field, by the body's axes; ``rates`` are the body's at the horizon [rad/s]."""
    b, spec = get_belief(f, 0), get_specification(i, 0).magnetometer
    earth = Vector(spec.field_north, spec.field_west, spec.field_up)
    q = multiply(b.attitude, small_rotation(scaled(rates, -age)))
    field = rotate_inverse(q, earth)
    innovation = subtract(vector_at(reading, 0), add(field, b.magnetic_bias))
    variance = spec.noise * spec.noise + spec.step * spec.step / 12.0
    worst = total = 0.0
    for k in range(3):
        _field_along(f["H"], k, field)
        ratio = _surprise(f, _part(innovation, k), variance)
        worst, total = max(worst, ratio), total + ratio
    fits = _fits(f, MAGNETOMETER - FIRST_LINE, period, worst)
    if fits:
        worst = total = 0.0
        for k in range(3):
            _field_along(f["H"], k, field)
            ratio = _fuse(f, 0, _part(innovation, k), variance)
            worst, total = max(worst, ratio), total + ratio
        _correct_belief(f)
    _note(f, MAGNETOMETER - FIRST_LINE, period, worst, total, 3, fits)


@subroutine
def _field_along(H: Array, k: int, field: Vector) -> None:
    """The derivative of the field along the body's axis ``k``, which has a bias of its own."""
    axis = Vector(1.0 if k == 0 else 0.0, 1.0 if k == 1 else 0.0, 1.0 if k == 2 else 0.0)
    _set(H, ATTITUDE_ERROR, cross(axis, field))
    _set(H, MAGNETIC_BIAS_ERROR, axis)


@subroutine
def observe_pose(f: Kept, line: int, reading: Array, age: float, rates: Vector, period: int) -> bool:
    """Position and, where it has one, attitude from motion capture or from outside."""
    b = get_belief(f, 0)
    there = add_scaled(b.position, b.velocity, -age)
    moved, variance = subtract(vector_at(reading, 0), there), reading[POSITION_VARIANCE]
    since = f["refused_since"][line]
    fits = _fuse_vector(f, line, line, period, POSITION_ERROR, NO_OTHER, moved, variance, variance)
    refused = f["refused_since"][line] >= 0.0
    if reading[HAS_ATTITUDE] == 0.0:
        return fits
    b = get_belief(f, 0)
    q = multiply(multiply(b.attitude, small_rotation(scaled(rates, -age))), small_rotation(b.misalignment))
    off = multiply(conjugate(q), Quaternion(reading[3], reading[4], reading[5], reading[6]))
    twice = 2.0 if off.w >= 0.0 else -2.0
    turn, variance = Vector(twice * off.x, twice * off.y, twice * off.z), reading[ATTITUDE_VARIANCE]
    fits = (
        _fuse_vector(f, line, POSE_ATTITUDE, period, ATTITUDE_ERROR, MISALIGNMENT_ERROR, turn, variance, variance)
        and fits
    )
    _refuse_as_one(f, line, refused, since, period)
    return fits


@subroutine
def observe_airspeed(f: Kept, i: Kept, reading: Array, period: int) -> None:
    """The pitot's airspeed, which tells of the wind alone: a wrong tube shall not move the vehicle."""
    b, gains, H = get_belief(f, 0), get_wind_settings(f, 0), f["H"]
    # Of a speed near the threshold only what noise made large would be used, so what is believed decides as well.
    if reading[0] <= (0.0 if f["tube"] > gains.min_pitot else gains.min_pitot + TUBE_DEAD):
        return
    nose = rotate(b.attitude, Vector(1.0, 0.0, 0.0))
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    spec = get_specification(i, 0).pitot
    innovation, variance = reading[0] - f["tube"] - b.tube_bias, spec.noise * spec.noise + spec.step * spec.step / 12.0
    _forgive(f, period)
    _speed_along(H, nose, v_b)
    ratio = _surprise(f, innovation, variance)
    fits = _follows(f, reading[0], innovation, period) and _fits(f, PITOT - FIRST_LINE, period, ratio)
    if fits:
        _speed_along(H, nose, v_b)
        ratio = _fuse(f, WIND_ERROR, innovation, variance)
        _correct_belief(f)
        turn_tube(f, b, get_belief(f, 0))
    _note(f, PITOT - FIRST_LINE, period, ratio, ratio, 1, fits)


@subroutine
def _follows(f: Kept, speed: float, innovation: float, period: int) -> bool:
    """Whether the tube may be believed: the air in it is slow, and what has leapt is doubted until it is near again.

    The wind may be anything, so the gate alone would let a wrong tube through.
    """
    at, line = f["refused_at"], PITOT - FIRST_LINE
    before = f["before"][line, 0]
    leaps = before > 0.0 and abs(speed - before) > TUBE_LEAP
    if leaps or (abs(innovation) > TUBE_LEAP and (period - at[line]) * PERIOD <= TUBE_DOUBTED):
        at[line] = period
        return False
    return True


@subroutine
def _forgive(f: Kept, period: int) -> None:
    """Forget the wind where the tube has long been refused, and neither it nor the belief came nearer."""
    since, line = f["refused_since"], PITOT - FIRST_LINE
    if since[line] < 0.0 or (period - since[line]) * PERIOD < TUBE_FORGIVEN:
        return
    unknown = get_wind_settings(f, 0).max_deviation
    restart(f["covariance"], WIND_ERROR, unknown * unknown)
    restart(f["covariance"], STEADY_WIND_ERROR, unknown * unknown)
    since[line], f["refused_at"][line] = -1.0, period - TUBE_DOUBTED / PERIOD - 1.0


@subroutine
def _speed_along(H: Array, nose: Vector, v_b: Vector) -> None:
    """The derivative of the airspeed along the nose."""
    _set(H, VELOCITY_ERROR, nose)
    _set(H, WIND_ERROR, scaled(nose, -1.0))
    _set(H, ATTITUDE_ERROR, cross(Vector(1.0, 0.0, 0.0), v_b))
    H[TUBE_ERROR] = 1.0


@subroutine
def observe_wing(f: Kept, step: Step, has_tube: bool, vibration: float) -> None:
    """The force across the wing, which tells of the wind alone: a wrong model shall not move the vehicle.

    The share of it that the model lacks is considered and never estimated: the wind that is believed explains what
    is felt, and is as uncertain as the model makes it.

    Args:
        f: The filter.
        step: The slow step.
        has_tube: Whether there is a pitot that may be believed.
        vibration: Of the accelerometer, by a propeller at REFERENCE_SPEED [m/s2].
    """
    b, a, H = get_belief(f, 0), get_model(f, 0), f["H"]
    v_b = rotate_inverse(b.attitude, subtract(b.velocity, b.wind))
    deviations = body_deviations(f["covariance"], b.attitude)
    told = told_by_wing(v_b, deviations, b.gyro_bias, step, a)
    # The wing tells the product of speed and incidence: unchecked by a tube, gusts would be taken for speed. Along the
    # span a wind of either sign does the same.
    is_checked = has_tube and v_b.x > get_wind_settings(f, 0).min_pitot
    slope = Vector(told.slope.x if is_checked else 0.0, 0.0, told.slope.z)
    ahead, aside = (told.slope.x - slope.x) * deviations.x, told.slope.y * deviations.y
    misread = told.bend + ahead * ahead + aside * aside + WING_LACKS * WING_LACKS
    by_wind = rotate(b.attitude, slope)
    _set(H, WIND_ERROR, scaled(by_wind, -1.0))
    _set(H, VELOCITY_ERROR, by_wind)
    _set(H, ATTITUDE_ERROR, cross(slope, v_b))
    H[ACCEL_BIAS_ERROR + 2] = 1.0
    H[WING_ERROR] = told.mean
    push = 1.0 / surprise(f["covariance"], H, f["settings"]["states"], 1.0, misread)
    f["air_doubt"] = math.sqrt(push)
    if f["on_ground"]:  # what holds the wing there is not the air alone
        H[:] = 0.0
        return
    innovation = step.force.z - b.accel_bias.z - told.mean
    noise = WING_NOISE * WING_NOISE + shaken(step.actuators, vibration)
    f["squares"][WING] += innovation * innovation / (push + noise)
    f["scalars"][WING] += 1.0
    # What an unknown wind along nose and span does to the force lasts: as noise it counts for as much longer.
    lasting = (misread - WING_LACKS * WING_LACKS) * UNKNOWN_TIME / SLOW_STEP
    _fuse(f, WIND_ERROR, innovation, noise + lasting + WING_DOUBT * WING_DOUBT)
    _correct_belief(f)
    turn_tube(f, b, get_belief(f, 0))


@kernel
def nose_wind_fading(b: Belief, time: float) -> Belief:
    """The belief with the wind along the nose a slow step nearer to calm: without a tube nothing tells it."""
    nose = rotate(b.attitude, Vector(1.0, 0.0, 0.0))
    wind = add_scaled(b.wind, nose, -dot(b.wind, nose) * SLOW_STEP / time)
    return with_wind(b, wind)
