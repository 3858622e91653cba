"""State of the filter at its instant, and the numbering of its errors.

The error of the attitude is a rotation in the body frame, true = believed ⊗ exp(error); all others are true less
believed. The filter stands a little in the past, where every reading has arrived.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.airframe import Array
from sitl.model.quaternions import Quaternion, hover, multiply, normalised, small_rotation
from sitl.model.vectors import Vector, add
from sitl.storage import replacing, zero

# Rows and columns of the covariance, three of each down to the steady wind.
(
    POSITION_ERROR,
    VELOCITY_ERROR,
    ATTITUDE_ERROR,
    GYRO_BIAS_ERROR,
    ACCEL_BIAS_ERROR,
    WIND_ERROR,
    STEADY_WIND_ERROR,
) = range(0, 21, 3)
TUBE_BIAS_ERROR, TUBE_SPEED_ERROR = 21, 22
WING_ERROR = 23  # a share of the wing's force, which is considered and never estimated
AIR_ERRORS = 8  # from WIND_ERROR on: what wing and pitot tell of
MISALIGNMENT_ERROR, MAGNETIC_BIAS_ERROR, GNSS_DRIFT_ERROR = 24, 27, 30  # three of each
BAROMETER_DRIFT_ERROR, STATIC_PORT_ERROR = 33, 34
ERRORS = 35  # outdoors
ARENA_ERRORS = 27  # those before the magnetic bias, where only motion capture aids


class NominalState(NamedTuple):
    """The filter's state."""

    position: Vector  # world NWU [m]
    velocity: Vector  # world NWU [m/s]
    attitude: Quaternion  # body FLU to world NWU
    gyro_bias: Vector  # body FLU [rad/s]
    accel_bias: Vector  # body FLU [m/s2]
    wind: Vector  # now, world NWU [m/s]
    misalignment: Vector  # from the body to motion capture's frame of it [rad]
    magnetic_bias: Vector  # body FLU [T]
    gnss_drift: Vector  # of the receiver's positions, world NWU [m]
    barometer_drift: float  # of the barometer's heights [m]
    steady_wind: Vector  # which the gusts blow about, world NWU [m/s]
    tube_bias: float  # of the pitot's airspeeds [m/s]
    tube_speed: float  # what the pitot's diaphragm feels, late [m/s]
    static_port: float  # share of the dynamic pressure that the barometer reads as static [-]


def at_origin() -> NominalState:
    """The state at the origin, at rest, hovering with its belly to the north, and all errors zero."""
    return zero(NominalState)._replace(attitude=hover(0.0))


@kernel
def _part(errors: Array, first: int) -> Vector:
    return Vector(errors[first], errors[first + 1], errors[first + 2])


@kernel
def corrected(nominal: NominalState, errors: Array) -> NominalState:
    """The nominal state with estimated errors taken out of it; ``errors`` (ERRORS,) is set to zero."""
    b = NominalState(
        position=add(nominal.position, _part(errors, POSITION_ERROR)),
        velocity=add(nominal.velocity, _part(errors, VELOCITY_ERROR)),
        attitude=normalised(multiply(nominal.attitude, small_rotation(_part(errors, ATTITUDE_ERROR)))),
        gyro_bias=add(nominal.gyro_bias, _part(errors, GYRO_BIAS_ERROR)),
        accel_bias=add(nominal.accel_bias, _part(errors, ACCEL_BIAS_ERROR)),
        wind=add(nominal.wind, _part(errors, WIND_ERROR)),
        misalignment=add(nominal.misalignment, _part(errors, MISALIGNMENT_ERROR)),
        magnetic_bias=add(nominal.magnetic_bias, _part(errors, MAGNETIC_BIAS_ERROR)),
        gnss_drift=add(nominal.gnss_drift, _part(errors, GNSS_DRIFT_ERROR)),
        barometer_drift=nominal.barometer_drift + errors[BAROMETER_DRIFT_ERROR],
        steady_wind=add(nominal.steady_wind, _part(errors, STEADY_WIND_ERROR)),
        tube_bias=nominal.tube_bias + errors[TUBE_BIAS_ERROR],
        tube_speed=nominal.tube_speed + errors[TUBE_SPEED_ERROR],
        static_port=nominal.static_port + errors[STATIC_PORT_ERROR],
    )
    errors[:] = 0.0
    return b


with_position, with_velocity = replacing(NominalState, "position"), replacing(NominalState, "velocity")
with_attitude, with_wind = replacing(NominalState, "attitude"), replacing(NominalState, "wind")
with_tube_speed = replacing(NominalState, "tube_speed")
