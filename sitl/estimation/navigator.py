"""One control period of the vehicle's navigation: readings in, an estimate out.

The filter stands ``horizon`` slow steps in the past, so that what aids it has arrived when its own time comes; what
the inertial readings of the meantime add up to leads from there to now.
"""

from __future__ import annotations

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Ages, Estimate
from sitl.estimation import contact
from sitl.estimation.alignment import align
from sitl.estimation.belief import (
    ACCEL_BIAS_ERROR,
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    Belief,
    with_attitude,
    with_position,
    with_velocity,
)
from sitl.estimation.filter import (
    ALIGNING,
    MAX_HORIZON,
    RUNNING,
    SLOW_STEP,
    Step,
    get_ahead,
    get_belief,
    get_believed_actuators,
    get_filling,
    get_last,
    get_model,
    get_notch,
    get_smooth_acceleration,
    get_smooth_rates,
    get_smooth_velocity,
    get_speed_notch,
    get_step,
    get_wind_settings,
    put_ahead,
    put_belief,
    put_believed_actuators,
    put_filling,
    put_last,
    put_notch,
    put_smooth_acceleration,
    put_smooth_rates,
    put_smooth_velocity,
    put_speed_notch,
    put_step,
)
from sitl.estimation.kalman import predict, restart
from sitl.estimation.notch import notched
from sitl.estimation.observations import (
    POSE_ATTITUDE,
    SATELLITE_VELOCITY,
    TUBE_DOUBTED,
    nose_wind_fading,
    observe_airspeed,
    observe_field,
    observe_height,
    observe_pose,
    observe_satellites,
    observe_wing,
)
from sitl.estimation.oddities import FORCE_LEAP, RATES_LEAP, has_failed, oddity_after
from sitl.estimation.strapdown import increment_of, joined, moved_by, no_increment, rebiased, without
from sitl.model.actuators import moved
from sitl.model.aerodynamics import wrench
from sitl.model.arithmetic import decay
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, norm, scaled, subtract
from sitl.sensors.draws import SLOW_PERIODS, vector_at
from sitl.sensors.instruments import (
    BAROMETER,
    EXTERNAL_POSE,
    FIRST_LINE,
    GNSS,
    HAS_ATTITUDE,
    LINES,
    MAGNETOMETER,
    MOTION_CAPTURE,
    PITOT,
    READING,
    Inertial,
    drop,
    get_inertial,
    get_specification,
)
from sitl.storage import Kept
from sitl.timing import PERIOD

SMOOTHING_TIME = 0.004  # of the body rates and the velocity given to the laws [s]
ACCELERATION_TIME = 0.03  # of the acceleration [s]
REFUSED_TIME = 1.0  # readings refused for so long are right, and the filter is wrong [s]
MAX_LEAP = 5.0  # from a place to the next one that is told: what leaps farther is no place [m]
REPEATED = 4.0  # readings that repeat the one before so often in a row are those of a stuck instrument
# What the model's force lacks where it stands in for a failed accelerometer: at first, as noise, and how it changes.
MODEL_LACKS, MODEL_FORCE, MODEL_CHANGE = 1.0, 0.3, 0.3  # [m/s2], [m/s2/sqrt(Hz)], [m/s2/sqrt(s)]
NUMB_SHARE, NUMB_HASTE = 0.85, 0.3  # of the ground's support, where it is not felt, and of how fast it is smoothed
DOUBTED_TURN, DOUBTED_RATE, DOUBTED_FORCE = (
    0.3,
    0.2,
    2.0,
)  # deviations of attitude and biases then [rad], [rad/s], [m/s2]
SMALLEST_TURN = 0.05  # variance floor of an attitude that is set anew, as a deviation [rad]


@kernel
def _smoothed(value: Vector, before: Vector, time: float) -> Vector:
    return add_scaled(before, subtract(value, before), 1.0 - decay(PERIOD / time))


@subroutine
def navigate(f: Kept, i: Kept, steps: Kept, period: int, wanted: Actuators, has_tube: bool) -> Estimate:
    """The estimate at the end of a control period.

    Args:
        f: The filter, a record of :class:`~sitl.estimation.filter.Filter`.
        i: The instruments, a record, which have read.
        steps: Slow steps between the horizon and now, records of Step, (MAX_HORIZON,).
        period: Control periods flown.
        wanted: Commands in force during the period, within their limits.
        has_tube: Whether there is a pitot tube.
    """
    _judge(f, i)
    actuators = moved(get_believed_actuators(f, 0), wanted, PERIOD, get_model(f, 0))
    put_believed_actuators(f, 0, actuators)
    inertial = _believed(f, get_inertial(i, 0), actuators)
    if f["phase"] != ALIGNING:
        _gather(f, inertial, actuators)
    if f["phase"] != RUNNING:
        align(f, i, inertial, period)
    elif period % SLOW_PERIODS == 0:
        _slow_step(f, i, steps, period, has_tube)
    return _estimate(f, inertial, period)


@subroutine
def _judge(f: Kept, i: Kept) -> None:
    """Look whether gyroscope and accelerometer fail; readings without noise tell nothing of that."""
    now, before, spec = get_inertial(i, 0), get_last(f, 0), get_specification(i, 0)
    oddity, failed = f["oddity"], f["failed"]
    felt = failed[1] == 0.0
    if spec.gyroscope.noise > 0.0:
        oddity[0] = oddity_after(oddity[0], now.rates, before.rates, RATES_LEAP)
        failed[0] = has_failed(oddity[0], failed[0])
    if spec.accelerometer.noise > 0.0:
        oddity[1] = oddity_after(oddity[1], now.force, before.force, FORCE_LEAP)
        failed[1] = has_failed(oddity[1], failed[1])
    if felt and failed[1] > 0.0:  # from now on its bias is what the model lacks
        restart(f["covariance"], ACCEL_BIAS_ERROR, MODEL_LACKS * MODEL_LACKS)
    put_last(f, 0, now)


@subroutine
def _believed(f: Kept, inertial: Inertial, actuators: Actuators) -> Inertial:
    """The reading; where the accelerometer has failed, with the force that air and propellers make by the model."""
    if f["failed"][1] == 0.0:
        return inertial
    b, a = get_belief(f, 0), get_model(f, 0)
    velocity, q = get_smooth_velocity(f, 0), _attitude_now(f)
    rates = subtract(inertial.rates, b.gyro_bias)
    F, _ = wrench(rotate_inverse(q, subtract(velocity, b.wind)), rates, actuators, a)
    return Inertial(inertial.rates, scaled(F, 1.0 / a.m))


@kernel
def _attitude_now(f: Kept) -> Quaternion:
    b, ahead = get_belief(f, 0), get_ahead(f, 0)
    _, _, q = moved_by(ahead, b.position, b.velocity, b.attitude, f["model"]["g"])
    return q


@subroutine
def _gather(f: Kept, inertial: Inertial, actuators: Actuators) -> None:
    """Add a reading to what leads from the horizon to now."""
    b, step = get_belief(f, 0), get_filling(f, 0)
    now = increment_of(subtract(inertial.rates, b.gyro_bias), subtract(inertial.force, b.accel_bias), PERIOD)
    put_ahead(f, 0, joined(get_ahead(f, 0), now))
    gathered = joined(step.increment, now)
    share = PERIOD / gathered.time
    put_filling(
        f,
        0,
        Step(
            gathered,
            b.gyro_bias,
            b.accel_bias,
            add_scaled(step.force, subtract(inertial.force, step.force), share),
            add_scaled(step.rates, subtract(inertial.rates, step.rates), share),
            actuators,
        ),
    )


@subroutine
def _slow_step(f: Kept, i: Kept, steps: Kept, period: int, has_tube: bool) -> None:
    """Keep the step that is full, and take the filter a step on where enough are kept."""
    step, zero = get_filling(f, 0), Vector(0.0, 0.0, 0.0)
    put_step(steps[(f["oldest"] + f["filled"]) % MAX_HORIZON], 0, step)
    put_filling(f, 0, Step(no_increment(), zero, zero, zero, zero, step.actuators))
    f["filled"] += 1
    if f["filled"] <= f["settings"]["horizon"]:
        return
    oldest = get_step(steps[f["oldest"]], 0)
    f["oldest"] = (f["oldest"] + 1) % MAX_HORIZON
    f["filled"] -= 1
    put_ahead(f, 0, without(oldest.increment, get_ahead(f, 0)))
    _move(f, oldest)
    if f["failed"][1] == 0.0:
        observe_wing(f, oldest, has_tube and (period - f["refused_at"][PITOT - FIRST_LINE]) * PERIOD > TUBE_DOUBTED)
    if not has_tube:
        put_belief(f, 0, nose_wind_fading(get_belief(f, 0), get_wind_settings(f, 0).axial_time))
    _fuse_arrived(f, i, period - f["filled"] * SLOW_PERIODS, period, oldest)


@subroutine
def _move(f: Kept, step: Step) -> None:
    """Belief and covariance a slow step later."""
    b, settings = get_belief(f, 0), f["settings"]
    gyro, accel = subtract(b.gyro_bias, step.gyro_bias), subtract(b.accel_bias, step.accel_bias)
    i = rebiased(step.increment, gyro, accel)
    fade = settings["fade"]
    predict(f["covariance"], f["work"], settings["states"], b.attitude, i, fade, settings["spread"])
    if f["failed"][1] > 0.0:
        for k in range(3):
            f["covariance"][VELOCITY_ERROR + k, VELOCITY_ERROR + k] += MODEL_FORCE * MODEL_FORCE * SLOW_STEP
            f["covariance"][ACCEL_BIAS_ERROR + k, ACCEL_BIAS_ERROR + k] += MODEL_CHANGE * MODEL_CHANGE * SLOW_STEP
    position, velocity, attitude = moved_by(i, b.position, b.velocity, b.attitude, f["model"]["g"])
    put_belief(
        f,
        0,
        Belief(
            position,
            velocity,
            attitude,
            b.gyro_bias,
            b.accel_bias,
            scaled(b.wind, fade[WIND_ERROR]),
            b.misalignment,
            b.magnetic_bias,
            scaled(b.gnss_drift, fade[GNSS_DRIFT_ERROR]),
            b.barometer_drift * fade[BAROMETER_DRIFT_ERROR],
        ),
    )


@subroutine
def _fuse_arrived(f: Kept, i: Kept, horizon: int, period: int, step: Step) -> None:
    """Fuse all readings up to the horizon, each line in its order; what has not arrived by now is too late."""
    outdoors = f["settings"]["states"] == ERRORS
    for line in range(LINES):
        while i["waiting"][line] > 0.0:
            at = int(i["first"][line])
            sampled = i["sampled"][line, at]
            if sampled > horizon:
                break
            if i["arrives"][line, at] > period or sampled <= horizon - SLOW_PERIODS:
                f["late"][line] += 1.0
            elif outdoors or line == PITOT - FIRST_LINE or line >= MOTION_CAPTURE - FIRST_LINE:
                if not _is_repeated(f, line, i["readings"][line, at]):
                    _fuse(f, i, line, at, (horizon - sampled) * PERIOD, period, step)
                for k in range(READING):
                    f["before"][line, k] = i["readings"][line, at, k]
            drop(line, i)


@subroutine
def _is_repeated(f: Kept, line: int, reading: Kept) -> bool:
    """Whether an instrument tells the same number over and over, which none does whose numbers are noisy."""
    same = line != EXTERNAL_POSE - FIRST_LINE
    for k in range(READING):
        same = same and reading[k] == f["before"][line, k]
    f["repeated"][line] = f["repeated"][line] + 1.0 if same else 0.0
    return bool(f["repeated"][line] >= REPEATED)


@subroutine
def _fuse(f: Kept, i: Kept, line: int, at: int, age: float, period: int, step: Step) -> None:
    """Fuse one reading."""
    reading = i["readings"][line, at]
    instrument = line + FIRST_LINE
    rates = subtract(step.rates, get_belief(f, 0).gyro_bias)
    if instrument == MAGNETOMETER:
        observe_field(f, i, reading, age, rates, period)
    elif instrument == BAROMETER:
        observe_height(f, i, reading, age, period)
    elif instrument == PITOT:
        observe_airspeed(f, i, reading, period)
    elif instrument == GNSS:
        if not observe_satellites(f, i, reading, age, period) and _is_wrong(f, line, reading, period):
            _set_place(f, reading, vector_at(reading, 3), 1.0)
            _has_been_reset(f, line, period)
    elif not observe_pose(f, line, reading, age, rates, period) and _is_wrong(f, line, reading, period):
        _set_place(f, reading, get_belief(f, 0).velocity, 0.25)
        _has_been_reset(f, line, period)
        if reading[HAS_ATTITUDE] > 0.0:
            _set_attitude(f, Quaternion(reading[3], reading[4], reading[5], reading[6]))


@subroutine
def _is_wrong(f: Kept, line: int, reading: Kept, period: int) -> bool:
    """Whether readings that agree among themselves were all refused for so long that they must be right."""
    since = f["refused_since"][line]
    beside = SATELLITE_VELOCITY if line == GNSS - FIRST_LINE else POSE_ATTITUDE
    if since < 0.0 or f["leapt"][line] > 0.0 or f["leapt"][beside] > 0.0:
        return False
    leap = norm(subtract(vector_at(reading, 0), vector_at(f["before"][line], 0)))
    if leap > MAX_LEAP:
        f["refused_since"][line] = period
        return False
    return bool((period - since) * PERIOD > REFUSED_TIME)


@kernel
def _has_been_reset(f: Kept, line: int, period: int) -> None:
    """Note it, and doubt what has led the belief astray: attitude and inertial biases."""
    f["resets"] += 1
    restart(f["covariance"], ATTITUDE_ERROR, DOUBTED_TURN * DOUBTED_TURN)
    restart(f["covariance"], GYRO_BIAS_ERROR, DOUBTED_RATE * DOUBTED_RATE)
    restart(f["covariance"], ACCEL_BIAS_ERROR, DOUBTED_FORCE * DOUBTED_FORCE)
    f["refused_since"][line] = -1.0
    f["fused_at"][line] = period


@subroutine
def _set_place(f: Kept, reading: Kept, velocity: Vector, variance: float) -> None:
    """Take position and velocity from a reading."""
    b = get_belief(f, 0)
    restart(f["covariance"], POSITION_ERROR, variance)
    restart(f["covariance"], VELOCITY_ERROR, variance)
    put_belief(f, 0, with_velocity(with_position(b, vector_at(reading, 0)), velocity))


@subroutine
def _set_attitude(f: Kept, q: Quaternion) -> None:
    """Take the attitude from a reading."""
    restart(f["covariance"], ATTITUDE_ERROR, SMALLEST_TURN * SMALLEST_TURN)
    put_belief(f, 0, with_attitude(get_belief(f, 0), q))


@subroutine
def _estimate(f: Kept, inertial: Inertial, period: int) -> Estimate:
    """Where the increments since the horizon have brought the belief, as the laws are given it."""
    b, ahead = get_belief(f, 0), get_ahead(f, 0)
    position, velocity, attitude = moved_by(ahead, b.position, b.velocity, b.attitude, f["model"]["g"])
    _smooth(f, velocity, subtract(inertial.rates, b.gyro_bias))
    force = subtract(inertial.force, b.accel_bias)
    felt = rotate(attitude, force)
    pulled = Vector(felt.x, felt.y, felt.z - f["model"]["g"])
    acceleration = _smoothed(pulled, get_smooth_acceleration(f, 0), ACCELERATION_TIME)
    put_smooth_acceleration(f, 0, acceleration)
    if period % SLOW_PERIODS == 0:
        _feel_ground(f, force, velocity, attitude)
    return Estimate(
        position,
        get_smooth_velocity(f, 0),
        acceleration,
        attitude,
        get_smooth_rates(f, 0),
        b.wind,
        get_believed_actuators(f, 0),
        f["on_ground"],
        _ages(f, period, ahead.time),
    )


@kernel
def _smooth(f: Kept, velocity: Vector, rates: Vector) -> None:
    """Take the propellers' vibration and the noise off velocity and body rates."""
    actuators = get_believed_actuators(f, 0)
    speed = 0.5 * (actuators.left_motor + actuators.right_motor)
    turning = notched(rates, get_notch(f, 0), speed, PERIOD)
    moving = notched(velocity, get_speed_notch(f, 0), speed, PERIOD)
    put_notch(f, 0, turning)
    put_speed_notch(f, 0, moving)
    put_smooth_rates(f, 0, _smoothed(turning.made, get_smooth_rates(f, 0), SMOOTHING_TIME))
    put_smooth_velocity(f, 0, _smoothed(moving.made, get_smooth_velocity(f, 0), SMOOTHING_TIME))


@kernel
def _feel_ground(f: Kept, force: Vector, velocity: Vector, attitude: Quaternion) -> None:
    """Judge whether the vehicle stands on something."""
    through = subtract(velocity, get_belief(f, 0).wind)
    actuators, rates = get_believed_actuators(f, 0), get_smooth_rates(f, 0)
    share, haste = 1.0, 1.0
    if (
        f["failed"][1] > 0.0
    ):  # nothing is felt: what holds a vehicle up that does not sink, of which it has to be more sure
        force, share, haste = rotate_inverse(attitude, Vector(0.0, 0.0, f["model"]["g"])), NUMB_SHARE, NUMB_HASTE
    support = share * contact.support_of(force, through, rates, attitude, actuators, get_model(f, 0))
    f["support"] = contact.smoothed(support, f["support"], SLOW_STEP * haste)
    f["on_ground"] = contact.stands(f["support"], f["on_ground"], velocity, f["model"]["g"])


@kernel
def _ages(f: Kept, period: int, horizon: float) -> Ages:
    """How old the newest aid of each part is [s]."""
    at = f["fused_at"]
    place = max(at[GNSS - FIRST_LINE], at[MOTION_CAPTURE - FIRST_LINE], at[EXTERNAL_POSE - FIRST_LINE])
    since = (period - place) * PERIOD + horizon
    return Ages(since, since, PERIOD, since, PERIOD, horizon, 0.0, SLOW_STEP)
