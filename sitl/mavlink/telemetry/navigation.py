"""Messages of navigation: attitude, position, and the estimator's own."""

from __future__ import annotations

import math

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.frames import COVARIANCE_DIAGONAL, COVARIANCE_SIZE
from protocol.wire.message import Message
from sitl.mavlink.telemetry.streams import SENSED, StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.sensors.instruments import ACCELEROMETER, BAROMETER, EXTERNAL_POSE, GNSS, MAGNETOMETER, MOTION_CAPTURE, PITOT
from sitl.simulation.avionics import Navigation

# Messages about where the vehicle is and where it goes, one function each.
#
# The flight controller's frames (NWU, FLU) become those of MAVLink here: NED, and the hover frame.
#
# https://mavlink.io/en/messages/common.html#ATTITUDE and the other messages named below

# The body frame of every message: the hover frame of a tail-sitter, as PX4 has it, also in forward flight.
#
# A nose-up hover is level; level forward flight has pitch -90 deg, and a ``repr_offset_q`` that displays pitch it up
# by.

NAVIGATION_STREAMS = StreamTable()
MAX_ARENA_NAME = 30  # [bytes]


def attitude_on_wire(q: frames.Array) -> frames.Quaternion:
    """An attitude as messages tell it, hover frame FRD -> NED, from the vehicle's own, FLU -> NWU."""
    return frames.hover_attitude(frames.flip_quaternion(q))


def axes_on_wire(v: frames.Array) -> frames.Vector:
    """A body vector as messages tell it, hover frame FRD, from the vehicle's own, FLU."""
    return frames.hover_axes(frames.flip(v))


POSITION_AND_YAW = 0b0000_1001_1111_1000  # POSITION_TARGET_TYPEMASK: velocity, acceleration and yaw rate are ignored


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ATTITUDE, 20.0, once_aligned=True)
def attitude(s: VehicleSnapshot) -> Message:
    """ATTITUDE of the hover frame."""
    roll, pitch, yaw = frames.euler_from_quaternion(attitude_on_wire(s.q))
    rollspeed, pitchspeed, yawspeed = axes_on_wire(s.rates)
    return mavlink.MAVLink_attitude_message(
        time_boot_ms=s.ms,
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        rollspeed=rollspeed,
        pitchspeed=pitchspeed,
        yawspeed=yawspeed,
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, 20.0, once_aligned=True)
def attitude_quaternion(s: VehicleSnapshot) -> Message:
    """ATTITUDE_QUATERNION of the hover frame; repr_offset_q lets a display show level forward flight as level."""
    q1, q2, q3, q4 = attitude_on_wire(s.q)
    rollspeed, pitchspeed, yawspeed = axes_on_wire(s.rates)
    forward = s.regime is Regime.FORWARD
    return mavlink.MAVLink_attitude_quaternion_message(
        time_boot_ms=s.ms,
        q1=q1,
        q2=q2,
        q3=q3,
        q4=q4,
        rollspeed=rollspeed,
        pitchspeed=pitchspeed,
        yawspeed=yawspeed,
        repr_offset_q=list(frames.SHOW_PITCHED_UP if forward else frames.SHOW_AS_TOLD),
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_ARENA, 0.2)
def arena(s: VehicleSnapshot) -> Message | list[Message]:
    """DARKO_ARENA: the net; none without one."""
    if not s.arena.has_net:
        return []
    return mavlink.MAVLink_darko_arena_message(
        x=s.arena.north,
        y=-s.arena.west,
        heading=-s.arena.course,
        length=2.0 * s.arena.half_length,
        width=2.0 * s.arena.half_width,
        height=s.arena.height,
        margin=s.arena.margin,
        name=s.arena.name.encode()[:MAX_ARENA_NAME],
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, 20.0, once_aligned=True)
def local_position(s: VehicleSnapshot) -> Message:
    """LOCAL_POSITION_NED."""
    x, y, z = frames.flip(s.p)
    vx, vy, vz = frames.flip(s.v)
    return mavlink.MAVLink_local_position_ned_message(time_boot_ms=s.ms, x=x, y=y, z=z, vx=vx, vy=vy, vz=vz)


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 5.0, once_aligned=True)
def global_position(s: VehicleSnapshot) -> Message:
    """GLOBAL_POSITION_INT."""
    here = s.frame.to_geodetic(frames.flip(s.p))
    north, east, down = frames.flip(s.v)
    return mavlink.MAVLink_global_position_int_message(
        time_boot_ms=s.ms,
        lat=units.to_e7(here.lat_deg),
        lon=units.to_e7(here.lon_deg),
        alt=units.millimetres(here.alt),
        relative_alt=units.millimetres(s.p[2] - s.home[2]),
        vx=units.centimetres_per_second(north),
        vy=units.centimetres_per_second(east),
        vz=units.centimetres_per_second(down),
        hdg=units.centidegrees(s.yaw),
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ALTITUDE, 1.0, once_aligned=True)
def altitude(s: VehicleSnapshot) -> Message:
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


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, 1.0)
def ground_truth(s: VehicleSnapshot) -> Message:
    """HIL_STATE_QUATERNION: the simulated state itself. It carries no acceleration: those are 0."""
    body = s.plant.body
    here = s.frame.to_geodetic(frames.flip(body.position))
    airspeed = units.centimetres_per_second(s.airspeed)
    p, q, r = axes_on_wire(body.rates)
    north, east, down = (units.centimetres_per_second(speed) for speed in frames.flip(body.velocity))
    return mavlink.MAVLink_hil_state_quaternion_message(
        time_usec=units.microseconds(s.time),
        attitude_quaternion=attitude_on_wire(body.attitude),
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


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_VFR_HUD, 5.0)
def vfr_hud(s: VehicleSnapshot) -> Message:
    """VFR_HUD; throttle is the mean motor speed between its limits."""
    span = s.motor_max - s.motor_min
    throttle = min(max((sum(s.motor) / 2.0 - s.motor_min) / span, 0.0), 1.0)
    return mavlink.MAVLink_vfr_hud_message(
        airspeed=s.airspeed_estimate,
        groundspeed=math.hypot(s.v[0], s.v[1]),
        heading=units.centidegrees(s.yaw) // 100,
        throttle=round(100 * throttle),
        alt=s.frame.origin.alt + s.p[2],
        climb=s.v[2],
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED, 5.0)
def position_target(s: VehicleSnapshot) -> Message:
    """POSITION_TARGET_LOCAL_NED: the set-point of the hover laws."""
    x, y, z = frames.flip(s.reference.position)
    return mavlink.MAVLink_position_target_local_ned_message(
        time_boot_ms=s.ms,
        coordinate_frame=mavlink.MAV_FRAME_LOCAL_NED,
        type_mask=POSITION_AND_YAW,
        x=x,
        y=y,
        z=z,
        vx=0,
        vy=0,
        vz=0,
        afx=0,
        afy=0,
        afz=0,
        yaw=-s.reference.heading,
        yaw_rate=0,
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, 5.0)
def controller_output(s: VehicleSnapshot) -> Message:
    """NAV_CONTROLLER_OUTPUT: where the vehicle is beside its path; the cross-track error is positive to its right."""
    there, here = frames.flip(s.reference.position), frames.flip(s.p)
    north, east, down = (to - at for to, at in zip(there, here, strict=True))
    roll, pitch, _ = frames.euler_from_quaternion(attitude_on_wire(s.q))
    bearing = round(math.degrees(math.atan2(east, north)))
    course = round(math.degrees(math.atan2(-s.v[1], s.v[0])))
    return mavlink.MAVLink_nav_controller_output_message(
        nav_roll=math.degrees(roll),
        nav_pitch=math.degrees(pitch),
        nav_bearing=course,
        target_bearing=bearing,
        wp_dist=min(round(math.hypot(north, east)), 65535),
        alt_error=-down,
        aspd_error=0.0,
        xtrack_error=-s.cross_track,
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_HOME_POSITION, 0.5)
def home_position(s: VehicleSnapshot) -> Message:
    """HOME_POSITION: on level ground, and approached from straight above, at the height of a return."""
    north, east, down = frames.flip(s.home)
    home = s.frame.to_geodetic((north, east, down))
    return mavlink.MAVLink_home_position_message(
        latitude=units.to_e7(home.lat_deg),
        longitude=units.to_e7(home.lon_deg),
        altitude=units.millimetres(home.alt),
        x=north,
        y=east,
        z=down,
        q=[1, 0, 0, 0],
        approach_x=north,
        approach_y=east,
        approach_z=down - s.return_altitude,
        time_usec=units.microseconds(s.time),
    )


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, 0.0)
def global_origin(s: VehicleSnapshot) -> Message:
    """GPS_GLOBAL_ORIGIN of the local frame."""
    origin = s.frame.origin
    return mavlink.MAVLink_gps_global_origin_message(
        latitude=units.to_e7(origin.lat_deg),
        longitude=units.to_e7(origin.lon_deg),
        altitude=units.millimetres(origin.alt),
        time_usec=units.microseconds(s.time),
    )


# Messages of the navigation filter: how far it is to be trusted. A vehicle that sees the truth has none.
#
# https://mavlink.io/en/messages/common.html#ESTIMATOR_STATUS and the other messages named below


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


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ESTIMATOR_STATUS, 1.0, SENSED)
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


@NAVIGATION_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ODOMETRY, 5.0, once_aligned=True)
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
