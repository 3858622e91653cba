"""Messages about the state of the vehicle and its flight, one function each.

https://mavlink.io/en/messages/common.html#HEARTBEAT and the other messages named below
"""

from __future__ import annotations

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Regime
from protocol.names import Mode, custom_mode
from protocol.wire.message import Message
from sitl.mavlink.telemetry.instrument_bits import instrument_bits
from sitl.mavlink.telemetry.vehicle_snapshot import HeartbeatStatus, VehicleSnapshot

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


def actuator_output(s: VehicleSnapshot) -> Message:
    """ACTUATOR_OUTPUT_STATUS: motors as 0..1 of their highest speed, elevons as -1..1 of their largest deflection."""
    values = [w / s.motor_max for w in s.motor] + [d / s.elevon_max for d in s.elevon]
    return mavlink.MAVLink_actuator_output_status_message(
        time_usec=units.microseconds(s.time), active=len(values), actuator=values + [0.0] * (32 - len(values))
    )


def mission_current(s: VehicleSnapshot) -> Message:
    """MISSION_CURRENT with the mission's state."""
    return mavlink.MAVLink_mission_current_message(
        seq=s.mission_current,
        total=s.mission_count,
        mission_state=s.mission_state,
        mission_mode=IN_MISSION_MODE if s.mode is Mode.MISSION else MISSION_SUSPENDED,
    )


def fence_status(s: VehicleSnapshot) -> Message:
    """FENCE_STATUS: a breach that is only predicted counts as one."""
    return mavlink.MAVLink_fence_status_message(
        breach_status=int(s.fence.breached),
        breach_count=s.fence.count,
        breach_type=s.fence.kind,
        breach_time=units.milliseconds(s.fence.time),
        breach_mitigation=mavlink.FENCE_MITIGATE_NONE,
    )


def system_time(s: VehicleSnapshot) -> Message:
    """SYSTEM_TIME without a wall clock: simulated flights have no date."""
    return mavlink.MAVLink_system_time_message(time_unix_usec=0, time_boot_ms=s.ms)


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


def control_status(s: VehicleSnapshot) -> Message:
    """CONTROL_STATUS of the whole system: one station in control, or none."""
    flags = mavlink.GCS_CONTROL_STATUS_FLAGS_SYSTEM_MANAGER
    flags |= mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED if s.control.takeover else 0
    return mavlink.MAVLink_control_status_message(flags=flags, gcs_main=s.control.station, gcs_secondary=[0] * 10)
