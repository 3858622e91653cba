"""Messages of gyroscope and accelerometer, one function each, and what these read.

https://mavlink.io/en/messages/common.html#HIGHRES_IMU and the other messages named below
"""

from __future__ import annotations

import math

from protocol import units
from protocol.dialect import mavlink
from protocol.wire.message import Message
from sitl.estimation.sensing import specific_force
from sitl.mavlink.telemetry.body_frame import axes_on_wire
from sitl.mavlink.telemetry.sensor_messages import dynamic_pressure, magnetic_field, static_pressure
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import Vector
from sitl.sensors.instruments import Inertial
from sitl.sensors.specification import STANDARD_GRAVITY

MAX_INT16 = 32767
NOT_MEASURED = math.nan
ACCELERATION_AND_RATES = (
    mavlink.HIGHRES_IMU_UPDATED_XACC
    | mavlink.HIGHRES_IMU_UPDATED_YACC
    | mavlink.HIGHRES_IMU_UPDATED_ZACC
    | mavlink.HIGHRES_IMU_UPDATED_XGYRO
    | mavlink.HIGHRES_IMU_UPDATED_YGYRO
    | mavlink.HIGHRES_IMU_UPDATED_ZGYRO
)
MAGNETIC_FIELD = mavlink.HIGHRES_IMU_UPDATED_XMAG | mavlink.HIGHRES_IMU_UPDATED_YMAG | mavlink.HIGHRES_IMU_UPDATED_ZMAG
STATIC_PRESSURE = mavlink.HIGHRES_IMU_UPDATED_ABS_PRESSURE | mavlink.HIGHRES_IMU_UPDATED_PRESSURE_ALT
DYNAMIC_PRESSURE = mavlink.HIGHRES_IMU_UPDATED_DIFF_PRESSURE


def inertial_reading(s: VehicleSnapshot) -> Inertial:
    """Readings of gyroscope and accelerometer; ideal ones at the centre of mass if the vehicle flies on the truth."""
    if s.inertial is not None:
        return s.inertial
    if s.landed:  # the ground carries the weight
        force = rotate_inverse(s.plant.body.attitude, Vector(0.0, 0.0, s.airframe.g))
    else:
        force = specific_force(s.plant, Vector(*s.wind), s.airframe)
    return Inertial(rates=Vector(*s.rates), force=force)


def highres_imu(s: VehicleSnapshot) -> Message:
    """HIGHRES_IMU: ``fields_updated`` says what is there; on the exact state, acceleration and rates alone."""
    reading, field, height, airspeed = inertial_reading(s), magnetic_field(s), s.readings.height, s.readings.airspeed
    xmag, ymag, zmag = (NOT_MEASURED,) * 3 if field is None else axes_on_wire(field)
    updated = ACCELERATION_AND_RATES | (0 if field is None else MAGNETIC_FIELD)
    updated |= (0 if height is None else STATIC_PRESSURE) | (0 if airspeed is None else DYNAMIC_PRESSURE)
    xacc, yacc, zacc = axes_on_wire(reading.force)
    xgyro, ygyro, zgyro = axes_on_wire(reading.rates)
    return mavlink.MAVLink_highres_imu_message(
        time_usec=units.microseconds(s.time),
        xacc=xacc,
        yacc=yacc,
        zacc=zacc,
        xgyro=xgyro,
        ygyro=ygyro,
        zgyro=zgyro,
        xmag=xmag,
        ymag=ymag,
        zmag=zmag,
        abs_pressure=NOT_MEASURED if height is None else static_pressure(s, height),
        diff_pressure=NOT_MEASURED if airspeed is None else dynamic_pressure(s, airspeed),
        pressure_alt=NOT_MEASURED if height is None else s.frame.origin.alt + height,
        temperature=NOT_MEASURED,
        fields_updated=updated,
    )


def scaled_imu(s: VehicleSnapshot) -> Message:
    """SCALED_IMU: the same in thousandths of g and of rad/s; a magnetic field or temperature of 0 is not known."""
    (xacc, yacc, zacc), (xgyro, ygyro, zgyro) = _in_thousandths(inertial_reading(s))
    return mavlink.MAVLink_scaled_imu_message(s.ms, xacc, yacc, zacc, xgyro, ygyro, zgyro, xmag=0, ymag=0, zmag=0)


def raw_imu(s: VehicleSnapshot) -> Message:
    """RAW_IMU in the units of SCALED_IMU, as ArduPilot has it: MAVLink leaves them open."""
    (xacc, yacc, zacc), (xgyro, ygyro, zgyro) = _in_thousandths(inertial_reading(s))
    time_usec = units.microseconds(s.time)
    return mavlink.MAVLink_raw_imu_message(time_usec, xacc, yacc, zacc, xgyro, ygyro, zgyro, xmag=0, ymag=0, zmag=0)


def _in_thousandths(reading: Inertial) -> tuple[tuple[int, ...], tuple[int, ...]]:
    acceleration = (_int16(1e3 * a / STANDARD_GRAVITY) for a in axes_on_wire(reading.force))
    return tuple(acceleration), tuple(_int16(1e3 * rate) for rate in axes_on_wire(reading.rates))


def _int16(value: float) -> int:
    """The nearest number that the field holds: a crash may exceed it."""
    return round(min(max(value, -MAX_INT16), MAX_INT16))
