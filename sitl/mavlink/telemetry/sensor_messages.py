"""Messages of satellite receiver and pressure sensors, as they last read; nothing where there is no such sensor.

https://mavlink.io/en/messages/common.html#GPS_RAW_INT and the other messages named below
"""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.wire.message import Message
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.model.vectors import Vector
from sitl.sensors.specification import Gnss

UNKNOWN_UINT16, UNKNOWN_SATELLITES = 0xFFFF, 0xFF
MIN_COURSE_SPEED = 0.1  # slower, there is no course [m/s]
SEA_PRESSURE, LAPSE, SEA_TEMPERATURE, EXPONENT = 1013.25, 0.0065, 288.15, 5.25588  # of the standard atmosphere
CABIN_TEMPERATURE = 1500  # of the pressure sensors, that of the standard atmosphere [0.01 degC]
PASCALS = 100.0  # in a hectopascal


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
    above_sea = s.frame.origin.alt + height
    return float(SEA_PRESSURE * (1.0 - LAPSE * above_sea / SEA_TEMPERATURE) ** EXPONENT)


def dynamic_pressure(s: VehicleSnapshot, airspeed: float) -> float:
    """Of the air at a speed [hPa]."""
    return 0.5 * s.airframe.rho * airspeed * airspeed / PASCALS


def magnetic_field(s: VehicleSnapshot) -> Vector | None:
    """As read, body FLU [Gs]."""
    field = s.readings.field
    return None if field is None else Vector(1e4 * field.x, 1e4 * field.y, 1e4 * field.z)
