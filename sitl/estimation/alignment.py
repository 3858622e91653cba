"""Alignment of the filter: attitude from gravity and the magnetic field, or from a pose; place from what aids.

On the ground it waits until the vehicle has stood still for a second. What has not stood still for three is taken to
fly: it is aligned on the mean force of its last second being upward, and roughly. What moves over the ground does not
stand still, however steadily it flies.
"""

from __future__ import annotations

import math

from sitl.compiled import kernel, subroutine
from sitl.estimation.air import feel_for_long
from sitl.estimation.filter import (
    ALIGNING,
    MAX_TIMES,
    RUNNING,
    Filter,
    Step,
    put_ahead,
    put_aligned_periods,
    put_filled,
    put_filling,
    put_mean_force,
    put_mean_rates,
    put_moved,
    put_nominal,
    put_phase,
)
from sitl.estimation.kalman import reset_block
from sitl.estimation.nominal_state import (
    ATTITUDE_ERROR,
    ERRORS,
    GNSS_DRIFT_ERROR,
    GYRO_BIAS_ERROR,
    POSITION_ERROR,
    VELOCITY_ERROR,
    NominalState,
)
from sitl.estimation.observations import antenna_place
from sitl.estimation.strapdown import moved_by, no_increment
from sitl.model.airframe import Array
from sitl.model.arithmetic import exponential
from sitl.model.quaternions import Quaternion, normalised, rotate_inverse
from sitl.model.vectors import Vector, add_scaled, cross, norm, scaled, subtract
from sitl.sensors.draws import PERIOD, vector_at
from sitl.sensors.instruments import (
    EXTERNAL_POSE,
    FIRST_DELAYED,
    GNSS,
    HAS_ATTITUDE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    N_DELAYED,
    QUEUE_LENGTH,
    Gnss,
    Inertial,
    Instruments,
    drop,
)
from sitl.storage import value_of

STILL_TIME = 1.0  # of the means [s]
STILL_PERIODS = round(STILL_TIME / PERIOD)
STANDSTILL_PATIENCE = 3.0  # what has not stood still for so long is taken to fly [s]
MAX_STILL_RATE = 0.1  # about the mean [rad/s]
MAX_STILL_FORCE = 1.5  # between the specific force and gravity [m/s2]
MAX_STILL_SPEED = 1.0  # by satellites [m/s]
FLYING_TILT = 0.3  # deviation of an attitude found in flight [rad]
FLYING_SPEED, FLYING_BIAS = 0.5, 0.02  # deviations of velocity [m/s] and gyroscope bias [rad/s] found in flight


@kernel
def attitude_from(up: Vector, field: Vector, earth: Vector) -> Quaternion:
    """Attitude from two directions in the body frame (Black's TRIAD).

    Args:
        up: The upward direction, body frame FLU; of any length.
        field: The magnetic field, body frame FLU.
        earth: The magnetic field, world NWU.
    """
    z = scaled(up, 1.0 / norm(up))
    y = cross(z, field)
    y = scaled(y, 1.0 / max(norm(y), 1e-12))
    x = cross(y, z)
    # The same two directions in the world: z is up, y is across the field's level part.
    level = math.sqrt(earth.x * earth.x + earth.y * earth.y)
    north, west = earth.x / level, earth.y / level
    # Columns of R(q): images of the body's axes.
    return _quaternion(
        Vector(north * x.x - west * y.x, west * x.x + north * y.x, z.x),
        Vector(north * x.y - west * y.y, west * x.y + north * y.y, z.y),
        Vector(north * x.z - west * y.z, west * x.z + north * y.z, z.z),
    )


@kernel
def _quaternion(x: Vector, y: Vector, z: Vector) -> Quaternion:
    """Quaternion of the rotation matrix with these columns."""
    w, i = 1.0 + x.x + y.y + z.z, 1.0 + x.x - y.y - z.z
    j, k = 1.0 - x.x + y.y - z.z, 1.0 - x.x - y.y + z.z
    most = max(w, i, j, k)
    if most == w:
        return normalised(Quaternion(w, y.z - z.y, z.x - x.z, x.y - y.x))
    if most == i:
        return normalised(Quaternion(y.z - z.y, i, y.x + x.y, z.x + x.z))
    if most == j:
        return normalised(Quaternion(z.x - x.z, y.x + x.y, j, z.y + y.z))
    return normalised(Quaternion(x.y - y.x, z.x + x.z, z.y + y.z, k))


@subroutine
def align(f: Filter, i: Instruments, inertial: Inertial, period: int) -> None:
    """One control period of alignment.

    Args:
        f: The filter, a record.
        i: The instruments, a record.
        inertial: Reading of the period.
        period: Control periods flown.
    """
    _forget_old(i, period)
    put_aligned_periods(f, f.aligned_periods + 1)
    count = f.aligned_periods
    share = 1.0 / min(count, STILL_PERIODS)
    rates, force = value_of(f.mean_rates), value_of(f.mean_force)
    rates = add_scaled(rates, subtract(inertial.rates, rates), share)
    force = add_scaled(force, subtract(inertial.force, force), share)
    put_mean_rates(f, rates)
    put_mean_force(f, force)
    moves = norm(subtract(inertial.rates, rates)) > MAX_STILL_RATE or abs(norm(force) - f.model.g) > MAX_STILL_FORCE
    waited = count * PERIOD
    if moves and waited < STANDSTILL_PATIENCE and count > 10:
        put_moved(f, count)
    still = waited - f.moved * PERIOD >= STILL_TIME
    if (still or waited >= STANDSTILL_PATIENCE) and _can_begin(f, i, period):
        _begin(f, i, still, period)


@kernel
def _forget_old(i: Instruments, period: int) -> None:
    """Leave the newest reading that has arrived at the head of every line."""
    for line in range(N_DELAYED):
        while i.waiting[line] > 1.0 and i.arrives[line, (int(i.first[line]) + 1) % QUEUE_LENGTH] <= period:
            drop(line, i)


@kernel
def _newest(i: Instruments, instrument: int) -> Array:
    line = instrument - FIRST_DELAYED
    newest: Array = i.readings[line, int(i.first[line])]
    return newest


@kernel
def _has_read(i: Instruments, instrument: int, period: int) -> bool:
    line = instrument - FIRST_DELAYED
    return bool(i.waiting[line] > 0.0 and i.arrives[line, int(i.first[line])] <= period)


@kernel
def _gives_pose(i: Instruments, instrument: int, period: int) -> bool:
    return _has_read(i, instrument, period) and bool(_newest(i, instrument)[HAS_ATTITUDE] > 0.0)


@kernel
def _source(i: Instruments, period: int) -> int:
    """The instrument that tells the place: one that gives poses, or the satellite receiver."""
    if _gives_pose(i, MOTION_CAPTURE, period):
        return MOTION_CAPTURE
    return EXTERNAL_POSE if _gives_pose(i, EXTERNAL_POSE, period) else GNSS


@kernel
def _can_begin(f: Filter, i: Instruments, period: int) -> bool:
    """Whether there is something to begin on."""
    outdoors = f.settings.states == ERRORS and _has_read(i, GNSS, period) and _has_read(i, MAGNETOMETER, period)
    return outdoors or _source(i, period) != GNSS


@subroutine
def _begin(f: Filter, i: Instruments, stands: bool, period: int) -> None:
    """Set belief and covariance, and let the filter run."""
    f.covariance[:, :] = f.settings.initial
    b, source = value_of(f.nominal), _source(i, period)
    line = source - FIRST_DELAYED
    still = stands and f.phase == ALIGNING  # a filter that is restarted may be in a hover as steady as the ground
    _, velocity, _ = moved_by(value_of(f.ahead), b.position, b.velocity, b.attitude, f.model.g)
    reading = _newest(i, source)
    place = vector_at(reading, 0)
    if source != GNSS:
        q = Quaternion(reading[3], reading[4], reading[5], reading[6])
    else:
        velocity = vector_at(reading, 3)
        still = still and norm(velocity) < MAX_STILL_SPEED
        age = (period - i.sampled[line, int(i.first[line])]) * PERIOD
        place = place if still else add_scaled(place, velocity, age)
        spec = value_of(i.specification.magnetometer)
        earth = Vector(spec.field_north, spec.field_west, spec.field_up)
        q = attitude_from(value_of(f.mean_force), vector_at(_newest(i, MAGNETOMETER), 0), earth)
        place = subtract(place, antenna_place(q, i))
    if not still:
        _doubt_flying(f.covariance, source == GNSS)
    if source == GNSS and i.specification.gnss.noise_time > 0.0:
        _doubt_drifted(f, value_of(i.specification.gnss), period * PERIOD)
    velocity = velocity if not still else Vector(0.0, 0.0, 0.0)
    put_nominal(f, _first_belief(b, place, velocity, q, value_of(f.mean_rates) if still else b.gyro_bias))
    feel_for_long(f)
    _run(f, i, line, period)


@subroutine
def _doubt_drifted(f: Filter, spec: Gnss, time: float) -> None:
    """Doubt a place by as much as the receiver may have drifted in the time since it was switched on [s]."""
    P, drifted = f.covariance, 1.0 - exponential(-min(2.0 * time / spec.drift_time, MAX_TIMES))
    for axis in range(3):
        p, d = POSITION_ERROR + axis, GNSS_DRIFT_ERROR + axis
        deviation = spec.drift_up if axis == 2 else spec.drift_level
        variance = deviation * deviation * drifted
        P[p, p] += variance
        P[d, d] += variance
        P[p, d] -= variance
        P[d, p] -= variance


@subroutine
def _doubt_flying(P: Array, is_roughly_turned: bool) -> None:
    """Doubt more what was not found at a standstill.

    Args:
        P: Covariance, changed in place, (ERRORS, ERRORS).
        is_roughly_turned: Whether the attitude comes from gravity in flight, and no pose told it.
    """
    reset_block(P, VELOCITY_ERROR, FLYING_SPEED * FLYING_SPEED)
    reset_block(P, GYRO_BIAS_ERROR, FLYING_BIAS * FLYING_BIAS)
    reset_block(P, POSITION_ERROR, max(P[POSITION_ERROR, POSITION_ERROR], 0.25))
    if is_roughly_turned:
        reset_block(P, ATTITUDE_ERROR, FLYING_TILT * FLYING_TILT)


@kernel
def _first_belief(b: NominalState, place: Vector, velocity: Vector, q: Quaternion, gyro_bias: Vector) -> NominalState:
    """Initial state of the filter; of the state before, the biases of the body and the wind are kept."""
    zero = Vector(0.0, 0.0, 0.0)
    along = rotate_inverse(q, subtract(velocity, b.wind)).x
    return NominalState(
        position=place,
        velocity=velocity,
        attitude=q,
        gyro_bias=gyro_bias,
        accel_bias=b.accel_bias,
        wind=b.wind,
        misalignment=zero,
        magnetic_bias=zero,
        gnss_drift=zero,
        barometer_drift=0.0,
        steady_wind=b.steady_wind,
        tube_bias=b.tube_bias,
        tube_speed=along,
        static_port=b.static_port,
    )


@subroutine
def _run(f: Filter, i: Instruments, line: int, period: int) -> None:
    """Let the filter run from here; all that waits is older than where it begins."""
    zero = Vector(0.0, 0.0, 0.0)
    put_ahead(f, no_increment())
    put_filling(
        f,
        Step(
            increment=no_increment(),
            gyro_bias=zero,
            accel_bias=zero,
            force=zero,
            rates=zero,
            actuators=value_of(f.actuators),
        ),
    )
    put_filled(f, 0)
    put_phase(f, RUNNING)
    f.fused_at[line] = period
    for k in range(N_DELAYED):
        f.refused_since[k] = -1.0
        i.waiting[k] = 0.0
