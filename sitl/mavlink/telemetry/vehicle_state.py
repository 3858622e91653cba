"""Messages of the vehicle's state and of what it can do."""

from __future__ import annotations

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.names import Mode, custom_mode
from protocol.wire.message import Message
from sitl.mavlink.ftp_files import GENERAL_URI, general_crc
from sitl.mavlink.telemetry.streams import StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import HeartbeatStatus, VehicleSnapshot
from sitl.sensors.instruments import (
    ACCELEROMETER,
    BAROMETER,
    EXTERNAL_POSE,
    GNSS,
    GYROSCOPE,
    MAGNETOMETER,
    MOTION_CAPTURE,
    PITOT,
)
from sitl.simulation.avionics import Navigation
from sitl.simulation.navigation_status import NavigationStatus

# Messages about the state of the vehicle and its flight, one function each.
#
# https://mavlink.io/en/messages/common.html#HEARTBEAT and the other messages named below

# Bits of the instruments that SYS_STATUS reports as present, enabled and healthy.
#
# https://mavlink.io/en/messages/common.html#MAV_SYS_STATUS_SENSOR


INERTIAL_BITS = {
    GYROSCOPE: mavlink.MAV_SYS_STATUS_SENSOR_3D_GYRO,
    ACCELEROMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_ACCEL,
}
INERTIAL = sum(INERTIAL_BITS.values())
POSE = mavlink.MAV_SYS_STATUS_SENSOR_VISION_POSITION
# What stock clients need before they arm, though a vehicle on the exact state has no instrument at all.
ON_TRUTH = INERTIAL | mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG | mavlink.MAV_SYS_STATUS_SENSOR_GPS
OUTDOOR_BITS = {
    MAGNETOMETER: mavlink.MAV_SYS_STATUS_SENSOR_3D_MAG,
    BAROMETER: mavlink.MAV_SYS_STATUS_SENSOR_ABSOLUTE_PRESSURE,
    GNSS: mavlink.MAV_SYS_STATUS_SENSOR_GPS,
}

STATE_STREAMS = StreamTable()


def instrument_bits(n: NavigationStatus, *, has_position: bool, has_tube: bool) -> tuple[int, int]:
    """MAV_SYS_STATUS_SENSOR bits of what is present and of what is healthy.

    An instrument is healthy while the filter uses it; before that, while it reads. The pitot tube, gyroscope and
    accelerometer are until the filter finds that they fail.

    Args:
        n: Of the vehicle.
        has_position: The position is known.
        has_tube: There is a pitot tube.
    """
    if not n.is_sensed:
        return ON_TRUTH, ON_TRUTH
    present = INERTIAL
    health = sum(bit for instrument, bit in INERTIAL_BITS.items() if not n.failed[instrument])
    present |= mavlink.MAV_SYS_STATUS_AHRS
    health |= mavlink.MAV_SYS_STATUS_AHRS if has_position else 0
    bits = OUTDOOR_BITS if n.source is Navigation.SENSORS else {MOTION_CAPTURE: POSE}
    for instrument, bit in bits.items():
        present |= bit
        health |= bit if _works(n, instrument) else 0
    if n.aid(EXTERNAL_POSE).reads:
        present |= POSE
        health |= POSE if _works(n, EXTERNAL_POSE) else 0
    if has_tube:
        present |= mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE
        works = n.aid(PITOT).reads and not n.failed[PITOT]
        health |= mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE if works else 0
    return present, health


def _works(n: NavigationStatus, instrument: int) -> bool:
    aid = n.aid(instrument)
    return aid.helps if n.is_aligned else aid.reads


# Messages that say what the vehicle is and what it can do, one function each.
#
# https://mavlink.io/en/messages/common.html#AUTOPILOT_VERSION, #PROTOCOL_VERSION and #COMPONENT_METADATA


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION, 0.0)
def autopilot_version(_s: VehicleSnapshot) -> Message:
    """AUTOPILOT_VERSION with the capabilities it really has."""
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


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_PROTOCOL_VERSION, 0.0)
def protocol_version(_s: VehicleSnapshot) -> Message:
    """PROTOCOL_VERSION: it understands MAVLink 1 and 2, and speaks 2."""
    return mavlink.MAVLink_protocol_version_message(
        version=200, min_version=100, max_version=200, spec_version_hash=[0] * 8, library_version_hash=[0] * 8
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_COMPONENT_METADATA, 0.0)
def component_metadata(s: VehicleSnapshot) -> Message:
    """COMPONENT_METADATA: where the file is that describes the vehicle to ground stations."""
    return mavlink.MAVLink_component_metadata_message(
        time_boot_ms=s.ms, file_crc=general_crc(), uri=GENERAL_URI.encode("ascii")
    )


def release_word() -> int:
    """The package's version as AUTOPILOT_VERSION carries it."""
    from importlib.metadata import version  # noqa: PLC0415

    major, minor, patch = (int(part) for part in version("darko").split("."))
    return major << 24 | minor << 16 | patch << 8 | int(mavlink.FIRMWARE_VERSION_TYPE_OFFICIAL)


NO_BATTERY_CELL = 65535
MAVLINK_VERSION = 3  # of HEARTBEAT
IN_MISSION_MODE, MISSION_SUSPENDED = 1, 2  # of MISSION_CURRENT; 0 would be unknown
ALWAYS_PRESENT = (
    mavlink.MAV_SYS_STATUS_SENSOR_BATTERY | mavlink.MAV_SYS_STATUS_GEOFENCE | mavlink.MAV_SYS_STATUS_PREARM_CHECK
)
VTOL_STATES: dict[Regime, int] = {
    Regime.GROUND: mavlink.MAV_VTOL_STATE_MC,
    Regime.UPRIGHT: mavlink.MAV_VTOL_STATE_MC,
    Regime.FRONT_TRANSITION: mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW,
    Regime.FORWARD: mavlink.MAV_VTOL_STATE_FW,
    Regime.BACK_TRANSITION: mavlink.MAV_VTOL_STATE_TRANSITION_TO_MC,
}


def heartbeat(s: HeartbeatStatus, autopilot: int = mavlink.MAV_AUTOPILOT_PX4) -> Message:
    """HEARTBEAT of a VTOL tail-sitter; its modes are PX4's, also if it reports another MAV_AUTOPILOT."""
    base = mavlink.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED | mavlink.MAV_MODE_FLAG_STABILIZE_ENABLED
    base |= mavlink.MAV_MODE_FLAG_AUTO_ENABLED if s.mode.is_auto else mavlink.MAV_MODE_FLAG_GUIDED_ENABLED
    base |= mavlink.MAV_MODE_FLAG_SAFETY_ARMED if s.armed else 0
    return mavlink.MAVLink_heartbeat_message(
        type=mavlink.MAV_TYPE_VTOL_DUOROTOR,
        autopilot=autopilot,
        base_mode=base,
        custom_mode=custom_mode(s.mode),
        system_status=_system_status(s),
        mavlink_version=MAVLINK_VERSION,
    )


def _system_status(s: HeartbeatStatus) -> int:
    """MAV_STATE by PX4's rule: armed or not decides, on the ground as in the air."""
    if s.crashed:
        return int(mavlink.MAV_STATE_EMERGENCY)
    if s.terminated:
        return int(mavlink.MAV_STATE_FLIGHT_TERMINATION)
    if not s.armed:
        return int(mavlink.MAV_STATE_STANDBY)
    return int(mavlink.MAV_STATE_CRITICAL if s.critical else mavlink.MAV_STATE_ACTIVE)


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_SYS_STATUS, 1.0)
def sys_status(s: VehicleSnapshot) -> Message:
    """SYS_STATUS: which instruments there are and which help; the pre-arm bit is the arming checks' verdict."""
    present, health = instrument_bits(s.navigation, has_position=s.has_position, has_tube=s.has_tube)
    present |= ALWAYS_PRESENT
    enabled = present if s.fenced else present & ~mavlink.MAV_SYS_STATUS_GEOFENCE
    health |= mavlink.MAV_SYS_STATUS_SENSOR_BATTERY | (0 if s.fence.breached else mavlink.MAV_SYS_STATUS_GEOFENCE)
    health |= mavlink.MAV_SYS_STATUS_PREARM_CHECK if s.ready or s.armed else 0
    return mavlink.MAVLink_sys_status_message(
        onboard_control_sensors_present=present,
        onboard_control_sensors_enabled=enabled,
        onboard_control_sensors_health=health,
        load=0,
        voltage_battery=units.millivolts(s.battery_reading.voltage),
        current_battery=units.centiamperes(s.battery_reading.current),
        battery_remaining=units.percent(s.battery.remaining),
        drop_rate_comm=0,
        errors_comm=0,
        errors_count1=0,
        errors_count2=0,
        errors_count3=0,
        errors_count4=0,
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_EXTENDED_SYS_STATE, 2.0)
def extended_state(s: VehicleSnapshot) -> Message:
    """EXTENDED_SYS_STATE: hover, forward flight or a transition, and whether it has left the ground."""
    if s.landed:
        landed = mavlink.MAV_LANDED_STATE_ON_GROUND
    elif s.landing:
        landed = mavlink.MAV_LANDED_STATE_LANDING
    elif s.taking_off:
        landed = mavlink.MAV_LANDED_STATE_TAKEOFF
    else:
        landed = mavlink.MAV_LANDED_STATE_IN_AIR
    return mavlink.MAVLink_extended_sys_state_message(VTOL_STATES[s.way_of_flying], landed)


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_BATTERY_STATUS, 1.0)
def battery_status(s: VehicleSnapshot) -> Message:
    """BATTERY_STATUS of the energy model."""
    return mavlink.MAVLink_battery_status_message(
        id=0,
        battery_function=mavlink.MAV_BATTERY_FUNCTION_ALL,
        type=mavlink.MAV_BATTERY_TYPE_LIPO,
        temperature=0x7FFF,
        voltages=[units.millivolts(s.battery_reading.voltage)] + [NO_BATTERY_CELL] * 9,
        current_battery=units.centiamperes(s.battery_reading.current),
        current_consumed=-1,
        energy_consumed=round(s.energy / 100.0),  # hJ
        battery_remaining=units.percent(s.battery.remaining),
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_WIND_COV, 1.0)
def wind(s: VehicleSnapshot) -> Message:
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


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_ACTUATOR_OUTPUT_STATUS, 5.0)
def actuator_output(s: VehicleSnapshot) -> Message:
    """ACTUATOR_OUTPUT_STATUS: motors as 0..1 of their highest speed, elevons as -1..1 of their largest deflection."""
    values = [w / s.motor_max for w in s.motor] + [d / s.elevon_max for d in s.elevon]
    return mavlink.MAVLink_actuator_output_status_message(
        time_usec=units.microseconds(s.time), active=len(values), actuator=values + [0.0] * (32 - len(values))
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT, 1.0)
def mission_current(s: VehicleSnapshot) -> Message:
    """MISSION_CURRENT with the mission's state."""
    return mavlink.MAVLink_mission_current_message(
        seq=s.mission_current,
        total=s.mission_count,
        mission_state=s.mission_state,
        mission_mode=IN_MISSION_MODE if s.mode is Mode.MISSION else MISSION_SUSPENDED,
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_FENCE_STATUS, 1.0)
def fence_status(s: VehicleSnapshot) -> Message:
    """FENCE_STATUS: a breach that is only predicted counts as one."""
    return mavlink.MAVLink_fence_status_message(
        breach_status=int(s.fence.breached),
        breach_count=s.fence.count,
        breach_type=s.fence.kind,
        breach_time=units.milliseconds(s.fence.time),
        breach_mitigation=mavlink.FENCE_MITIGATE_NONE,
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_SYSTEM_TIME, 1.0)
def system_time(s: VehicleSnapshot) -> Message:
    """SYSTEM_TIME without a wall clock: simulated flights have no date."""
    return mavlink.MAVLink_system_time_message(time_unix_usec=0, time_boot_ms=s.ms)


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_FLIGHT_INFORMATION, 0.0)
def flight_information(s: VehicleSnapshot) -> Message:
    """FLIGHT_INFORMATION: when this flight, or the last one, began and ended; times are since boot."""
    flight = s.flight
    return mavlink.MAVLink_flight_information_message(
        time_boot_ms=s.ms,
        arming_time_utc=units.microseconds(flight.armed_at),
        takeoff_time_utc=units.microseconds(flight.took_off_at),
        flight_uuid=flight.number,
        landing_time=units.milliseconds(flight.landed_at),
    )


@STATE_STREAMS.sends(mavlink.MAVLINK_MSG_ID_CONTROL_STATUS, 0.5)
def control_status(s: VehicleSnapshot) -> Message:
    """CONTROL_STATUS of the whole system: one station in control, or none."""
    flags = mavlink.GCS_CONTROL_STATUS_FLAGS_SYSTEM_MANAGER
    flags |= mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED if s.control.takeover else 0
    return mavlink.MAVLink_control_status_message(flags=flags, gcs_main=s.control.station, gcs_secondary=[0] * 10)
