"""The instruments that read now and then, and late: satellites, magnetic field, pressures, motion capture."""

from __future__ import annotations

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped, decay, rounded
from sitl.model.quaternions import multiply, rotate, rotate_inverse, small_rotation
from sitl.model.state import Plant
from sitl.model.vectors import Vector, add, add_scaled, cross, dot, scaled, subtract
from sitl.sensors.draws import Timing, is_time, vector_at
from sitl.sensors.instruments import (
    ATTITUDE_VARIANCE,
    BAROMETER,
    BAROMETER_NOISE,
    DELAYED,
    DROPOUT,
    FIRST_DELAYED,
    GARBAGE,
    GNSS,
    GNSS_POSITION_NOISE,
    GNSS_VELOCITY_NOISE,
    HAS_ATTITUDE,
    INTERMITTENT,
    JITTER,
    MAGNETIC_NOISE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    OFF,
    PITOT,
    PITOT_NOISE,
    POSE_ATTITUDE_NOISE,
    POSE_DROPOUT,
    POSE_JITTER,
    POSE_POSITION_NOISE,
    POSITION_VARIANCE,
    STANDARD_GRAVITY,
    STUCK,
    TOO_SLOW,
    HiddenErrors,
    Instruments,
    MotionCapture,
    Pitot,
    send,
    speed_before_tube,
)
from sitl.sensors.misreadings import Misreading, error_of, misreading
from sitl.storage import value_of

SLOWED = 10.0  # a slow instrument reads so many times less often
EXTRA_DELAY = 0.3  # of a delayed instrument, beyond its own [s]
FLICKER = 1.0  # an intermittent instrument works and fails in turns of so long [s]
GARBAGE_PLACE, GARBAGE_SPEED, GARBAGE_HEIGHT = 30.0, 10.0, 20.0  # at random [m], [m/s], [m]
WRONG_PLACE, WRONG_HEIGHT, WRONG_AIRSPEED = 8.0, 5.0, 6.0  # [m], [m], [m/s]
WRONG_POSE, WRONG_TURN = 0.5, 0.5  # [m], [rad]
WRONG_FIELD = 2e-5  # [T]
DRIFT_PLACE, DRIFT_HEIGHT, DRIFT_AIRSPEED, DRIFT_POSE = 0.5, 0.5, 0.5, 0.1  # [m/s], [m/s], [m/s2], [m/s]
DRIFT_FIELD, DRIFT_TURN = 1e-6, 0.02  # [T/s], [rad/s]


@kernel
def reads(period: int, timing: Timing, failure: float, dropout: float, dt: float) -> bool:
    """Whether a reading is made that will arrive.

    Args:
        period: The control period.
        timing: Of the instrument.
        failure: Of the instrument.
        dropout: Uniform draw from 0 to 1 that decides whether it is lost.
        dt: Control period [s].
    """
    rate = timing.rate / SLOWED if failure == TOO_SLOW else timing.rate
    works = failure != OFF and not (failure == INTERMITTENT and int(period * dt / FLICKER) % 2 == 1)
    return works and is_time(period, rate, dt) and dropout >= timing.dropout


@kernel
def is_lost(was: bool, spec: MotionCapture, drawn: float) -> bool:
    """Whether a pose is lost, by Gilbert's two states: what is lost comes in bursts of geometric length, if any.

    Args:
        was: Whether the one before was.
        spec: Of the cameras.
        drawn: Uniform from 0 to 1.
    """
    share = spec.timing.dropout
    if spec.burst == 0.0 or share >= 1.0:
        return drawn < share
    found = min(1.0, 1.0 / max(spec.burst * spec.timing.rate, 1.0))
    return drawn >= found if was else drawn < found * share / (1.0 - share)


@kernel
def arrival(period: int, timing: Timing, failure: float, jitter: float, dt: float) -> int:
    """Control period in which a reading of now arrives."""
    late = timing.delay + abs(jitter) * timing.jitter + (EXTRA_DELAY if failure == DELAYED else 0.0)
    return period + int(rounded(late / dt))


@subroutine
def read_tube(i: Instruments, period: int, draws: Array, dt: float) -> None:
    """The pitot tube at the end of a control period; arguments as for :func:`read_outdoors`."""
    timing = value_of(i.specification.pitot.timing)
    if reads(period, timing, i.failures[PITOT], draws[DROPOUT + 3], dt):
        _read_airspeed(i, draws, misreading(i, PITOT, period, dt))
        _dispatch(i, PITOT, period, timing, draws[JITTER + 3], dt)


@subroutine
def read_outdoors(i: Instruments, period: int, plant: Plant, wind: Vector, draws: Array, dt: float) -> None:
    """Magnetometer, barometer and satellite receiver at the end of a control period.

    Args:
        i: The instruments, a record.
        period: The control period.
        plant: As it is.
        wind: Velocity of the air, world NWU [m/s].
        draws: Of the slow step; see :mod:`sitl.sensors.instruments`.
        dt: Control period [s].
    """
    spec, failures = value_of(i.specification), i.failures
    timing = spec.magnetometer.timing
    if reads(period, timing, failures[MAGNETOMETER], draws[DROPOUT], dt):
        _read_field(i, plant, draws, misreading(i, MAGNETOMETER, period, dt))
        _dispatch(i, MAGNETOMETER, period, timing, draws[JITTER], dt)
    timing = spec.barometer.timing
    through = rotate_inverse(plant.body.attitude, subtract(plant.body.velocity, wind))
    if reads(period, timing, failures[BAROMETER], draws[DROPOUT + 1], dt):
        _read_height(i, plant, dot(through, through), draws, misreading(i, BAROMETER, period, dt))
        _dispatch(i, BAROMETER, period, timing, draws[JITTER + 1], dt)
    timing = spec.gnss.timing
    if reads(period, timing, failures[GNSS], draws[DROPOUT + 2], dt):
        _read_satellites(i, plant, draws, misreading(i, GNSS, period, dt))
        _dispatch(i, GNSS, period, timing, draws[JITTER + 2], dt)


@subroutine
def _dispatch(i: Instruments, instrument: int, period: int, timing: Timing, jitter: float, dt: float) -> None:
    send(instrument - FIRST_DELAYED, i, period, arrival(period, timing, i.failures[instrument], jitter, dt))


@kernel
def _store(i: Instruments, instrument: int, first: int, value: Vector) -> None:
    last = i.last
    line = instrument - FIRST_DELAYED
    last[line, first], last[line, first + 1], last[line, first + 2] = value.x, value.y, value.z


@subroutine
def _read_field(i: Instruments, plant: Plant, draws: Array, wrong: Misreading) -> None:
    """The magnetic field in the body frame."""
    spec, errors, failure = value_of(i.specification.magnetometer), value_of(i.errors), i.failures[MAGNETOMETER]
    if failure == STUCK:
        return
    noise = vector_at(draws, MAGNETIC_NOISE)
    earth = Vector(spec.field_north, spec.field_west, spec.field_up)
    field = add(rotate_inverse(plant.body.attitude, earth), errors.magnetic_bias)
    field = add_scaled(field, noise, spec.noise)
    if failure == GARBAGE:
        field = scaled(noise, 1e-4)
    error = error_of(wrong, WRONG_FIELD, DRIFT_FIELD)
    field = add(scaled(field, wrong.factor), Vector(0.0, error, error))
    step, most = spec.step, spec.range
    _store(
        i,
        MAGNETOMETER,
        0,
        Vector(
            step * rounded(clipped(field.x, -most, most) / step),
            step * rounded(clipped(field.y, -most, most) / step),
            step * rounded(clipped(field.z, -most, most) / step),
        ),
    )


@subroutine
def _read_height(i: Instruments, plant: Plant, square: float, draws: Array, wrong: Misreading) -> None:
    """The barometer's height; ``square`` is the airspeed's [m2/s2]."""
    spec, errors, failure = value_of(i.specification.barometer), value_of(i.errors), i.failures[BAROMETER]
    if failure == STUCK:
        return
    noise = draws[BAROMETER_NOISE]
    height = plant.body.position.z + errors.barometer_drift
    height += spec.noise * noise - spec.position_error * square / (2.0 * STANDARD_GRAVITY)
    height = height * wrong.factor + error_of(wrong, WRONG_HEIGHT, DRIFT_HEIGHT)
    height = GARBAGE_HEIGHT * noise if failure == GARBAGE else height
    i.last[BAROMETER - FIRST_DELAYED, 0] = spec.step * rounded(height / spec.step)


@subroutine
def _read_satellites(i: Instruments, plant: Plant, draws: Array, wrong: Misreading) -> None:
    """Position and velocity of the antenna."""
    spec, errors, failure = value_of(i.specification.gnss), value_of(i.errors), i.failures[GNSS]
    if failure == STUCK:
        return
    noise, other = vector_at(draws, GNSS_POSITION_NOISE), vector_at(draws, GNSS_VELOCITY_NOISE)
    q, arm = plant.body.attitude, add(value_of(i.specification.mounting.antenna), errors.antenna_arm)
    place, swung = add(plant.body.position, rotate(q, arm)), rotate(q, cross(plant.body.rates, arm))
    place, velocity = add(place, errors.gnss_drift), add(plant.body.velocity, swung)
    if spec.noise_time > 0.0:
        place, velocity = add(place, errors.gnss_noise), add(velocity, errors.gnss_velocity_noise)
    else:
        level, up = spec.noise_level, spec.noise_up
        place = add(place, Vector(level * noise.x, level * noise.y, up * noise.z))
        level, up = spec.velocity_noise_level, spec.velocity_noise_up
        velocity = add(velocity, Vector(level * other.x, level * other.y, up * other.z))
    error = error_of(wrong, WRONG_PLACE, DRIFT_PLACE)
    place, velocity = add(scaled(place, wrong.factor), Vector(error, error, error)), scaled(velocity, wrong.factor)
    if failure == GARBAGE:
        place, velocity = scaled(noise, GARBAGE_PLACE), scaled(other, GARBAGE_SPEED)
    _store(i, GNSS, 0, place)
    _store(i, GNSS, 3, velocity)


@subroutine
def _read_airspeed(i: Instruments, draws: Array, wrong: Misreading) -> None:
    """The pitot's airspeed; 0 where it is too slow to tell."""
    spec, errors, failure = value_of(i.specification.pitot), value_of(i.errors), i.failures[PITOT]
    if failure == STUCK:
        return
    speed = errors.tube_speed + errors.pitot_bias + spec.noise * draws[PITOT_NOISE]
    speed = speed * wrong.factor + error_of(wrong, WRONG_AIRSPEED, DRIFT_AIRSPEED)
    speed = spec.range * abs(draws[PITOT_NOISE]) if failure == GARBAGE else speed
    speed = spec.step * rounded(min(speed, spec.range) / spec.step)
    i.last[PITOT - FIRST_DELAYED, 0] = speed if speed > spec.min_speed else 0.0


@kernel
def tube_speed_after(errors: HiddenErrors, plant: Plant, wind: Vector, a: Airframe, spec: Pitot, dt: float) -> float:
    """Reading of the tube's diaphragm a period later: the air ahead and a share of the slipstream, lagged [m/s]."""
    along = rotate_inverse(plant.body.attitude, subtract(plant.body.velocity, wind)).x
    felt = speed_before_tube(along, plant.actuators, a, spec)
    return errors.tube_speed + (1.0 - decay(dt / spec.lag)) * (felt - errors.tube_speed)


@subroutine
def read_pose(i: Instruments, period: int, plant: Plant, draws: Array, dt: float) -> None:
    """Motion capture at the end of a control period.

    Args:
        i: The instruments, a record.
        period: The control period.
        plant: As it is.
        draws: Of the period; see :mod:`sitl.sensors.instruments`.
        dt: Control period [s].
    """
    spec, failure = value_of(i.specification.motion_capture), i.failures[MOTION_CAPTURE]
    timing = spec.timing
    if not reads(period, timing, failure, 1.0, dt):
        return
    i.lost[0] = is_lost(i.lost[0] > 0.0, spec, draws[POSE_DROPOUT])
    if i.lost[0] > 0.0:
        return
    if failure != STUCK:
        _store_pose(i, plant, draws, misreading(i, MOTION_CAPTURE, period, dt))
    _dispatch(i, MOTION_CAPTURE, period, timing, draws[POSE_JITTER], dt)


@subroutine
def _store_pose(i: Instruments, plant: Plant, draws: Array, wrong: Misreading) -> None:
    spec, errors, failure = value_of(i.specification.motion_capture), value_of(i.errors), i.failures[MOTION_CAPTURE]
    noise, other = vector_at(draws, POSE_POSITION_NOISE), vector_at(draws, POSE_ATTITUDE_NOISE)
    place = add_scaled(plant.body.position, noise, spec.noise)
    q = multiply(plant.body.attitude, small_rotation(add_scaled(errors.misalignment, other, spec.attitude_noise)))
    off, turn = error_of(wrong, WRONG_POSE, DRIFT_POSE), error_of(wrong, WRONG_TURN, DRIFT_TURN)
    place = add(scaled(place, wrong.factor), Vector(off, off, 0.0))
    if turn != 0.0:
        q = multiply(q, small_rotation(Vector(turn, 0.0, 0.0)))
    if failure == GARBAGE:
        place, q = scaled(noise, GARBAGE_PLACE), multiply(q, small_rotation(other))
    place = Vector(
        spec.step * rounded(place.x / spec.step),
        spec.step * rounded(place.y / spec.step),
        spec.step * rounded(place.z / spec.step),
    )
    _store(i, MOTION_CAPTURE, 0, place)
    last = i.last
    line = MOTION_CAPTURE - FIRST_DELAYED
    last[line, 3], last[line, 4], last[line, 5], last[line, 6] = q.w, q.x, q.y, q.z
    last[line, POSITION_VARIANCE] = spec.noise * spec.noise
    last[line, ATTITUDE_VARIANCE] = spec.attitude_noise * spec.attitude_noise
    last[line, HAS_ATTITUDE] = 1.0
