"""From the horizon to now: what the laws are given, without the propellers' vibration, and whether it stands."""

from __future__ import annotations

import math

from sitl.compiled import kernel, subroutine
from sitl.control.estimate import Ages, Estimate
from sitl.estimation import contact
from sitl.estimation.filter import (
    SLOW_STEP,
    Filter,
    put_notch,
    put_on_ground,
    put_smooth_acceleration,
    put_smooth_rates,
    put_smooth_velocity,
    put_speed_notch,
    put_support,
    put_support_of_late,
)
from sitl.estimation.nominal_state import POSITION_ERROR
from sitl.estimation.notch import notched
from sitl.estimation.strapdown import moved_by
from sitl.model.arithmetic import decay
from sitl.model.quaternions import Quaternion, rotate, rotate_inverse
from sitl.model.vectors import Vector, add_scaled, subtract
from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.instruments import EXTERNAL_POSE, FIRST_DELAYED, GNSS, MOTION_CAPTURE, Inertial
from sitl.storage import value_of

HEIGHT_STATE = POSITION_ERROR + 2  # error of the height
SMOOTHING_TIME = 0.004  # of the body rates and the velocity given to the laws [s]
ACCELERATION_TIME = 0.03  # of the acceleration [s]
NUMB_SHARE, NUMB_HASTE = 0.85, 0.3  # of the ground's support, where it is not felt, and of how fast it is smoothed


@kernel
def _smoothed(value: Vector, before: Vector, time: float) -> Vector:
    return add_scaled(before, subtract(value, before), 1.0 - decay(PERIOD / time))


@subroutine
def estimate_now(f: Filter, inertial: Inertial, period: int) -> Estimate:
    """Present estimate for the laws: the filter's state moved by the increments since its horizon."""
    b, ahead = value_of(f.nominal), value_of(f.ahead)
    position, velocity, attitude = moved_by(ahead, b.position, b.velocity, b.attitude, f.model.g)
    _smooth(f, velocity, subtract(inertial.rates, b.gyro_bias))
    force = subtract(inertial.force, b.accel_bias)
    felt = rotate(attitude, force)
    pulled = Vector(felt.x, felt.y, felt.z - f.model.g)
    acceleration = _smoothed(pulled, value_of(f.acceleration), ACCELERATION_TIME)
    put_smooth_acceleration(f, acceleration)
    if period % SLOW_PERIODS == 0:
        _detect_ground(f, force, position.z, velocity, attitude)
    return Estimate(
        position=position,
        velocity=value_of(f.velocity),
        acceleration=acceleration,
        attitude=attitude,
        rates=value_of(f.rates),
        wind=b.wind,
        actuators=value_of(f.actuators),
        on_ground=f.on_ground,
        age=_ages(f, period, ahead.time),
    )


@kernel
def _smooth(f: Filter, velocity: Vector, rates: Vector) -> None:
    """Take the propellers' vibration and the noise off velocity and body rates."""
    actuators = value_of(f.actuators)
    speed = 0.5 * (actuators.left_motor + actuators.right_motor)
    turning = notched(rates, value_of(f.notch), speed, PERIOD)
    moving = notched(velocity, value_of(f.speed_notch), speed, PERIOD)
    put_notch(f, turning)
    put_speed_notch(f, moving)
    put_smooth_rates(f, _smoothed(turning.made, value_of(f.rates), SMOOTHING_TIME))
    put_smooth_velocity(f, _smoothed(moving.made, value_of(f.velocity), SMOOTHING_TIME))


@kernel
def _detect_ground(f: Filter, force: Vector, height: float, velocity: Vector, attitude: Quaternion) -> None:
    """Judge whether the vehicle stands on something."""
    through = subtract(velocity, value_of(f.nominal.wind))
    actuators, rates = value_of(f.actuators), value_of(f.rates)
    # The air pushes across the wing; of that only what is upwards holds a vehicle up.
    share, haste, doubt = 1.0, 1.0, abs(rotate(attitude, Vector(0.0, 0.0, 1.0)).z) * f.air_doubt
    if f.numb:
        # Nothing is felt: what holds a vehicle up that does not sink, of which it has to be more sure. The wing tells
        # no more what the air may push.
        force, doubt = rotate_inverse(attitude, Vector(0.0, 0.0, f.model.g)), 0.0
        share, haste = NUMB_SHARE, NUMB_HASTE
    support = share * contact.support_of(force, through, rates, attitude, actuators, value_of(f.model))
    put_support(f, contact.smoothed(support, f.support, SLOW_STEP * haste, contact.SMOOTHED))
    put_support_of_late(f, contact.smoothed(f.support, f.support_of_late, SLOW_STEP * haste, contact.OF_LATE))
    nose_up = rotate(attitude, Vector(1.0, 0.0, 0.0)).z
    low = height - contact.SURE * math.sqrt(max(f.covariance[HEIGHT_STATE, HEIGHT_STATE], 0.0))
    posture = contact.Posture(nose_up, height, low, velocity, f.on_ground, f.lands)
    felt = contact.Support(f.support, f.support_of_late, doubt)
    put_on_ground(f, contact.stands(felt, f.model.g, posture))


@kernel
def _ages(f: Filter, period: int, horizon: float) -> Ages:
    """Age of the newest aid of each part [s]."""
    at = f.fused_at
    place = max(at[GNSS - FIRST_DELAYED], at[MOTION_CAPTURE - FIRST_DELAYED], at[EXTERNAL_POSE - FIRST_DELAYED])
    since = (period - place) * PERIOD + horizon
    return Ages(
        position=since,
        velocity=since,
        acceleration=PERIOD,
        attitude=since,
        rates=PERIOD,
        wind=horizon,
        actuators=0.0,
        contact=SLOW_STEP,
    )
