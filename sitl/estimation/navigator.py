"""One control period of the vehicle's navigation: readings in, an estimate out.

The filter stands ``horizon`` slow steps in the past, so that what aids it has arrived when its own time comes; what
the inertial readings of the meantime add up to leads from there to now.

An inertial instrument has failed whose readings are such as none makes that works: repeated to the last bit, or
leaping. A number with noise in it never comes again, and no vehicle starts to turn, or is pushed, within one control
period as random numbers say. What is odd is counted, and forgotten again by readings that are not.
"""

from __future__ import annotations

import math

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Estimate
from sitl.estimation.air import predict_tube, predict_wind
from sitl.estimation.air_readings import TUBE_DOUBTED, nose_wind_fading, note_corrections, observe_wing
from sitl.estimation.alignment import align
from sitl.estimation.arrivals import fuse_arrived
from sitl.estimation.doubts import loosen_doubted
from sitl.estimation.filter import (
    ALIGNING,
    MAX_HORIZON,
    RUNNING,
    SLOW_STEP,
    Filter,
    Step,
    meters_gusts,
    put_ahead,
    put_believed_actuators,
    put_filled,
    put_filling,
    put_force_notch,
    put_last,
    put_nominal,
    put_numb,
    put_oldest,
    put_step,
)
from sitl.estimation.kalman import ErrorModel, inflate_biases, inflate_turned, predict, reset_block
from sitl.estimation.nominal_state import (
    ACCEL_BIAS_ERROR,
    BAROMETER_DRIFT_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    STEADY_WIND_ERROR,
    VELOCITY_ERROR,
    NominalState,
)
from sitl.estimation.notch import notched
from sitl.estimation.observations import observe_standing
from sitl.estimation.output_predictor import estimate_now
from sitl.estimation.strapdown import increment_of, joined, moved_by, no_increment, rebiased, without
from sitl.estimation.tube_check import watch_tube
from sitl.model.actuators import moved
from sitl.model.aerodynamics import wrench
from sitl.model.quaternions import Quaternion, rotate_inverse
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add_scaled, norm, scaled, subtract
from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.instruments import FIRST_DELAYED, PITOT, Inertial, Instruments, force_by_arm
from sitl.storage import Records, value_of

# What the model's force lacks where it stands in for a failed accelerometer: at first, as noise, and how it changes.
MODEL_LACKS, MODEL_FORCE, MODEL_CHANGE = 1.0, 0.3, 0.3  # [m/s2], [m/s2/sqrt(Hz)], [m/s2/sqrt(s)]
RATES_LEAP = 3.0  # in a control period [rad/s]
FORCE_LEAP = 30.0  # likewise [m/s2]
FAILED_COUNT = 15.0  # odd readings of late, from which on the instrument has failed
MAX_FAULT_COUNT = 50.0
SHAKEN_AT = 600.0  # speed of the propellers that the settings are told for [rad/s]
FORGOTTEN = 0.2  # of an odd reading, by one that is not


@subroutine
def navigate(f: Filter, i: Instruments, steps: Records, period: int, wanted: Actuators, has_tube: bool) -> Estimate:
    """The estimate at the end of a control period.

    Args:
        f: The filter, a record of :class:`~sitl.estimation.filter.Filter`.
        i: The instruments, a record, which have read.
        steps: Slow steps between the horizon and now, records of Step, (MAX_HORIZON,).
        period: Control periods flown.
        wanted: Commands in force during the period, within their limits.
        has_tube: Whether there is a pitot tube.
    """
    read = at_centre(f, value_of(i.inertial), value_of(i.specification.mounting.imu))
    _detect_faults(f, i, period)
    actuators = moved(value_of(f.actuators), wanted, PERIOD, value_of(f.model))
    put_believed_actuators(f, actuators)
    inertial = _believed(f, read, actuators)
    if f.phase != ALIGNING:
        _accumulate(f, inertial, actuators)
    if f.phase != RUNNING:
        align(f, i, inertial, period)
    elif period % SLOW_PERIODS == 0:
        _slow_step(f, i, steps, period, has_tube)
    return estimate_now(f, inertial, period)


@kernel
def at_centre(f: Filter, now: Inertial, arm: Vector) -> Inertial:
    """A reading as it would be at the centre of mass; ``arm`` is from there to the inertial unit [m].

    The differences of the rates add up to the rates again, so their noise does not walk away with the velocity.
    """
    before, bias = value_of(f.last), value_of(f.nominal.gyro_bias)
    leap = subtract(now.rates, before.rates)
    if (arm.x == 0.0 and arm.y == 0.0 and arm.z == 0.0) or f.failed[0] > 0.0 or norm(leap) > RATES_LEAP:
        return now
    swing = force_by_arm(subtract(now.rates, bias), scaled(leap, 1.0 / PERIOD), arm)
    return Inertial(now.rates, subtract(now.force, swing))


@subroutine
def _detect_faults(f: Filter, i: Instruments, period: int) -> None:
    """Look whether gyroscope and accelerometer fail; readings without noise tell nothing of that."""
    now, before, spec = value_of(i.inertial), value_of(f.last), value_of(i.specification)
    count, failed = f.fault_count, f.failed
    felt = not f.numb
    if spec.gyroscope.noise > 0.0:
        count[0] = fault_count_after(count[0], now.rates, before.rates, RATES_LEAP)
        failed[0] = has_failed(count[0], failed[0])
    if spec.accelerometer.noise > 0.0:
        count[1] = fault_count_after(count[1], now.force, before.force, FORCE_LEAP)
        failed[1] = has_failed(count[1], failed[1])
    put_numb(f, failed[1] > 0.0 or period < f.doubted_until[1])
    if felt and f.numb:  # from now on its bias is what the model lacks
        reset_block(f.covariance, ACCEL_BIAS_ERROR, MODEL_LACKS * MODEL_LACKS)
    put_last(f, now)


@kernel
def fault_count_after(count: float, reading: Vector, before: Vector, leap: float) -> float:
    """Odd readings of late, after one more."""
    change = norm(subtract(reading, before))
    if change == 0.0 or change > leap:
        return min(count + 1.0, MAX_FAULT_COUNT)
    return max(count - FORGOTTEN, 0.0)


@kernel
def has_failed(count: float, failed: float) -> float:
    """1 while an instrument has failed; it is believed again when nothing odd is left."""
    return 1.0 if count >= FAILED_COUNT or (failed > 0.0 and count > 0.0) else 0.0


@subroutine
def _believed(f: Filter, inertial: Inertial, actuators: Actuators) -> Inertial:
    """The reading; where the accelerometer has failed, with the force that air and propellers make by the model."""
    if not f.numb:
        return inertial
    b, a = value_of(f.nominal), value_of(f.model)
    velocity, q = value_of(f.velocity), _attitude_now(f)
    rates = subtract(inertial.rates, b.gyro_bias)
    F, _ = wrench(rotate_inverse(q, subtract(velocity, b.wind)), rates, actuators, a)
    return Inertial(inertial.rates, scaled(F, 1.0 / a.m))


@kernel
def _attitude_now(f: Filter) -> Quaternion:
    b, ahead = value_of(f.nominal), value_of(f.ahead)
    _, _, q = moved_by(ahead, b.position, b.velocity, b.attitude, f.model.g)
    return q


@subroutine
def _accumulate(f: Filter, inertial: Inertial, actuators: Actuators) -> None:
    """Add a reading to what leads from the horizon to now."""
    b, step = value_of(f.nominal), value_of(f.step)
    now = increment_of(subtract(inertial.rates, b.gyro_bias), subtract(inertial.force, b.accel_bias), PERIOD)
    put_ahead(f, joined(value_of(f.ahead), now))
    gathered = joined(step.increment, now)
    share = PERIOD / gathered.time
    force = _without_vibration(f, inertial.force, actuators) if meters_gusts(f) else inertial.force
    put_filling(
        f,
        Step(
            increment=gathered,
            gyro_bias=b.gyro_bias,
            accel_bias=b.accel_bias,
            force=add_scaled(step.force, subtract(force, step.force), share),
            rates=add_scaled(step.rates, subtract(inertial.rates, step.rates), share),
            actuators=actuators,
        ),
    )


@subroutine
def _without_vibration(f: Filter, force: Vector, actuators: Actuators) -> Vector:
    """The specific force by the notch that follows the propellers: their vibration would be taken for gusts."""
    speed = 0.5 * (actuators.left_motor + actuators.right_motor)
    put_force_notch(f, notched(force, value_of(f.force_notch), speed, PERIOD))
    made: Vector = value_of(f.force_notch.made)
    return made


@subroutine
def _slow_step(f: Filter, i: Instruments, steps: Records, period: int, has_tube: bool) -> None:
    """Keep the step that is full, and take the filter a step on where enough are kept."""
    step, zero = value_of(f.step), Vector(0.0, 0.0, 0.0)
    put_step(steps[(f.oldest + f.filled) % MAX_HORIZON], step)
    put_filling(
        f,
        Step(
            increment=no_increment(), gyro_bias=zero, accel_bias=zero, force=zero, rates=zero, actuators=step.actuators
        ),
    )
    put_filled(f, f.filled + 1)
    if f.filled <= f.settings.horizon:
        return
    oldest = value_of(steps[f.oldest])
    put_oldest(f, (f.oldest + 1) % MAX_HORIZON)
    put_filled(f, f.filled - 1)
    put_ahead(f, without(oldest.increment, value_of(f.ahead)))
    _move(f, oldest, period)
    predict_tube(f, oldest, value_of(i.specification.pitot))
    # Without an accelerometer, what the model of the force lacks in its place tells of the wind.
    has_tube_now = has_tube and (period - f.refused_at[PITOT - FIRST_DELAYED]) * PERIOD > TUBE_DOUBTED
    has_tube_now = has_tube_now and f.failed[PITOT] == 0.0 and not f.numb
    observe_wing(f, oldest, has_tube_now, i.specification.accelerometer.vibration)
    watch_tube(f, oldest, has_tube, period)
    if not has_tube:
        put_nominal(f, nose_wind_fading(value_of(f.nominal), f.settings.wind.axial_time))
    fuse_arrived(f, i, period - f.filled * SLOW_PERIODS, period, oldest)
    if meters_gusts(f):
        note_corrections(f)
    observe_standing(f, period)


@kernel
def _shake(f: Filter, actuators: Actuators) -> None:
    """Set how much less sure a slow step makes the velocity: the propellers shake with the square of their speed.

    What shakes as hard but faster moves the vehicle by less speed, which is allowed for outdoors.
    """
    process_noise, settings = f.process_noise, f.settings
    moves = SHAKEN_AT / max(f.model.vibration_speed, SHAKEN_AT) if settings.states == ERRORS else 1.0
    speed = 0.5 * (actuators.left_motor + actuators.right_motor) / f.model.vibration_speed
    amplitude = speed * speed
    for k in range(VELOCITY_ERROR, VELOCITY_ERROR + 3):
        process_noise[k] = settings.process_noise[k] + settings.shaken * moves * amplitude * amplitude


@subroutine
def _move(f: Filter, step: Step, period: int) -> None:
    """Nominal state and covariance a slow step later."""
    b, settings = value_of(f.nominal), f.settings
    gyro, accel = subtract(b.gyro_bias, step.gyro_bias), subtract(b.accel_bias, step.accel_bias)
    i = rebiased(step.increment, gyro, accel)
    keep = predict_wind(f, b)
    _shake(f, step.actuators)
    decay = f.decay
    predict(f.covariance, f.work, settings.states, b.attitude, i, ErrorModel(decay, f.process_noise))
    inflate_biases(f.covariance, rotate_inverse(b.attitude, Vector(0.0, 0.0, 1.0)), SLOW_STEP)
    if settings.misaligned > 0.0:
        turned = i.rotation
        turn = 2.0 * math.sqrt(turned.x * turned.x + turned.y * turned.y + turned.z * turned.z)
        inflate_turned(f.covariance, turn, settings.misaligned, f.model.g, SLOW_STEP)
    loosen_doubted(f, period)
    if f.numb:
        for k in range(3):
            f.covariance[VELOCITY_ERROR + k, VELOCITY_ERROR + k] += MODEL_FORCE * MODEL_FORCE * SLOW_STEP
            f.covariance[ACCEL_BIAS_ERROR + k, ACCEL_BIAS_ERROR + k] += MODEL_CHANGE * MODEL_CHANGE * SLOW_STEP
    position, velocity, attitude = moved_by(i, b.position, b.velocity, b.attitude, f.model.g)
    put_nominal(
        f,
        NominalState(
            position=position,
            velocity=velocity,
            attitude=attitude,
            gyro_bias=b.gyro_bias,
            accel_bias=b.accel_bias,
            wind=add_scaled(b.steady_wind, subtract(b.wind, b.steady_wind), keep),
            misalignment=b.misalignment,
            magnetic_bias=b.magnetic_bias,
            gnss_drift=scaled(b.gnss_drift, decay[GNSS_DRIFT_ERROR]),
            barometer_drift=b.barometer_drift * decay[BAROMETER_DRIFT_ERROR],
            steady_wind=scaled(b.steady_wind, decay[STEADY_WIND_ERROR]),
            tube_bias=b.tube_bias,
            tube_speed=b.tube_speed,
            static_port=b.static_port,
        ),
    )
