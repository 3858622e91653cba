"""The instruments of one vehicle: numbers, specifications, hidden errors, and readings that are on their way.

To add one that reads now and then: here its number, its columns of the draws and its specification, a field of
:class:`SensorSet`; its values (``data/``); its reading (:mod:`sitl.sensors.aiding`); its fusion
(:func:`sitl.estimation.observations.observe_reading`).

Specifications are immutable, in SI units. A *drift* is a first-order Gauss-Markov process: its deviation in the long
run, and the time in which it forgets. So is the noise of the satellite receiver, which filters what it tells.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel, subroutine
from sitl.model.aerodynamics import thrusts
from sitl.model.airframe import Airframe, Array
from sitl.model.quaternions import Quaternion
from sitl.model.state import Actuators
from sitl.model.vectors import Vector, add, cross
from sitl.sensors.draws import PERIOD, Timing
from sitl.storage import writer

GYROSCOPE, ACCELEROMETER, MAGNETOMETER, BAROMETER, GNSS, PITOT, MOTION_CAPTURE, EXTERNAL_POSE = range(8)
INSTRUMENTS = 8
FIRST_DELAYED = MAGNETOMETER  # the inertial readings are not late
N_DELAYED = INSTRUMENTS - FIRST_DELAYED
QUEUE_LENGTH = 160  # readings that a line holds: 0.5 s of delay at 250 Hz, and some
READING_SIZE = 10  # numbers of the longest reading
PENDING = 64  # control periods that a command may be on its way, or an inertial reading be late
HEALTHY, OFF, STUCK, GARBAGE, WRONG, TOO_SLOW, DELAYED, INTERMITTENT = range(8)  # MAVLink's FAILURE_TYPE
SCALED, DRIFTING = 8, 9  # two more ways to be wrong, for which it has no number

# Columns of a pose, after position and quaternion.
POSITION_VARIANCE, ATTITUDE_VARIANCE, HAS_ATTITUDE = 7, 8, 9

# Random draws: each quantity has columns of its own, so that no instrument changes what another one draws. All are unit
# normals but the dropouts, which are uniform from 0 to 1. Columns of the row of a control period:
GYRO_NOISE, ACCEL_NOISE, POSE_POSITION_NOISE, POSE_ATTITUDE_NOISE, POSE_JITTER, POSE_DROPOUT = 0, 3, 6, 9, 12, 13
FAST_COLUMNS = 14
# Columns of the row of a slow step:
GYRO_DRIFT_NOISE, ACCEL_DRIFT_NOISE, MAGNETIC_NOISE, GNSS_POSITION_NOISE, GNSS_VELOCITY_NOISE, GNSS_DRIFT_NOISE = (
    0,
    3,
    6,
    9,
    12,
    15,
)
BAROMETER_NOISE, BAROMETER_DRIFT_NOISE, PITOT_NOISE = 18, 19, 20
AIDS = 4  # that may lose a reading: magnetometer, barometer, satellite receiver, pitot
JITTER, DROPOUT = 21, 21 + AIDS
SLOW_COLUMNS = DROPOUT + AIDS


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


class HiddenErrors(NamedTuple):
    """Errors of the readings, told to nobody."""

    gyro_bias: Vector  # body FLU [rad/s]
    gyro_drift: Vector  # [rad/s]
    accel_bias: Vector  # body FLU [m/s2]
    accel_drift: Vector  # [m/s2]
    magnetic_bias: Vector  # body FLU [T]
    gnss_drift: Vector  # world NWU [m]
    gnss_noise: Vector  # likewise, forgotten sooner [m]
    gnss_velocity_noise: Vector  # world NWU [m/s]
    misalignment: Vector  # from the body to motion capture's frame of it [rad]
    imu_misalignment: Vector  # of the inertial unit, from the body to what it takes for it [rad]
    imu_arm: Vector  # from where the unit is said to be to where it is, body FLU [m]
    antenna_arm: Vector  # likewise of the antenna [m]
    barometer_drift: float  # [m]
    pitot_bias: float  # [m/s]
    tube_speed: float  # what the pitot's diaphragm feels, late [m/s]
    left_phase: float  # of the propellers, whose imbalance shakes [rad]
    right_phase: float  # [rad]


class Inertial(NamedTuple):
    """One reading of gyroscope and accelerometer, body frame FLU, means of a control period."""

    rates: Vector  # [rad/s]
    force: Vector  # specific force [m/s2]


class Instruments(NamedTuple):
    """The instruments of one vehicle; lines are queues, by instrument less FIRST_DELAYED."""

    specification: SensorSet
    errors: HiddenErrors
    inertial: Inertial  # the last reading
    failures: Array  # one of HEALTHY ... DRIFTING per instrument, (INSTRUMENTS,)
    sizes: Array  # how wrong, scaled or drifting, in multiples of the usual, (INSTRUMENTS,)
    failed_at: Array  # control period since which, (INSTRUMENTS,)
    kept: Array  # inertial readings by control period, for one that is delayed, (PENDING, 6)
    sampled: Array  # control period of a reading, (LINES, LINE)
    arrives: Array  # control period of its arrival, (LINES, LINE)
    readings: Array  # (LINES, LINE, READING)
    first: Array  # the oldest reading, (LINES,)
    waiting: Array  # readings in the line, (LINES,)
    lost: Array  # 1 while the cameras do not see the body, (1,)
    last: Array  # the newest reading, which a stuck instrument repeats, (LINES, READING)
    pending: Array  # actuator commands on their way, by control period, (PENDING, 4)
    held: Array  # those of the last frame, (4,)


def instruments(specification: SensorSet, errors: HiddenErrors) -> Instruments:
    """Healthy instruments that have read nothing yet."""
    zero = Vector(0.0, 0.0, 0.0)
    return Instruments(
        specification=specification,
        errors=errors,
        inertial=Inertial(zero, zero),
        failures=np.zeros(INSTRUMENTS),
        sizes=np.ones(INSTRUMENTS),
        failed_at=np.zeros(INSTRUMENTS),
        kept=np.zeros((PENDING, 6)),
        sampled=np.zeros((N_DELAYED, QUEUE_LENGTH)),
        arrives=np.zeros((N_DELAYED, QUEUE_LENGTH)),
        readings=np.zeros((N_DELAYED, QUEUE_LENGTH, READING_SIZE)),
        first=np.zeros(N_DELAYED),
        waiting=np.zeros(N_DELAYED),
        lost=np.zeros(1),
        last=np.zeros((N_DELAYED, READING_SIZE)),
        pending=np.zeros((PENDING, 4)),
        held=np.zeros(4),
    )


put_gyro_drift = writer(Instruments, lambda i: i.errors.gyro_drift)
put_accel_drift = writer(Instruments, lambda i: i.errors.accel_drift)
put_gnss_drift = writer(Instruments, lambda i: i.errors.gnss_drift)
put_gnss_noise = writer(Instruments, lambda i: i.errors.gnss_noise)
put_gnss_velocity_noise = writer(Instruments, lambda i: i.errors.gnss_velocity_noise)
put_barometer_drift = writer(Instruments, lambda i: i.errors.barometer_drift)
put_tube_air = writer(Instruments, lambda i: i.errors.tube_speed)
put_left_phase = writer(Instruments, lambda i: i.errors.left_phase)
put_right_phase = writer(Instruments, lambda i: i.errors.right_phase)
put_inertial = writer(Instruments, lambda i: i.inertial)


@subroutine
def send(line: int, i: Instruments, sampled: int, arrives: int) -> None:
    """Put the reading in ``last`` at the end of a line; a full line forgets its oldest."""
    if i.waiting[line] == QUEUE_LENGTH:
        drop(line, i)
    at = (int(i.first[line]) + int(i.waiting[line])) % QUEUE_LENGTH
    i.sampled[line, at] = sampled
    i.arrives[line, at] = arrives
    for k in range(READING_SIZE):
        i.readings[line, at, k] = i.last[line, k]
    i.waiting[line] += 1.0


@kernel
def drop(line: int, i: Instruments) -> None:
    """Take the oldest reading out of a line."""
    i.first[line] = float((int(i.first[line]) + 1) % QUEUE_LENGTH)
    i.waiting[line] -= 1.0
