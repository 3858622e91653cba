"""Gyroscope and accelerometer: means of a control period, with the vibration of the propellers.

The unit stands beside the centre of mass and reads in its own axes. What it gives is turned into the body's, as the
calibration found them to lie.
"""

from __future__ import annotations

import math

from sitl.compiled import kernel
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import clipped, rounded, sine_cosine, wrapped
from sitl.model.quaternions import rotate, rotate_inverse
from sitl.model.state import Body, Plant
from sitl.model.vectors import Vector, add, add_scaled, cross, scaled, subtract
from sitl.sensors.draws import vector_at
from sitl.sensors.instruments import GARBAGE, OFF, STUCK, HiddenErrors, Inertial, Instruments, Mounting, force_by_arm
from sitl.storage import value_of

GARBAGE_SHARE = 0.2  # of its range that a broken instrument reads at random


@kernel
def specific_force_felt(before: Body, after: Body, g: float, dt: float) -> Vector:
    """Mean specific force over a period, whatever makes it: air, propellers or ground; body frame FLU [m/s2]."""
    change = scaled(subtract(after.velocity, before.velocity), 1.0 / dt)
    felt = Vector(change.x, change.y, change.z + g)
    return scaled(add(rotate_inverse(before.attitude, felt), rotate_inverse(after.attitude, felt)), 0.5)


@kernel
def _shake(speed: float, phase: float, a: Airframe) -> Vector:
    """Vibration of one propeller of unit amplitude at vibration_speed: its imbalance turns in the disc's plane."""
    s, c = sine_cosine(phase)
    share = speed * speed * (1.0 / (a.vibration_speed * a.vibration_speed))
    return Vector(0.3 * share * s, share * c, share * s)


@kernel
def turned_phases(errors: HiddenErrors, plant: Plant, dt: float) -> tuple[float, float]:
    """Angles of the propellers after a period [rad]."""
    act = plant.actuators
    return wrapped(errors.left_phase + act.left_motor * dt), wrapped(errors.right_phase + act.right_motor * dt)


@kernel
def _digitised(value: Vector, mounting: Mounting, noise: Vector, most: float, step: float) -> Vector:
    """A value of the body's axes with noise, clipped and in steps along the unit's axes."""
    q = mounting.imu_attitude
    value = add(rotate_inverse(q, value) if q.w < 1.0 else value, noise)
    value = Vector(
        step * rounded(clipped(value.x, -most, most) / step),
        step * rounded(clipped(value.y, -most, most) / step),
        step * rounded(clipped(value.z, -most, most) / step),
    )
    return rotate(q, value) if q.w < 1.0 else value


@kernel
def _failed(value: Vector, before: Vector, noise: Vector, failure: float, most: float) -> Vector:
    """Reading of an instrument that has failed altogether."""
    if failure in (OFF, STUCK):  # the driver repeats the last reading either way
        return before
    if failure == GARBAGE:
        return scaled(noise, GARBAGE_SHARE * most)
    return value


@kernel
def read_inertial(i: Instruments, before: Plant, plant: Plant, draws: Array, a: Airframe, dt: float) -> Inertial:
    """The inertial reading of one control period.

    Args:
        i: The instruments, a record, with the reading before, which a stuck instrument repeats.
        before: The plant at its beginning.
        plant: The plant at its end.
        draws: Unit normals of the period; see :mod:`sitl.sensors.instruments`.
        a: The airframe as it is.
        dt: Period [s].
    """
    spec, errors, last, failures = value_of(i.specification), value_of(i.errors), value_of(i.inertial), i.failures
    gyro, accel, mounting, act = spec.gyroscope, spec.accelerometer, spec.mounting, plant.actuators
    askew = scaled(errors.imu_misalignment, -1.0)
    shake = add(_shake(act.left_motor, errors.left_phase, a), _shake(act.right_motor, errors.right_phase, a))
    noise, density = vector_at(draws, 0), gyro.noise / math.sqrt(2.0 * dt)
    mean = scaled(add(before.body.rates, plant.body.rates), 0.5)
    rates = add_scaled(mean, shake, gyro.vibration)
    rates = add(add(rates, cross(askew, rates)), add(errors.gyro_bias, errors.gyro_drift))
    rates = _digitised(rates, mounting, scaled(noise, density), gyro.range, gyro.step)
    rates = _failed(rates, last.rates, noise, failures[0], gyro.range)
    noise, density = vector_at(draws, 3), accel.noise / math.sqrt(2.0 * dt)
    turning = scaled(subtract(plant.body.rates, before.body.rates), 1.0 / dt)
    force = specific_force_felt(before.body, plant.body, a.g, dt)
    force = add(force, force_by_arm(mean, turning, add(mounting.imu, errors.imu_arm)))
    force = add_scaled(force, shake, accel.vibration)
    force = add(add(force, cross(askew, force)), add(errors.accel_bias, errors.accel_drift))
    force = _digitised(force, mounting, scaled(noise, density), accel.range, accel.step)
    return Inertial(rates, _failed(force, last.force, noise, failures[1], accel.range))
