"""Messages of the instruments."""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.wire.message import Message
from sitl.estimation.sensing import specific_force
from sitl.mavlink.telemetry.navigation import axes_on_wire
from sitl.mavlink.telemetry.streams import OUTDOORS, StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.model.quaternions import rotate_inverse
from sitl.model.vectors import Vector
from sitl.sensors.instruments import STANDARD_GRAVITY, Gnss, Inertial

# Messages of satellite receiver and pressure sensors, as they last read; nothing where there is no such sensor.
#
# https://mavlink.io/en/messages/common.html#GPS_RAW_INT and the other messages named below

UNKNOWN_UINT16, UNKNOWN_SATELLITES = 0xFFFF, 0xFF
MIN_COURSE_SPEED = 0.1  # slower, there is no course [m/s]
SEA_PRESSURE, LAPSE, SEA_TEMPERATURE, EXPONENT = 1013.25, 0.0065, 288.15, 5.25588  # of the standard atmosphere
LEAST_TEMPERATURE, FREEZING = 1.0, 273.15  # of its formula, far above where it holds; of water [K]
CABIN_TEMPERATURE = 1500  # of the pressure sensors, that of the standard atmosphere [0.01 degC]
PASCALS = 100.0  # in a hectopascal

SENSOR_STREAMS = StreamTable()


@SENSOR_STREAMS.sends(mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, 1.0)
def gps_raw(s: VehicleSnapshot) -> Message:
    """GPS_RAW_INT: the receiver's last reading; on the exact state an ideal receiver, indoors none."""
    fix = s.readings.fix
    if fix is not None:
        return _fix(s, fix.position, fix.velocity, mavlink.GPS_FIX_TYPE_3D_FIX, fix.accuracy)
    if not s.navigation.is_sensed:
        return _fix(s, s.p, s.v, mavlink.GPS_FIX_TYPE_RTK_FIXED, None)
    there = mavlink.GPS_FIX_TYPE_NO_FIX if s.readings.has_receiver else mavlink.GPS_FIX_TYPE_NO_GPS
    return mavlink.MAVLink_gps_raw_int_message(
        time_usec=units.microseconds(s.time),
        fix_type=there,
        lat=0,
        lon=0,
        alt=0,
        eph=UNKNOWN_UINT16,
        epv=UNKNOWN_UINT16,
        vel=UNKNOWN_UINT16,
        cog=UNKNOWN_UINT16,
        satellites_visible=UNKNOWN_SATELLITES,
    )


def _fix(s: VehicleSnapshot, p: frames.Vector, v: frames.Vector, kind: int, accuracy: Gnss | None) -> Message:
    here = s.frame.to_geodetic(frames.flip(p))
    ground_speed = math.hypot(v[0], v[1])
    course = math.atan2(-v[1], v[0]) if ground_speed > MIN_COURSE_SPEED else math.nan
    level, up, speed = (0.0, 0.0, 0.0) if accuracy is None else _deviations(accuracy)
    return mavlink.MAVLink_gps_raw_int_message(
        time_usec=units.microseconds(s.time),
        fix_type=kind,
        lat=units.to_e7(here.lat_deg),
        lon=units.to_e7(here.lon_deg),
        alt=units.millimetres(here.alt),
        eph=UNKNOWN_UINT16,
        epv=UNKNOWN_UINT16,
        vel=units.centimetres_per_second(ground_speed),
        cog=units.centidegrees(course),
        satellites_visible=UNKNOWN_SATELLITES,
        h_acc=units.millimetres(level),
        v_acc=units.millimetres(up),
        vel_acc=units.millimetres(speed),
    )


def _deviations(g: Gnss) -> tuple[float, float, float]:
    """Of the level position, of the height [m] and of the velocity [m/s], by the receiver's specification."""
    level, up = math.sqrt(2.0) * math.hypot(g.noise_level, g.drift_level), math.hypot(g.noise_up, g.drift_up)
    return level, up, math.sqrt(2.0 * g.velocity_noise_level**2 + g.velocity_noise_up**2)


@SENSOR_STREAMS.sends(mavlink.MAVLINK_MSG_ID_SCALED_PRESSURE, 1.0, OUTDOORS)
def scaled_pressure(s: VehicleSnapshot) -> list[Message]:
    """SCALED_PRESSURE of barometer and pitot tube, if both are there."""
    if s.readings.height is None:
        return []
    return [
        mavlink.MAVLink_scaled_pressure_message(
            time_boot_ms=s.ms,
            press_abs=static_pressure(s, s.readings.height),
            press_diff=dynamic_pressure(s, s.readings.airspeed or 0.0),
            temperature=CABIN_TEMPERATURE,
        )
    ]


def static_pressure(s: VehicleSnapshot, height: float) -> float:
    """Of the standard atmosphere at a height above the origin [hPa]."""
    pressure, _ = standard_atmosphere(s.frame.origin.alt + height)
    return pressure


def standard_atmosphere(altitude: float) -> tuple[float, float]:
    """Static pressure [hPa] and temperature [degC] at an altitude above the sea [m]."""
    temperature = max(SEA_TEMPERATURE - LAPSE * altitude, LEAST_TEMPERATURE)
    return float(SEA_PRESSURE * (temperature / SEA_TEMPERATURE) ** EXPONENT), temperature - FREEZING


def dynamic_pressure(s: VehicleSnapshot, airspeed: float) -> float:
    """Of the air at a speed [hPa]."""
    return 0.5 * s.airframe.rho * airspeed * airspeed / PASCALS


def magnetic_field(s: VehicleSnapshot) -> Vector | None:
    """As read, body FLU [Gs]."""
    field = s.readings.field
    return None if field is None else Vector(1e4 * field.x, 1e4 * field.y, 1e4 * field.z)


# Messages of gyroscope and accelerometer, one function each, and what these read.
#
# https://mavlink.io/en/messages/common.html#HIGHRES_IMU and the other messages named below


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


@SENSOR_STREAMS.sends(mavlink.MAVLINK_MSG_ID_HIGHRES_IMU, 10.0)
def highres_imu(s: VehicleSnapshot) -> Message:
    """HIGHRES_IMU: ``fields_updated`` says what is there; on the exact state, acceleration and rates alone.

    Of instruments it has means since the autopilot's last tick, at their middle.
    """
    reading, field, height, airspeed = inertial_reading(s), magnetic_field(s), s.readings.height, s.readings.airspeed
    xmag, ymag, zmag = (NOT_MEASURED,) * 3 if field is None else axes_on_wire(field)
    updated = ACCELERATION_AND_RATES | (0 if field is None else MAGNETIC_FIELD)
    updated |= (0 if height is None else STATIC_PRESSURE) | (0 if airspeed is None else DYNAMIC_PRESSURE)
    xacc, yacc, zacc = axes_on_wire(reading.force)
    xgyro, ygyro, zgyro = axes_on_wire(reading.rates)
    return mavlink.MAVLink_highres_imu_message(
        time_usec=units.microseconds(s.time - s.inertial_age),
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


@SENSOR_STREAMS.sends(mavlink.MAVLINK_MSG_ID_SCALED_IMU, 1.0)
def scaled_imu(s: VehicleSnapshot) -> Message:
    """SCALED_IMU: the same in thousandths of g and of rad/s; a magnetic field or temperature of 0 is not known."""
    (xacc, yacc, zacc), (xgyro, ygyro, zgyro) = _in_thousandths(inertial_reading(s))
    return mavlink.MAVLink_scaled_imu_message(s.ms, xacc, yacc, zacc, xgyro, ygyro, zgyro, xmag=0, ymag=0, zmag=0)


@SENSOR_STREAMS.sends(mavlink.MAVLINK_MSG_ID_RAW_IMU, 1.0)
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
