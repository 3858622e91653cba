"""The instruments of one vehicle: what they are, their hidden errors, and readings that are on their way."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel, subroutine
from sitl.model.airframe import Array
from sitl.model.vectors import Vector
from sitl.sensors.specification import SensorSet
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
