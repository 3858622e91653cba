"""Specifications of the instruments, as the compiled models take them, and the air that the pitot stands in.

They are immutable, in SI units.

A *drift* is a first-order Gauss-Markov process: its deviation in the long run, and the time in which it forgets. So is
the noise of the satellite receiver, which filters what it tells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from sitl.compiled import kernel
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, cross
from sitl.sensors.draws import PERIOD


class Timing(NamedTuple):
    """Timing of an instrument's readings, and of their arrival."""

    rate: float  # readings a second [Hz]
    delay: float  # from reading to arrival [s]
    jitter: float  # standard deviation of what delays it further [s]
    dropout: float  # share of readings that never arrive [-]


class Gyroscope(NamedTuple):
    """Three body rates, read in every control period."""

    noise: float  # density [rad/s/sqrt(Hz)]
    bias: float  # at switch-on, per axis, one standard deviation [rad/s]
    drift: float  # of the bias [rad/s]
    drift_time: float  # [s]
    range: float  # [rad/s]
    step: float  # of the numbers it gives [rad/s]
    vibration: float  # amplitude by a propeller at the airframe's vibration_speed [rad/s]


class Accelerometer(NamedTuple):
    """Three specific forces, read in every control period."""

    noise: float  # density [m/s2/sqrt(Hz)]
    bias: float  # at switch-on, per axis, one standard deviation [m/s2]
    drift: float  # of the bias [m/s2]
    drift_time: float  # [s]
    range: float  # [m/s2]
    step: float  # of the numbers it gives [m/s2]
    vibration: float  # amplitude by a propeller at the airframe's vibration_speed [m/s2]


class Magnetometer(NamedTuple):
    """The magnetic field in the body frame."""

    timing: Timing
    noise: float  # per reading [T]
    bias: float  # of the airframe's own field, one standard deviation [T]
    range: float  # [T]
    step: float  # [T]
    field_north: float  # of the earth where it flies [T]
    field_west: float  # [T]
    field_up: float  # [T]


class Barometer(NamedTuple):
    """Height above the local origin, where it was set to zero, from the static pressure."""

    timing: Timing
    noise: float  # per reading [m]
    drift: float  # of weather and temperature [m]
    drift_time: float  # [s]
    position_error: float  # share of the dynamic pressure that is read as static [-]
    step: float  # [m]


class Gnss(NamedTuple):
    """Position and velocity from satellites, about the local origin."""

    timing: Timing
    noise_level: float  # of the position north and west [m]
    noise_up: float  # [m]
    velocity_noise_level: float  # [m/s]
    velocity_noise_up: float  # [m/s]
    noise_time: float  # in which position and velocity forget that noise; 0: new with every reading [s]
    drift_level: float  # of the position, since switch-on [m]
    drift_up: float  # [m]
    drift_time: float  # [s]


class Pitot(NamedTuple):
    """Airspeed along x_b, of a tube between the propellers."""

    timing: Timing
    noise: float  # per reading [m/s]
    bias: float  # one standard deviation [m/s]
    lag: float  # time constant of tube and diaphragm [s]
    slipstream: float  # share of the slipstream's speed that reaches the tube [-]
    min_speed: float  # below it nothing is read [m/s]
    range: float  # [m/s]
    step: float  # [m/s]


class MotionCapture(NamedTuple):
    """Position and attitude from the cameras of an arena."""

    timing: Timing
    burst: float  # mean length of what is lost at once; 0: each pose by itself [s]
    noise: float  # of the position, per axis and reading [m]
    attitude_noise: float  # per axis and reading [rad]
    misalignment: float  # of the rigid body's frame, per axis, one standard deviation [rad]
    step: float  # of the positions it gives [m]


class BatteryMonitor(NamedTuple):
    """Voltage and current at the battery."""

    timing: Timing
    voltage_noise: float  # [V]
    current_noise: float  # [A]
    voltage_step: float  # [V]
    current_step: float  # [A]


class Pipeline(NamedTuple):
    """The way of the numbers through the autopilot."""

    latency: float  # from the inertial reading to the actuator, beyond the control period [s]
    servo_rate: float  # frames a second, between which a servo holds its command [Hz]
    motor_rate: float  # likewise of a speed controller [Hz]

    @property
    def mean_delay(self) -> float:
        """The latency, and how long a servo's command waits for its frame in the mean [s]."""
        return self.latency + 0.5 * max(1.0 / self.servo_rate - PERIOD, 0.0)


class Mounting(NamedTuple):
    """Places of the inertial unit and the satellites' antenna in the airframe, as calibrated."""

    imu_attitude: Quaternion  # from the unit's axes to the body's
    imu: Vector  # from the centre of mass, body FLU [m]
    antenna: Vector  # likewise [m]
    misalignment: float  # that calibration leaves, per axis, one standard deviation [rad]
    arm_error: float  # likewise of both places [m]


class SensorSet(NamedTuple):
    """All instruments of a vehicle."""

    gyroscope: Gyroscope
    accelerometer: Accelerometer
    magnetometer: Magnetometer
    barometer: Barometer
    gnss: Gnss
    pitot: Pitot
    motion_capture: MotionCapture
    battery: BatteryMonitor
    pipeline: Pipeline
    mounting: Mounting


STANDARD_GRAVITY = 9.80665  # that data sheets count in, and heights of pressure [m/s2]


@kernel
def force_by_arm(rates: Vector, turning: Vector, arm: Vector) -> Vector:
    """The specific force that an arm from the centre of mass adds, dω/dt × r + ω × (ω × r), body frame FLU [m/s2].

    Args:
        rates: Body rates [rad/s].
        turning: Their rate of change [rad/s2].
        arm: Body FLU [m].
    """
    return add(cross(turning, arm), cross(rates, cross(rates, arm)))


@kernel
def speed_before_tube(along: float, actuators: Actuators, a: Airframe, spec: Pitot) -> float:
    """Airspeed along the nose and a share of the slipstream [m/s].

    Args:
        along: Airspeed along the nose [m/s].
        actuators: What the slipstream comes from.
        a: The airframe.
        spec: The pitot.
    """
    T1, T2 = thrusts(actuators, along, a)
    ahead, disc = max(along, 0.0), a.blown_share * a.S / (2.0 * a.S_ratio)
    swept = ahead * ahead + max(T1 + T2, 0.0) / (a.rho * disc)  # of the mean of both propellers
    return along + spec.slipstream * (math.sqrt(swept) - ahead)
