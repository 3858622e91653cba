"""What the vehicle says of itself: one function per message, from one snapshot of the vehicle.

The flight controller's frames (NWU, FLU) become the wire's (NED, FRD) here and nowhere else. The body frame
of every message is the flying one: nose-up hover is pitch +90 deg; ATTITUDE_QUATERNION.repr_offset_q lets a
display show hover as level.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property
from typing import NamedTuple

from protocol import frames, units
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.modes import Mode, custom_mode
from sitl.autopilot.standard_modes import available_modes_monitor, current_mode
from sitl.wire import hybrid
from sitl.wire.metadata import GENERAL_URI, general_crc
from sitl.wire.navigation import altitude, flight_information, ground_truth, odometry
from sitl.wire.snapshot import Picture, Status

NO_BATTERY_CELL = 65535
MAVLINK_VERSION = 3  # of HEARTBEAT


def heartbeat(s: Status, autopilot: int = mavlink.MAV_AUTOPILOT_PX4) -> Message:
    """HEARTBEAT of a VTOL tail-sitter; the modes are PX4's, whatever MAV_AUTOPILOT it calls itself."""
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED if s.mode.is_auto else mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED if s.armed else 0
    flying = mavlink.MAV_STATE_CRITICAL if s.critical else mavlink.MAV_STATE_ACTIVE
    state = mavlink.MAV_STATE_STANDBY if s.landed else flying
    return mavlink.MAVLink_heartbeat_message(
        type=mavlink.MAV_TYPE_VTOL_DUOROTOR,
        autopilot=autopilot,
        base_mode=base,
        custom_mode=custom_mode(s.mode),
        system_status=state,
        mavlink_version=MAVLINK_VERSION,
    )


SENSORS = (
    mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL
    | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG
    | mavlink.MAV_SYS_STATUS_SENSOR_GPS
    | mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION
    | mavlink.MAV_SYS_STATUS_SENSOR_BATTERY
    | mavlink.MAV_SYS_STATUS_GEOFENCE
)


def sys_status(s: Picture) -> Message:
    """SYS_STATUS: every simulated sensor is healthy; the pre-arm bit is the arming checks' verdict."""
    present = SENSORS | mavlink.MAV_SYS_STATUS_PREARM_CHECK
    enabled = present if s.fenced else present & ~mavlink.MAV_SYS_STATUS_GEOFENCE
    health = SENSORS & ~(mavlink.MAV_SYS_STATUS_GEOFENCE if s.fence.breached else 0)
    health |= mavlink.MAV_SYS_STATUS_PREARM_CHECK if s.ready or s.armed else 0
    return mavlink.MAVLink_sys_status_message(
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=enabled,
        onboard_control_sensors_health=health,
        load=0,
        voltage_battery=units.millivolts(s.battery.voltage),
        current_battery=units.centiamperes(s.battery.current(s.power)),
        battery_remaining=units.percent(s.battery.left),
        drop_rate_comm=0,
        errors_comm=0,
        errors_count1=0,
        errors_count2=0,
        errors_count3=0,
        errors_count4=0,
    )


def attitude(s: Picture) -> Message:
    """ATTITUDE of the flying body frame."""
    roll, pitch, yaw = frames.euler_from_quaternion(frames.flip_quaternion(s.q))
    return mavlink.MAVLink_attitude_message(s.ms, roll, pitch, yaw, *frames.flip(s.rates))


def attitude_quaternion(s: Picture) -> Message:
    """ATTITUDE_QUATERNION of the flying body frame, shown as the hovering one while it hovers."""
    q = frames.flip_quaternion(s.q)
    return mavlink.MAVLink_attitude_quaternion_message(
        s.ms, *q, *frames.flip(s.rates), repr_offset_q=list(frames.HOVER_DISPLAY)
    )


def local_position(s: Picture) -> Message:
    """LOCAL_POSITION_NED."""
    return mavlink.MAVLink_local_position_ned_message(s.ms, *frames.flip(s.p), *frames.flip(s.v))


def global_position(s: Picture) -> Message:
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


def gps_raw(s: Picture) -> Message:
    """GPS_RAW_INT of an ideal receiver."""
    here = s.frame.to_geodetic(frames.flip(s.p))
    ground_speed = math.hypot(s.v[0], s.v[1])
    course = math.atan2(-s.v[1], s.v[0]) if ground_speed > 0.1 else math.nan
    return mavlink.MAVLink_gps_raw_int_message(
        time_usec=units.microseconds(s.time),
        fix_type=mavlink.GPS_FIX_TYPE_RTK_FIXED,
        lat=units.to_e7(here.lat_deg),
        lon=units.to_e7(here.lon_deg),
        alt=units.millimetres(here.alt),
        eph=50,
        epv=50,
        vel=units.centimetres_per_second(ground_speed),
        cog=units.centidegrees(course),
        satellites_visible=20,
    )


def position_target(s: Picture) -> Message:
    """POSITION_TARGET_LOCAL_NED: the set-point of the hover laws."""
    unused = 0b0000_1001_1111_1000  # velocity, acceleration, yaw rate
    return mavlink.MAVLink_position_target_local_ned_message(
        s.ms, mavlink.MAV_FRAME_LOCAL_NED, unused, *frames.flip(s.reference.position), 0, 0, 0, 0, 0, 0,
        -s.reference.heading, 0,
    )  # fmt: skip


def vfr_hud(s: Picture) -> Message:
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


def extended_state(s: Picture) -> Message:
    """EXTENDED_SYS_STATE: upright, on the wing or between, and whether the ground is left."""
    if s.landed:
        landed = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif s.landing:
        landed = mavlink.MAV_LANDED_STATE_LANDING
    elif s.taking_off:
        landed = mavlink.MAV_LANDED_STATE_TAKEOFF
    else:
        landed = mavlink.MAV_LANDED_STATE_IN_AIR
    return mavlink.MAVLink_extended_sys_state_message(VTOL_STATES[s.law.regime], landed)


VTOL_STATES: dict[Regime, int] = {
    Regime.GROUND: mavlink.MAV_VTOL_STATE_MC,
    Regime.UPRIGHT: mavlink.MAV_VTOL_STATE_MC,
    Regime.FRONT_TRANSITION: mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW,
    Regime.FORWARD: mavlink.MAV_VTOL_STATE_FW,
    Regime.BACK_TRANSITION: mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC,
}


def battery_status(s: Picture) -> Message:
    """BATTERY_STATUS of the energy model."""
    return mavlink.MAVLink_battery_status_message(
        id=0,
        battery_function=mavlink.MAV_BATTERY_FUNCTION_ALL,
        type=mavlink.MAV_BATTERY_TYPE_LIPO,
        temperature=0x7FFF,
        voltages=[units.millivolts(s.battery.voltage)] + [NO_BATTERY_CELL] * 9,
        current_battery=units.centiamperes(s.battery.current(s.power)),
        current_consumed=-1,
        energy_consumed=round(s.energy / 100.0),  # hJ
        battery_remaining=units.percent(s.battery.left),
    )


def home_position(s: Picture) -> Message:
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


def global_origin(s: Picture) -> Message:
    """GPS_GLOBAL_ORIGIN of the local frame."""
    origin = s.frame.origin
    return mavlink.MAVLink_gps_global_origin_message(
        units.to_e7(origin.lat_deg), units.to_e7(origin.lon_deg), units.millimetres(origin.alt),
        units.microseconds(s.time),
    )  # fmt: skip


def wind(s: Picture) -> Message:
    """WIND_COV: the wind as the vehicle estimates it."""
    north, east, down = frames.flip(s.wind_estimate)
    level, vertical = max(s.wind_deviation[:2]), s.wind_deviation[2]
    return mavlink.MAVLink_wind_cov_message(
        time_usec=units.microseconds(s.time),
        wind_x=north,
        wind_y=east,
        wind_z=down,
        var_horiz=level**2,
        var_vert=vertical**2,
        wind_alt=s.frame.origin.alt + s.p[2],
        horiz_accuracy=level,
        vert_accuracy=vertical,
    )


def controller_output(s: Picture) -> Message:
    """NAV_CONTROLLER_OUTPUT: where the vehicle is beside its path; positive cross-track error is to the right of it."""
    there, here = frames.flip(s.reference.position), frames.flip(s.p)
    north, east, down = (to - at for to, at in zip(there, here, strict=True))
    roll, pitch, _ = frames.euler_from_quaternion(frames.flip_quaternion(s.q))
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


def actuator_output(s: Picture) -> Message:
    """ACTUATOR_OUTPUT_STATUS: motors 0..1 of their fastest, elevons -1..1 of their largest."""
    values = [w / s.motor_max for w in s.motor] + [d / s.elevon_max for d in s.elevon]
    return mavlink.MAVLink_actuator_output_status_message(units.microseconds(s.time), 4, values + [0.0] * 28)


def mission_current(s: Picture) -> Message:
    """MISSION_CURRENT with the mission's state."""
    return mavlink.MAVLink_mission_current_message(
        s.mission_current, s.mission_count, s.mission_state, int(s.mode is Mode.MISSION)
    )


def fence_status(s: Picture) -> Message:
    """FENCE_STATUS: a breach that is only predicted counts as one."""
    return mavlink.MAVLink_fence_status_message(
        breach_status=int(s.fence.breached),
        breach_count=s.fence.count,
        breach_type=s.fence.kind,
        breach_time=units.milliseconds(s.fence.time),
        breach_mitigation=mavlink.FENCE_MITIGATE_NONE,
    )


def system_time(s: Picture) -> Message:
    """SYSTEM_TIME without a wall clock: simulated flights have no date."""
    return mavlink.MAVLink_system_time_message(0, s.ms)


def autopilot_version(s: Picture) -> Message:  # noqa: ARG001 - one signature for all
    """AUTOPILOT_VERSION with the capabilities that are real."""
    capabilities = (
        mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_FENCE
        | mavlink.MAV_PROTOCOL_CAPABILITY_MISSION_RALLY
        | mavlink.MAV_PROTOCOL_CAPABILITY_COMMAND_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_PARAM_ENCODE_BYTEWISE
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_LOCAL_NED
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_POSITION_TARGET_GLOBAL_INT
        | mavlink.MAV_PROTOCOL_CAPABILITY_SET_ATTITUDE_TARGET
        | mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
        | mavlink.MAV_PROTOCOL_CAPABILITY_FTP
    )
    return mavlink.MAVLink_autopilot_version_message(
        capabilities=capabilities,
        flight_sw_version=release_word(),
        middleware_sw_version=0,
        os_sw_version=0,
        board_version=0,
        flight_custom_version=[0] * 8,
        middleware_custom_version=[0] * 8,
        os_custom_version=[0] * 8,
        vendor_id=0,
        product_id=0,
        uid=0,
    )


def protocol_version(s: Picture) -> Message:  # noqa: ARG001
    """PROTOCOL_VERSION: MAVLink 1 and 2 are understood, 2 is spoken."""
    return mavlink.MAVLink_protocol_version_message(200, 100, 200, [0] * 8, [0] * 8)


def control_status(s: Picture) -> Message:
    """CONTROL_STATUS of the whole system: one station in control, or none."""
    flags = mavlink.GCS_CONTROL_STATUS_FLAGS_SYSTEM_MANAGER
    flags |= mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED if s.takeover else 0
    return mavlink.MAVLink_control_status_message(flags, s.in_control, [0] * 10)


def component_metadata(s: Picture) -> Message:
    """COMPONENT_METADATA: where the file is that describes the vehicle to ground stations."""
    return mavlink.MAVLink_component_metadata_message(s.ms, general_crc(), GENERAL_URI.encode("ascii"))


def release_word() -> int:
    """The package's version as AUTOPILOT_VERSION carries it."""
    from importlib.metadata import version  # noqa: PLC0415

    major, minor, patch = (int(part) for part in version("darko").split("."))
    return major << 24 | minor << 16 | patch << 8 | int(mavlink.FIRMWARE_VERSION_TYPE_OFFICIAL)


class Stream(NamedTuple):
    """A message, how it is made, and how often it goes out by itself [Hz]; 0: on request only."""

    message_id: int
    build: Callable[[Picture], Message]
    rate: float


STREAMS = (
    Stream(mavlink.MAVLINK_MSG_ID_SYS_STATUS, sys_status, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_ATTITUDE, attitude, 20.0),
    Stream(mavlink.MAVLINK_MSG_ID_ATTITUDE_QUATERNION, attitude_quaternion, 20.0),
    Stream(mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED, local_position, 20.0),
    Stream(mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, global_position, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_GPS_RAW_INT, gps_raw, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_ALTITUDE, altitude, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_ODOMETRY, odometry, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_HIL_STATE_QUATERNION, ground_truth, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_POSITION_TARGET_LOCAL_NED, position_target, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_VFR_HUD, vfr_hud, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, extended_state, 2.0),
    Stream(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, battery_status, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_HOME_POSITION, home_position, 0.5),
    Stream(mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN, global_origin, 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_WIND_COV, wind, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_AIR, hybrid.air, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT, controller_output, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS, actuator_output, 5.0),
    Stream(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, mission_current, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_FENCE_STATUS, fence_status, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, system_time, 1.0),
    Stream(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, autopilot_version, 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION, flight_information, 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_CURRENT_MODE, lambda s: current_mode(s.mode, s.intended), 0.5),
    # To be sent by itself only once the list has changed, which it never does.
    Stream(mavlink.MAVLINK_MSG_ID_AVAILABLE_MODES_MONITOR, lambda _: available_modes_monitor(), 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_CONTROL_STATUS, control_status, 0.5),
    Stream(mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION, protocol_version, 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA, component_metadata, 0.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE, hybrid.hybrid_state, 10.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS, hybrid.actuators, 20.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_ENERGY, hybrid.energy, 2.0),
)
BUILDERS = {s.message_id: s.build for s in STREAMS} | {mavlink.MAVLINK_MSG_ID_HEARTBEAT: lambda s: heartbeat(s.status)}


class Instant:
    """What can be told of one instant: its picture is taken, and each message made of it, once and only when asked for.

    Args:
        take: Takes the picture.
    """

    def __init__(self, take: Callable[[], Picture]) -> None:
        self._take = take
        self._messages: dict[int, Message] = {}

    @cached_property
    def picture(self) -> Picture:
        """The vehicle as it is."""
        return self._take()

    def message(self, message_id: int) -> Message:
        """A message of :data:`BUILDERS`."""
        if message_id not in self._messages:
            self._messages[message_id] = BUILDERS[message_id](self.picture)
        return self._messages[message_id]
