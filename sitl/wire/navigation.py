"""Further messages about where the vehicle is and what it flew, one function each, from one snapshot.

As in :mod:`sitl.wire.telemetry`: NED and FRD on the wire, and the body frame is the flying one.

https://mavlink.io/en/messages/common.html#ALTITUDE, #ODOMETRY, #HIL_STATE_QUATERNION, #FLIGHT_INFORMATION
"""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.codec import Message
from protocol.dialect import mavlink
from sitl.wire.snapshot import Picture

UNKNOWN_COVARIANCE = [math.nan] * 21
GOOD = 100  # quality of an estimate [%]


def altitude(s: Picture) -> Message:
    """ALTITUDE above the sea, the origin, home and the ground, which is level."""
    up, above_sea = s.p[2], s.frame.origin.alt + s.p[2]
    return mavlink.MAVLink_altitude_message(
        time_usec=units.microseconds(s.time),
        altitude_monotonic=above_sea,
        altitude_amsl=above_sea,
        altitude_local=up,
        altitude_relative=up - s.home[2],
        altitude_terrain=up,
        bottom_clearance=max(up, 0.0),
    )


def odometry(s: Picture) -> Message:
    """ODOMETRY: pose in the local frame, velocity [m/s] and rates [rad/s] in the flying body frame."""
    return mavlink.MAVLink_odometry_message(
        units.microseconds(s.time),
        mavlink.MAV_FRAME_LOCAL_NED,
        mavlink.MAV_FRAME_BODY_FRD,
        *frames.flip(s.p),
        frames.flip_quaternion(s.q),
        *frames.flip(frames.rotate(_conjugate(s.q), s.v)),
        *frames.flip(s.rates),
        UNKNOWN_COVARIANCE,
        UNKNOWN_COVARIANCE,
        0,
        mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT,
        GOOD,
    )


def ground_truth(s: Picture) -> Message:
    """HIL_STATE_QUATERNION: the simulated state itself. It carries no acceleration: those are 0."""
    here = s.frame.to_geodetic(frames.flip(s.p))
    airspeed = units.centimetres_per_second(s.airspeed)
    p, q, r = frames.flip(s.rates)
    north, east, down = (units.centimetres_per_second(speed) for speed in frames.flip(s.v))
    return mavlink.MAVLink_hil_state_quaternion_message(
        time_usec=units.microseconds(s.time),
        attitude_quaternion=frames.flip_quaternion(s.q),
        rollspeed=p,
        pitchspeed=q,
        yawspeed=r,
        lat=units.to_e7(here.lat_deg),
        lon=units.to_e7(here.lon_deg),
        alt=units.millimetres(here.alt),
        vx=north,
        vy=east,
        vz=down,
        ind_airspeed=airspeed,
        true_airspeed=airspeed,
        xacc=0,
        yacc=0,
        zacc=0,
    )


def flight_information(s: Picture) -> Message:
    """FLIGHT_INFORMATION: when this flight, or the last one, began and ended; times are since boot."""
    flight = s.flight
    return mavlink.MAVLink_flight_information_message(
        time_boot_ms=s.ms,
        arming_time_utc=units.microseconds(flight.armed_at),
        takeoff_time_utc=units.microseconds(flight.took_off_at),
        flight_uuid=flight.number,
        landing_time=units.milliseconds(flight.landed_at),
    )


def _conjugate(q: frames.Quaternion) -> frames.Quaternion:
    return q[0], -q[1], -q[2], -q[3]
