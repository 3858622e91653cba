"""Messages of the navigation filter: how far it is to be trusted. A vehicle that sees the truth has none.

https://mavlink.io/en/messages/common.html#ESTIMATOR_STATUS and the other messages named below
"""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.frames import COVARIANCE_DIAGONAL, COVARIANCE_SIZE
from protocol.wire.message import Message
from sitl.mavlink.telemetry.body_frame import attitude_on_wire, axes_on_wire
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.sensors.instruments import ACCELEROMETER, BAROMETER, EXTERNAL_POSE, GNSS, MAGNETOMETER, MOTION_CAPTURE, PITOT
from sitl.simulation.avionics import Navigation

UNKNOWN_COVARIANCE = [math.nan] * COVARIANCE_SIZE
GOOD, POOR = 100, 1  # quality of an odometry [%]
COUNTER = 256  # where the counter of resets begins anew
WHILE_ALIGNED = (
    mavlink.ESTIMATOR_ATTITUDE
    | mavlink.ESTIMATOR_VELOCITY_HORIZ
    | mavlink.ESTIMATOR_VELOCITY_VERT
    | mavlink.ESTIMATOR_POS_HORIZ_REL
    | mavlink.ESTIMATOR_POS_VERT_ABS
    | mavlink.ESTIMATOR_PRED_POS_HORIZ_REL
)
WHILE_AIDED = mavlink.ESTIMATOR_POS_HORIZ_ABS | mavlink.ESTIMATOR_PRED_POS_HORIZ_ABS


def estimator_status(s: VehicleSnapshot) -> list[Message]:
    """ESTIMATOR_STATUS: ratios above 1 are of refused readings; a position that nothing aids is a relative one."""
    n = s.navigation
    if not n.is_sensed:
        return []
    glitch = n.aid(GNSS).reads and n.is_aligned and not n.aid(GNSS).helps
    flags = (WHILE_ALIGNED if n.is_aligned else 0) | (WHILE_AIDED if n.is_aligned and s.has_position else 0)
    flags |= mavlink.ESTIMATOR_GPS_GLITCH if glitch else 0
    flags |= mavlink.ESTIMATOR_ACCEL_ERROR if n.failed[ACCELEROMETER] else 0
    outdoors = n.source is Navigation.SENSORS
    place = n.aid(GNSS).ratio if outdoors else max(n.aid(MOTION_CAPTURE).ratio, n.aid(EXTERNAL_POSE).ratio)
    return [
        mavlink.MAVLink_estimator_status_message(
            time_usec=units.microseconds(s.time),
            flags=flags,
            vel_ratio=place if outdoors else math.nan,
            pos_horiz_ratio=place,
            pos_vert_ratio=n.aid(BAROMETER).ratio if outdoors else place,
            mag_ratio=n.aid(MAGNETOMETER).ratio if outdoors else math.nan,
            hagl_ratio=math.nan,
            tas_ratio=n.aid(PITOT).ratio,
            pos_horiz_accuracy=math.hypot(*n.position_deviation[:2]),
            pos_vert_accuracy=n.position_deviation.z,
        )
    ]


def odometry(s: VehicleSnapshot) -> Message:
    """ODOMETRY: pose in the local frame, velocity [m/s] and rates [rad/s] in the hover frame, with their variances."""
    x, y, z = frames.flip(s.p)
    vx, vy, vz = axes_on_wire(frames.rotate(_conjugate(s.q), s.v))
    rollspeed, pitchspeed, yawspeed = axes_on_wire(s.rates)
    n = s.navigation
    kind = mavlink.MAV_ESTIMATOR_TYPE_AUTOPILOT if n.is_sensed else mavlink.MAV_ESTIMATOR_TYPE_NAIVE
    return mavlink.MAVLink_odometry_message(
        time_usec=units.microseconds(s.time),
        frame_id=mavlink.MAV_FRAME_LOCAL_NED,
        child_frame_id=mavlink.MAV_FRAME_BODY_FRD,
        x=x,
        y=y,
        z=z,
        q=attitude_on_wire(s.q),
        vx=vx,
        vy=vy,
        vz=vz,
        rollspeed=rollspeed,
        pitchspeed=pitchspeed,
        yawspeed=yawspeed,
        pose_covariance=_pose_covariance(s),
        velocity_covariance=_velocity_covariance(s),
        reset_counter=n.resets % COUNTER,
        estimator_type=kind,
        quality=GOOD if s.has_position else POOR,
    )


def _pose_covariance(s: VehicleSnapshot) -> list[float]:
    """Variances of north, east, down [m2] and about the body's axes [rad2]; those between them are left at 0."""
    if not s.navigation.is_sensed:
        return UNKNOWN_COVARIANCE
    turns = map(abs, axes_on_wire(s.navigation.attitude_deviation))
    return _diagonal((*s.navigation.position_deviation, *turns))


def _velocity_covariance(s: VehicleSnapshot) -> list[float]:
    """Variances along the body's axes, each at most that of the worst axis of the world; the rates' are not known."""
    if not s.navigation.is_sensed:
        return UNKNOWN_COVARIANCE
    worst = max(s.navigation.velocity_deviation)
    return _diagonal((worst, worst, worst, math.nan, math.nan, math.nan))


def _diagonal(deviations: tuple[float, ...]) -> list[float]:
    triangle = [0.0] * COVARIANCE_SIZE
    for k, deviation in zip(COVARIANCE_DIAGONAL, deviations, strict=True):
        triangle[k] = deviation**2
    return triangle


def _conjugate(q: frames.Array) -> frames.Quaternion:
    return float(q[0]), -float(q[1]), -float(q[2]), -float(q[3])
