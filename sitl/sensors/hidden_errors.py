"""The hidden errors of a vehicle's instruments: drawn when it is switched on, drifting as it flies."""

from __future__ import annotations

import math

import numpy as np

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Airframe, Array
from sitl.model.arithmetic import decay
from sitl.model.state import Plant
from sitl.model.vectors import Vector, add_scaled, scaled
from sitl.sensors.aiding import tube_speed_after
from sitl.sensors.draws import SLOW_PERIODS, vector_at
from sitl.sensors.inertial import turned_phases
from sitl.sensors.instruments import (
    ACCEL_DRIFT_NOISE,
    BAROMETER_DRIFT_NOISE,
    GNSS_DRIFT_NOISE,
    GNSS_POSITION_NOISE,
    GNSS_VELOCITY_NOISE,
    GYRO_DRIFT_NOISE,
    HiddenErrors,
    Instruments,
    SensorSet,
    put_accel_drift,
    put_barometer_drift,
    put_gnss_drift,
    put_gnss_noise,
    put_gnss_velocity_noise,
    put_gyro_drift,
    put_left_phase,
    put_right_phase,
    put_tube_air,
)
from sitl.storage import value_of

ERROR_DRAWS = 15  # unit normals that the errors of a vehicle's instruments are made of
MOUNTING_DRAWS = 9  # likewise of their places and axes


def drawn_errors(s: SensorSet, draws: Array, mounting: Array) -> HiddenErrors:
    """Errors of the instruments at switch-on.

    Args:
        s: Specifications.
        draws: Unit normals, (ERROR_DRAWS,).
        mounting: Likewise, (MOUNTING_DRAWS,).
    """
    gyro, accel, magnetic, turned = (Vector(*(float(x) for x in draws[k : k + 3])) for k in (0, 3, 6, 9))
    imu, arm, antenna = (Vector(*(float(x) for x in mounting[k : k + 3])) for k in (0, 3, 6))
    zero = Vector(0.0, 0.0, 0.0)
    return HiddenErrors(
        gyro_bias=scaled(gyro, s.gyroscope.bias),
        gyro_drift=zero,
        accel_bias=scaled(accel, s.accelerometer.bias),
        accel_drift=zero,
        magnetic_bias=scaled(magnetic, s.magnetometer.bias),
        gnss_drift=zero,
        gnss_noise=zero,
        gnss_velocity_noise=zero,
        misalignment=scaled(turned, s.motion_capture.misalignment),
        imu_misalignment=scaled(imu, s.mounting.misalignment),
        imu_arm=scaled(arm, s.mounting.arm_error),
        antenna_arm=scaled(antenna, s.mounting.arm_error),
        barometer_drift=0.0,
        pitot_bias=s.pitot.bias * float(draws[12]),
        tube_speed=0.0,
        left_phase=float(np.clip(draws[13], -3.0, 3.0)),
        right_phase=float(np.clip(draws[14], -3.0, 3.0)),
    )


@kernel
def _drifted(value: Vector, noise: Vector, level: float, up: float, time: float, dt: float) -> Vector:
    """A first-order Gauss-Markov process a while later."""
    fade = decay(dt / time)
    gained = math.sqrt(1.0 - fade * fade)
    return add_scaled(scaled(value, fade), Vector(level * noise.x, level * noise.y, up * noise.z), gained)


@subroutine
def turn_propellers(i: Instruments, plant: Plant, wind: Vector, a: Airframe, dt: float) -> None:
    """Phases of the propellers, and the air in the pitot tube, a control period later."""
    e = value_of(i.errors)
    left, right = turned_phases(e, plant, dt)
    put_tube_air(i, tube_speed_after(e, plant, wind, a, value_of(i.specification.pitot), dt))
    put_left_phase(i, left)
    put_right_phase(i, right)


@subroutine
def drift(i: Instruments, draws: Array, dt: float) -> None:
    """All drifts a slow step later.

    Args:
        i: The instruments, a record.
        draws: Of the slow step; see :mod:`sitl.sensors.instruments`.
        dt: Control period [s].
    """
    e, s = value_of(i.errors), value_of(i.specification)
    gyro, accel, receiver, barometer = s.gyroscope, s.accelerometer, s.gnss, s.barometer
    step = SLOW_PERIODS * dt
    noise = vector_at(draws, GYRO_DRIFT_NOISE)
    put_gyro_drift(i, _drifted(e.gyro_drift, noise, gyro.drift, gyro.drift, gyro.drift_time, step))
    noise = vector_at(draws, ACCEL_DRIFT_NOISE)
    put_accel_drift(i, _drifted(e.accel_drift, noise, accel.drift, accel.drift, accel.drift_time, step))
    noise, level, up = vector_at(draws, GNSS_DRIFT_NOISE), receiver.drift_level, receiver.drift_up
    put_gnss_drift(i, _drifted(e.gnss_drift, noise, level, up, receiver.drift_time, step))
    if receiver.noise_time > 0.0:
        noise, level, up = vector_at(draws, GNSS_POSITION_NOISE), receiver.noise_level, receiver.noise_up
        put_gnss_noise(i, _drifted(e.gnss_noise, noise, level, up, receiver.noise_time, step))
        noise = vector_at(draws, GNSS_VELOCITY_NOISE)
        level, up = receiver.velocity_noise_level, receiver.velocity_noise_up
        put_gnss_velocity_noise(i, _drifted(e.gnss_velocity_noise, noise, level, up, receiver.noise_time, step))
    pressure, noise = Vector(e.barometer_drift, 0.0, 0.0), Vector(draws[BAROMETER_DRIFT_NOISE], 0.0, 0.0)
    put_barometer_drift(i, _drifted(pressure, noise, barometer.drift, 0.0, barometer.drift_time, step).x)
