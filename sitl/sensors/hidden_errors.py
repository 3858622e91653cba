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
from sitl.sensors.draws import (
    ACCEL_DRIFT_NOISE,
    BAROMETER_DRIFT_NOISE,
    GNSS_DRIFT_NOISE,
    GYRO_DRIFT_NOISE,
    SLOW_PERIODS,
    vector_at,
)
from sitl.sensors.inertial import turned_phases
from sitl.sensors.instruments import HiddenErrors, Instruments, put_errors
from sitl.sensors.specification import SensorSet
from sitl.storage import value_of


def drawn_errors(s: SensorSet, draws: Array) -> HiddenErrors:
    """Errors of the instruments at switch-on.

    Args:
        s: Specifications.
        draws: Unit normals, (15,).
    """
    gyro, accel, magnetic, turned = (Vector(*(float(x) for x in draws[k : k + 3])) for k in (0, 3, 6, 9))
    zero = Vector(0.0, 0.0, 0.0)
    return HiddenErrors(
        gyro_bias=scaled(gyro, s.gyroscope.bias),
        gyro_drift=zero,
        accel_bias=scaled(accel, s.accelerometer.bias),
        accel_drift=zero,
        magnetic_bias=scaled(magnetic, s.magnetometer.bias),
        gnss_drift=zero,
        misalignment=scaled(turned, s.motion_capture.misalignment),
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
    tube = tube_speed_after(e, plant, wind, a, value_of(i.specification.pitot), dt)
    put_errors(
        i,
        HiddenErrors(
            gyro_bias=e.gyro_bias,
            gyro_drift=e.gyro_drift,
            accel_bias=e.accel_bias,
            accel_drift=e.accel_drift,
            magnetic_bias=e.magnetic_bias,
            gnss_drift=e.gnss_drift,
            misalignment=e.misalignment,
            barometer_drift=e.barometer_drift,
            pitot_bias=e.pitot_bias,
            tube_speed=tube,
            left_phase=left,
            right_phase=right,
        ),
    )


@subroutine
def drift(i: Instruments, draws: Array, dt: float) -> None:
    """All drifts a slow step later.

    Args:
        i: The instruments, a record.
        draws: Of the slow step; see :mod:`sitl.sensors.draws`.
        dt: Control period [s].
    """
    e, s = value_of(i.errors), value_of(i.specification)
    gyro, accel, receiver, barometer = s.gyroscope, s.accelerometer, s.gnss, s.barometer
    step = SLOW_PERIODS * dt
    pressure = Vector(e.barometer_drift, 0.0, 0.0)
    noise = Vector(draws[BAROMETER_DRIFT_NOISE], 0.0, 0.0)
    put_errors(
        i,
        HiddenErrors(
            gyro_bias=e.gyro_bias,
            gyro_drift=_drifted(
                e.gyro_drift, vector_at(draws, GYRO_DRIFT_NOISE), gyro.drift, gyro.drift, gyro.drift_time, step
            ),
            accel_bias=e.accel_bias,
            accel_drift=_drifted(
                e.accel_drift, vector_at(draws, ACCEL_DRIFT_NOISE), accel.drift, accel.drift, accel.drift_time, step
            ),
            magnetic_bias=e.magnetic_bias,
            gnss_drift=_drifted(
                e.gnss_drift,
                vector_at(draws, GNSS_DRIFT_NOISE),
                receiver.drift_level,
                receiver.drift_up,
                receiver.drift_time,
                step,
            ),
            misalignment=e.misalignment,
            barometer_drift=_drifted(pressure, noise, barometer.drift, 0.0, barometer.drift_time, step).x,
            pitot_bias=e.pitot_bias,
            tube_speed=e.tube_speed,
            left_phase=e.left_phase,
            right_phase=e.right_phase,
        ),
    )
