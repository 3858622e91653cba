"""What the vehicle says of itself: one function per message, from one snapshot of the vehicle.

The flight controller's frames (NWU, FLU) become the wire's (NED, FRD) here and nowhere else. The body frame
of every message is the flying one: nose-up hover is pitch +90 deg; ATTITUDE_QUATERNION.repr_offset_q lets a
display show hover as level.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

from protocol import frames, units
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.modes import Mode, custom_mode
from sitl.autopilot.decision import Decision
from sitl.autopilot.standard_modes import available_modes_monitor, current_mode
from sitl.hybrid.supervisor import Law
from sitl.wire.metadata import GENERAL_URI, general_crc
from sitl.wire.navigation import altitude, flight_information, ground_truth, odometry
from sitl.wire.snapshot import Picture

NAN = math.nan
NO_BATTERY_CELL = 65535


def heartbeat(s: Picture, autopilot: int = mavlink.MAV_AUTOPILOT_PX4) -> Message:
    """HEARTBEAT of a VTOL tail-sitter; the modes are PX4's, whatever MAV_AUTOPILOT it calls itself."""
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED if s.mode.is_auto else mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED if s.armed else 0
    flying = mavlink.MAV_STATE_CRITICAL if s.critical else mavlink.MAV_STATE_ACTIVE
    state = mavlink.MAV_STATE_STANDBY if s.landed else flying
    return mavlink.MAVLink_heartbeat_message(
        mavlink.MAV_TYPE_VTOL_DUOROTOR,
        autopilot,
        base,
        custom_mode(s.mode),
        state,
        3,
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
        present,
        enabled,
        health,
        0,
        units.millivolts(s.battery.voltage),
        units.centiamperes(s.battery.current(s.power)),
        units.percent(s.battery.left),
        0, 0, 0, 0, 0, 0,
    )  # fmt: skip


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
        s.ms,
        units.to_e7(here.lat_deg),
        units.to_e7(here.lon_deg),
        units.millimetres(here.alt),
        units.millimetres(s.p[2] - s.home[2]),
        units.centimetres_per_second(north),
        units.centimetres_per_second(east),
        units.centimetres_per_second(down),
        units.centidegrees(s.yaw),
    )


def gps_raw(s: Picture) -> Message:
    """GPS_RAW_INT of an ideal receiver."""
    here = s.frame.to_geodetic(frames.flip(s.p))
    ground_speed = math.hypot(s.v[0], s.v[1])
    course = math.atan2(-s.v[1], s.v[0]) if ground_speed > 0.1 else NAN
    return mavlink.MAVLink_gps_raw_int_message(
        units.microseconds(s.time),
        mavlink.GPS_FIX_TYPE_RTK_FIXED,
        units.to_e7(here.lat_deg),
        units.to_e7(here.lon_deg),
        units.millimetres(here.alt),
        50,
        50,
        units.centimetres_per_second(ground_speed),
        units.centidegrees(course),
        20,
    )


def position_target(s: Picture) -> Message:
    """POSITION_TARGET_LOCAL_NED: the set-point of the hover laws."""
    unused = 0b0000_1001_1111_1000  # velocity, acceleration, yaw rate
    return mavlink.MAVLink_position_target_local_ned_message(
        s.ms, mavlink.MAV_FRAME_LOCAL_NED, unused, *frames.flip(s.setpoint.p), 0, 0, 0, 0, 0, 0,
        -s.setpoint.heading, 0,
    )  # fmt: skip


def vfr_hud(s: Picture) -> Message:
    """VFR_HUD; throttle is the mean motor speed between its limits."""
    span = s.motor_max - s.motor_min
    throttle = min(max((sum(s.motor) / 2.0 - s.motor_min) / span, 0.0), 1.0)
    return mavlink.MAVLink_vfr_hud_message(
        s.airspeed_estimate,
        math.hypot(s.v[0], s.v[1]),
        units.centidegrees(s.yaw) // 100,
        round(100 * throttle),
        s.frame.origin.alt + s.p[2],
        s.v[2],
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
    return mavlink.MAVLink_extended_sys_state_message(VTOL_STATES.get(s.law, mavlink.MAV_VTOL_STATE_MC), landed)


VTOL_STATES: dict[int, int] = {
    Law.TO_FORWARD: mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW,
    Law.FORWARD_LINE_OF_SIGHT: mavlink.MAV_VTOL_STATE_FW,
    Law.FORWARD_LINEAR: mavlink.MAV_VTOL_STATE_FW,
    Law.TO_HOVER: mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC,
}


def battery_status(s: Picture) -> Message:
    """BATTERY_STATUS of the energy model."""
    return mavlink.MAVLink_battery_status_message(
        0,
        mavlink.MAV_BATTERY_FUNCTION_ALL,
        mavlink.MAV_BATTERY_TYPE_LIPO,
        0x7FFF,
        [units.millivolts(s.battery.voltage)] + [NO_BATTERY_CELL] * 9,
        units.centiamperes(s.battery.current(s.power)),
        -1,
        round(s.energy / 100.0),  # hJ
        units.percent(s.battery.left),
    )


def home_position(s: Picture) -> Message:
    """HOME_POSITION: on level ground, and approached from straight above, at the height of a return."""
    north, east, down = frames.flip(s.home)
    home = s.frame.to_geodetic((north, east, down))
    return mavlink.MAVLink_home_position_message(
        units.to_e7(home.lat_deg), units.to_e7(home.lon_deg), units.millimetres(home.alt),
        north, east, down, [1, 0, 0, 0], north, east, down - s.return_altitude, units.microseconds(s.time),
    )  # fmt: skip


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
        units.microseconds(s.time),
        north,
        east,
        down,
        level**2,
        vertical**2,
        s.frame.origin.alt + s.p[2],
        level,
        vertical,
    )


def air(s: Picture) -> Message:
    """DARKO_AIR: the estimated wind beside the true one."""
    estimate, true = frames.flip(s.wind_estimate), frames.flip(s.wind)
    return mavlink.MAVLink_darko_air_message(s.ms, list(estimate), list(true), s.airspeed_estimate, s.airspeed)


def controller_output(s: Picture) -> Message:
    """NAV_CONTROLLER_OUTPUT: where the vehicle is beside its path; positive cross-track error is to the right of it."""
    north, east, down = (to - here for to, here in zip(frames.flip(s.setpoint.p), frames.flip(s.p), strict=True))
    roll, pitch, _ = frames.euler_from_quaternion(frames.flip_quaternion(s.q))
    bearing = round(math.degrees(math.atan2(east, north)))
    course = round(math.degrees(math.atan2(-s.v[1], s.v[0])))
    return mavlink.MAVLink_nav_controller_output_message(
        math.degrees(roll), math.degrees(pitch), course, bearing, min(round(math.hypot(north, east)), 65535),
        -down, 0.0, -s.cross_track,
    )  # fmt: skip


def decision(ms: int, seq: int, made: Decision) -> Message:
    """DARKO_DECISION of one leg."""
    leg = made.leg
    return mavlink.MAVLink_darko_decision_message(
        ms, leg.distance, leg.climb, leg.tail_wind, leg.cross_wind, *made.hover, *made.forward, seq,
        int(made.way), int(made.why),
    )  # fmt: skip


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
        int(s.fence.breached), s.fence.count, s.fence.kind, units.milliseconds(s.fence.time),
        mavlink.FENCE_MITIGATE_NONE,
    )  # fmt: skip


def hybrid_state(s: Picture) -> Message:
    """DARKO_HYBRID_STATE."""
    return mavlink.MAVLink_darko_hybrid_state_message(
        s.ms,
        s.jumps,
        s.lyapunov,
        s.lyapunov_forward,
        s.v_enter,
        s.v_leave,
        s.governor,
        s.law,
        s.last_law,
        s.last_reason,
        s.lyapunov_attitude,
    )


def actuators(s: Picture) -> Message:
    """DARKO_ACTUATORS."""
    return mavlink.MAVLink_darko_actuators_message(
        s.ms, list(s.motor), list(s.motor_command), [s.k_f * w * w for w in s.motor],
        list(s.elevon), list(s.elevon_command), s.motor_min, s.motor_max, s.elevon_max, s.limits, s.given_up,
    )  # fmt: skip


def energy(s: Picture) -> Message:
    """DARKO_ENERGY."""
    *by_law, attitude_law = s.energy_by_law  # the array is as long as the list of laws once was
    return mavlink.MAVLink_darko_energy_message(s.ms, s.power, s.energy, by_law, attitude_law)


def named_values(s: Picture) -> list[Message]:
    """The hybrid controller's key numbers as NAMED_VALUE_FLOAT."""
    values = {"V": s.lyapunov, "law": float(s.law), "jumps": float(s.jumps), "governor": s.governor, "power": s.power}
    return [
        mavlink.MAVLink_named_value_float_message(s.ms, name.encode("ascii"), value) for name, value in values.items()
    ]


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
        capabilities, release_word(), 0, 0, 0, [0] * 8, [0] * 8, [0] * 8, 0, 0, 0
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
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_AIR, air, 5.0),
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
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE, hybrid_state, 10.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS, actuators, 20.0),
    Stream(mavlink.MAVLINK_MSG_ID_DARKO_ENERGY, energy, 2.0),
)
