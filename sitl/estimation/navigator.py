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
    ATTITUDE_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
    WIND_ERROR,
    Belief,
    with_attitude,
    with_position,
    with_velocity,
)
from sitl.estimation.filter import (
    MAX_HORIZON,
    RUNNING,
    SLOW_STEP,
    Step,
    get_ahead,
    get_belief,
    get_believed_actuators,
    get_filling,
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
    nose_wind_fading,
    observe_airspeed,
    observe_field,
    observe_height,
    observe_pose,
    observe_satellites,
    observe_wing,
)
from sitl.estimation.strapdown import increment_of, joined, moved_by, no_increment, rebiased, without
from sitl.model.actuators import moved
from sitl.model.arithmetic import decay
from sitl.model.quaternions import Quaternion, rotate
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, scaled, subtract
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
    Inertial,
    drop,
    get_inertial,
)
from sitl.storage import Kept
from sitl.timing import PERIOD

SMOOTHING_TIME = 0.004  # of the body rates and the velocity given to the laws [s]
ACCELERATION_TIME = 0.03  # of the acceleration [s]
REFUSED_TIME = 1.5  # readings refused for so long are right, and the filter is wrong [s]
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
    inertial = get_inertial(i, 0)
    actuators = moved(get_believed_actuators(f, 0), wanted, PERIOD, get_model(f, 0))
    put_believed_actuators(f, 0, actuators)
    if f["phase"] == RUNNING:
        _gather(f, inertial, actuators)
        if period % SLOW_PERIODS == 0:
            _slow_step(f, i, steps, period, has_tube)
    else:
        align(f, i, inertial)
        for line in range(LINES):
            i["waiting"][line] = min(i["waiting"][line], 1.0)
    return _estimate(f, i, period)


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
    observe_wing(f, oldest, has_tube)
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
                _fuse(f, i, line, at, (horizon - sampled) * PERIOD, period, step)
            drop(line, i)


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
        if not observe_satellites(f, i, reading, age, period) and _is_wrong(f, line, period):
            _set_place(f, reading, vector_at(reading, 3), 1.0)
            _has_been_reset(f, line, period)
    elif not observe_pose(f, line, reading, age, rates, period) and _is_wrong(f, line, period):
        _set_place(f, reading, get_belief(f, 0).velocity, 0.25)
        if reading[HAS_ATTITUDE] > 0.0:
            _set_attitude(f, Quaternion(reading[3], reading[4], reading[5], reading[6]))
        _has_been_reset(f, line, period)


@kernel
def _is_wrong(f: Kept, line: int, period: int) -> bool:
    """Whether all readings of a line have been refused for so long that they must be right."""
    since = f["refused_since"][line]
    return bool(since >= 0.0 and (period - since) * PERIOD > REFUSED_TIME)


@kernel
def _has_been_reset(f: Kept, line: int, period: int) -> None:
    f["resets"] += 1
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
def _estimate(f: Kept, i: Kept, period: int) -> Estimate:
    """Where the increments since the horizon have brought the belief, as the laws are given it."""
    b, ahead, inertial = get_belief(f, 0), get_ahead(f, 0), get_inertial(i, 0)
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
    support = contact.support_of(force, through, rates, attitude, actuators, get_model(f, 0))
    f["support"] = contact.smoothed(support, f["support"], SLOW_STEP)
    f["on_ground"] = contact.stands(f["support"], f["on_ground"], velocity, f["model"]["g"])


@kernel
def _ages(f: Kept, period: int, horizon: float) -> Ages:
    """How old the newest aid of each part is [s]."""
    at = f["fused_at"]
    place = max(at[GNSS - FIRST_LINE], at[MOTION_CAPTURE - FIRST_LINE], at[EXTERNAL_POSE - FIRST_LINE])
    since = (period - place) * PERIOD + horizon
    return Ages(since, since, PERIOD, since, PERIOD, horizon, 0.0, SLOW_STEP)
