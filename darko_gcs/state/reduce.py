"""Folds one message of the vehicle into the snapshot: standard MAVLink here, DARKO_* in ``reduce_telemetry``."""

from __future__ import annotations

import math
from typing import TypeVar

from darko_gcs.state.flown_legs import leg_reached, mission_begun, mission_done_words
from darko_gcs.state.message_log import HandlerTable, add_line, add_status_text, is_fix, is_on_map
from darko_gcs.state.mission_legs import whole_metres
from darko_gcs.state.parameters import MAX_PARAMETERS
from darko_gcs.state.parts import BatteryReading, VehicleStatus
from darko_gcs.state.reduce_events import REQUEST_HANDLERS
from darko_gcs.state.reduce_telemetry import (
    DARKO_HANDLERS,
    ESTIMATE_HANDLERS,
    FLIGHT_PLAN_HANDLERS,
    OTHER_HANDLERS,
    mission_item,
)
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import RESTARTED
from darko_gcs.state.values import Navigation, PlanIds
from protocol import units
from protocol.dialect import mavlink
from protocol.engines.table_values import decode_value, value_encoding
from protocol.frames import (
    SHOW_AS_TOLD,
    SHOW_PITCHED_DOWN,
    Geodetic,
    LocalFrame,
    flying_attitude,
    multiply,
    quaternion_from_euler,
)
from protocol.frames import heading as heading_of
from protocol.names import mode_name
from protocol.wire.message import Message, Source, source_of

Track = tuple[tuple[float, float], ...]  # (north, east) [m]
MAX_TRACK_POINTS = 1500
MIN_TRACK_STEP = 0.15  # between points of the track [m]
RESTART_STEP = 1.0  # a time since boot that goes back by more than this indicates a restart [s]
RESTART_MESSAGES = 3  # messages in a row that must indicate it: a single one may only be late
LATE_MESSAGES = 60  # that may come late in a row, behind newer ones
MAX_DELAY = 30.0  # of late messages [s]
# Parts that stay true at a restart, beside values of ``status`` and ``link``; all else is of the flight before.
PARTS_KEPT_AT_RESTART = ("identity", "session", "parameters", "plans", "arena", "log")
MAX_NUMBER = 1e9  # of the fields below, in their units
# Fields that must be finite and below MAX_NUMBER, or the message is ignored: an unsigned message may come from anyone.
# Screens must cope with any value of the other fields.
CHECKED_FIELDS = {
    "DARKO_ARENA": ("x", "y", "heading", "length", "width", "height", "margin"),
    "ATTITUDE": ("roll", "pitch", "yaw"),
    "ATTITUDE_QUATERNION": ("q1", "q2", "q3", "q4", "repr_offset_q"),
    "DARKO_ACTUATORS": (
        "motor_speed", "motor_command", "thrust", "elevon", "elevon_command", "motor_min", "motor_max", "elevon_max",
    ),
    "DARKO_AIR": ("wind_estimate", "wind_true", "airspeed_estimate", "airspeed_true"),
    "DARKO_DECISION": ("distance", "climb", "tail_wind", "cross_wind"),
    "DARKO_ENERGY": ("power", "energy", "energy_by_law"),
    "DARKO_HYBRID_STATE": ("governor",),  # a threshold may be infinite: the law is never left
    "DARKO_PLAN_STATUS": ("block_time", "stage_time", "flight_time"),
    "DARKO_PLAN_WAYPOINT": ("alt", "x", "y", "z"),
    "DARKO_TRUTH": ("position", "velocity", "q", "rates", "wind"),
    "LOCAL_POSITION_NED": ("x", "y", "z", "vx", "vy", "vz"),
    "NAV_CONTROLLER_OUTPUT": ("xtrack_error", "alt_error"),
    "POSITION_TARGET_GLOBAL_INT": ("alt",),
    "POSITION_TARGET_LOCAL_NED": ("x", "y", "z"),
    "VFR_HUD": ("airspeed", "groundspeed"),
    "WIND": ("direction", "speed", "speed_z"),
    "WIND_COV": ("wind_x", "wind_y", "wind_z"),
}  # fmt: skip
MOVED_HOME = 1.0  # from the origin of the vehicle's frame, from which on a home is worth a word as it is first told [m]
MAX_OFFSET_ERROR = 0.01  # of a repr_offset_q, which some vehicles send with four digits
ALARMED_STATES = frozenset(
    {mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY, mavlink.MAV_STATE_FLIGHT_TERMINATION}
)
SERVOS = 16  # of SERVO_OUTPUT_RAW
UNKNOWN_HEADING = 0xFFFF  # of GLOBAL_POSITION_INT [1e-2 deg]
UNKNOWN_VOLTAGE = 0xFFFF  # of SYS_STATUS and of a cell of BATTERY_STATUS [mV]

T = TypeVar("T")
HANDLERS = HandlerTable()
HANDLERS.add(DARKO_HANDLERS)
HANDLERS.add(ESTIMATE_HANDLERS)
HANDLERS.add(FLIGHT_PLAN_HANDLERS)
HANDLERS.add(OTHER_HANDLERS)
HANDLERS.add(REQUEST_HANDLERS)


def reduce(s: Snapshot, message: Message, now: float) -> Snapshot:
    """The snapshot after one message.

    Args:
        s: The snapshot before.
        message: A decoded message of any sender. Only the first vehicle that is heard counts, and the STATUSTEXTs of
            its other components.
        now: Time of arrival, on the caller's clock [s].
    """
    name = message.get_type()
    if name == "HEARTBEAT":
        return _heartbeat(s, message, now)
    if s.identity.source is not None and not _is_relevant(name, source_of(message), s.identity.source):
        return s
    handler = HANDLERS.get(name)
    if handler is None or not _is_sane(name, message):
        return s
    boot = getattr(message, "time_boot_ms", None)
    if boot is None:
        return handler(s._replace(link=s.link._replace(arrivals={**s.link.arrivals, name: now})), message, now)
    s = _at_boot_time(s, boot / 1e3, name, now)
    return s if s.link.late_messages else handler(s, message, now)  # a late one is of before a restart, or delayed


def _is_sane(name: str, m: Message) -> bool:
    if name == "GLOBAL_POSITION_INT" and not is_on_map(m.lat, m.lon):
        return False
    values = (getattr(m, field) for field in CHECKED_FIELDS.get(name, ()))
    numbers = (number for value in values for number in (value if isinstance(value, list) else (value,)))
    return all(abs(number) < MAX_NUMBER for number in numbers)  # false for NaN


def _is_relevant(name: str, source: Source, vehicle: Source) -> bool:
    if name in {"MISSION_ITEM_INT", "MISSION_ITEM"} or name in REQUEST_HANDLERS.names:
        return True  # in a log, the mission comes from the station that uploaded it, and so do all requests
    return source == vehicle or (name == "STATUSTEXT" and source[0] == vehicle[0])


def _heartbeat(s: Snapshot, m: Message, now: float) -> Snapshot:
    source = source_of(m)
    if m.autopilot == mavlink.MAV_AUTOPILOT_INVALID or source[1] != mavlink.MAV_COMP_ID_AUTOPILOT1:
        return s
    if s.identity.source is not None and s.identity.source != source:
        return s
    return s._replace(
        identity=s.identity._replace(source=source, autopilot=m.autopilot, kind=m.type),
        status=s.status._replace(
            armed=bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED),
            mode=mode_name(m.autopilot, m.type, m.custom_mode) or f"MODE {m.custom_mode}",
            critical=m.system_status in ALARMED_STATES,
        ),
        link=s.link._replace(heartbeat_at=now, lost=False),
    )


def _at_boot_time(s: Snapshot, boot: float, name: str, now: float) -> Snapshot:
    if s.link.boot is None or boot >= s.link.boot - RESTART_STEP:
        return s._replace(link=s.link._replace(boot=boot, late_messages=0, arrivals={**s.link.arrivals, name: now}))
    if s.link.late_messages + 1 < restart_messages(boot, s.link.boot):
        return s._replace(link=s.link._replace(late_messages=s.link.late_messages + 1))
    s = after_restart(s, now)
    return s._replace(link=s.link._replace(boot=boot, arrivals={name: now}))


def restart_messages(boot: float, newest: float) -> int:
    """Number of messages in a row that must tell an earlier time since boot before the vehicle counts as restarted.

    A restart is a step back to near 0. A step of some seconds may be a group of messages that came late.

    Args:
        boot: What they tell [s].
        newest: What was told before [s].
    """
    return RESTART_MESSAGES if boot < max(newest - MAX_DELAY, newest / 2.0) else LATE_MESSAGES


def after_restart(s: Snapshot, now: float) -> Snapshot:
    """The snapshot of a vehicle that has restarted: without the flight before."""
    status = VehicleStatus(armed=s.status.armed, mode=s.status.mode, critical=s.status.critical)
    link = s.link._replace(boot=None, late_messages=0, restarts=s.link.restarts + 1, arrivals={})
    kept = {name: getattr(s, name) for name in PARTS_KEPT_AT_RESTART}
    s = EMPTY_SNAPSHOT._replace(status=status, link=link, **kept)
    return add_line(s, now, mavlink.MAV_SEVERITY_NOTICE, f"{RESTARTED[0].upper()}{RESTARTED[1:]}")


# Attitude, position, air


@HANDLERS.handles("ATTITUDE_QUATERNION")
def _attitude_quaternion(s: Snapshot, m: Message, _now: float) -> Snapshot:
    q = (m.q1, m.q2, m.q3, m.q4)
    offset = tuple(m.repr_offset_q) if any(m.repr_offset_q) else SHOW_AS_TOLD
    if s.identity.tells_hover_frame and not _tells_flying_frame(offset):
        q, offset = flying_attitude(q), multiply(SHOW_PITCHED_DOWN, offset)
    return s._replace(
        attitude=s.attitude._replace(q=q, time=m.time_boot_ms / 1e3, repr_offset=offset, heading=heading_of(q))
    )


def _tells_flying_frame(offset: tuple[float, ...]) -> bool:
    """True of DarkO's logs up to 0.1: they have the nose along x also in the hover, and have it shown pitched down."""
    return math.dist(offset, SHOW_PITCHED_DOWN) < MAX_OFFSET_ERROR


@HANDLERS.handles("ATTITUDE")
def _attitude(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if s.attitude.repr_offset is not None:  # the vehicle sends quaternions too, which have no singularity
        return s
    q = quaternion_from_euler(m.roll, m.pitch, m.yaw)
    if s.identity.tells_hover_frame:
        q = flying_attitude(q)
        return s._replace(attitude=s.attitude._replace(q=q, heading=heading_of(q)))
    return s._replace(attitude=s.attitude._replace(q=q, heading=m.yaw % (2.0 * math.pi)))


@HANDLERS.handles("LOCAL_POSITION_NED")
def _local_position(s: Snapshot, m: Message, _now: float) -> Snapshot:
    p, v = (m.x, m.y, m.z), (m.vx, m.vy, m.vz)
    track = s.position.track if s.position.start is None else ()  # until now it told its place on the globe alone
    track = _extended(s, track, p[:2])
    near = whole_metres(p, s.position.near)
    return s._replace(
        position=s.position._replace(p=p, near=near, time=m.time_boot_ms / 1e3, v=v, track=track, start=None)
    )


def _extended(s: Snapshot, track: Track, at: tuple[float, float]) -> Track:
    if s.estimates.is_place_lost:  # nobody has flown there
        return track
    if track and math.dist(track[-1], at) < MIN_TRACK_STEP:
        return track
    return (*thinned(track), at)


def thinned(track: tuple[T, ...]) -> tuple[T, ...]:
    """A full track without every other point of its older half, so that the whole flight stays in view."""
    if len(track) < MAX_TRACK_POINTS:
        return track
    return track[: MAX_TRACK_POINTS // 2 : 2] + track[MAX_TRACK_POINTS // 2 :]


@HANDLERS.handles("GLOBAL_POSITION_INT")
def _global_position(s: Snapshot, m: Message, _now: float) -> Snapshot:
    s = s._replace(
        position=s.position._replace(geodetic=_place(m), relative_altitude=units.from_millimetres(m.relative_alt)),
        attitude=s.attitude._replace(heading=_told_heading(m) if s.attitude.q is None else s.attitude.heading),
    )
    if "LOCAL_POSITION_NED" in s.link.arrivals or not is_fix(m.lat, m.lon):
        return s
    start = s.position.start or _place(m)
    north, east, _ = LocalFrame(start).to_ned(_place(m))
    p = (north, east, -units.from_millimetres(m.relative_alt))
    return s._replace(
        position=s.position._replace(
            start=start,
            p=p,
            near=whole_metres(p, s.position.near),
            time=m.time_boot_ms / 1e3,
            v=(m.vx / 100.0, m.vy / 100.0, m.vz / 100.0),
            track=_extended(s, s.position.track, (north, east)),
        )
    )


def _told_heading(m: Message) -> float | None:
    return None if m.hdg == UNKNOWN_HEADING else math.radians(m.hdg / 100.0)


def _place(m: Message) -> Geodetic:
    return Geodetic(units.from_e7(m.lat), units.from_e7(m.lon), units.from_millimetres(m.alt))


@HANDLERS.handles("POSITION_TARGET_LOCAL_NED")
def _position_target(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return s._replace(guidance=s.guidance._replace(target=(m.x, m.y, m.z)))


@HANDLERS.handles("HOME_POSITION")
def _home(s: Snapshot, m: Message, now: float) -> Snapshot:
    if not is_on_map(m.latitude, m.longitude):
        return s
    home = Geodetic(units.from_e7(m.latitude), units.from_e7(m.longitude), units.from_millimetres(m.altitude))
    p = (m.x, m.y, m.z)
    if s.position.home is None and MOVED_HOME <= math.hypot(*p) < MAX_NUMBER:
        place = (
            f"{round(p[0], 1) + 0.0:.1f} m north, {round(p[1], 1) + 0.0:.1f} m east, {round(-p[2], 1) + 0.0:.1f} m up"
        )
        text = f"Home is {place} of the vehicle's origin: it was moved before, and heights are from there"
        s = add_line(s, now, mavlink.MAV_SEVERITY_NOTICE, text)
    return s._replace(
        position=s.position._replace(home=home, told_home_p=p if all(map(math.isfinite, p)) else s.position.told_home_p)
    )


@HANDLERS.handles("GPS_GLOBAL_ORIGIN")
def _origin(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if not is_on_map(m.latitude, m.longitude):
        return s
    place = Geodetic(units.from_e7(m.latitude), units.from_e7(m.longitude), units.from_millimetres(m.altitude))
    return s._replace(position=s.position._replace(origin=place))


@HANDLERS.handles("VFR_HUD")
def _vfr_hud(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return s._replace(
        estimates=s.estimates._replace(airspeed=m.airspeed),
        position=s.position._replace(ground_speed=m.groundspeed),
        actuation=s.actuation._replace(throttle=m.throttle / 100.0),
    )


@HANDLERS.handles("WIND_COV")
def _wind(s: Snapshot, m: Message, _now: float) -> Snapshot:
    deviation = m.horiz_accuracy if 0.0 < m.horiz_accuracy < MAX_NUMBER else None
    wind = (m.wind_x, m.wind_y, m.wind_z)
    return s._replace(estimates=s.estimates._replace(wind=wind, wind_deviation=deviation))


@HANDLERS.handles("NAV_CONTROLLER_OUTPUT")
def _navigation(s: Snapshot, m: Message, _now: float) -> Snapshot:
    bearing = math.radians(m.target_bearing)
    return s._replace(
        guidance=s.guidance._replace(navigation=Navigation(m.xtrack_error, m.alt_error, float(m.wp_dist), bearing))
    )


# State of the vehicle


@HANDLERS.handles("EXTENDED_SYS_STATE")
def _extended_state(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return s._replace(status=s.status._replace(landed_state=m.landed_state, vtol_state=m.vtol_state))


@HANDLERS.handles("SYS_STATUS")
def _sys_status(s: Snapshot, m: Message, _now: float) -> Snapshot:
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    ready = bool(m.onboard_control_sensors_health & bit) if m.onboard_control_sensors_present & bit else None
    unhealthy = (
        m.onboard_control_sensors_present & m.onboard_control_sensors_enabled & ~m.onboard_control_sensors_health
    )
    tube, filtered = mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE, mavlink.MAV_SYS_STATUS_AHRS
    has_tube = bool(m.onboard_control_sensors_present & tube)  # a vehicle on the exact state has neither
    measured = has_tube and not unhealthy & tube if (tube | filtered) & m.onboard_control_sensors_present else None
    voltage = m.voltage_battery / 1e3 if 0 < m.voltage_battery < UNKNOWN_VOLTAGE else None
    return s._replace(
        status=s.status._replace(prearm_ok=ready, unhealthy=unhealthy & ~bit, has_measured_air=measured),
        battery=s.battery._replace(system_status=_battery_reading(m, voltage)),
    )


@HANDLERS.handles("BATTERY_STATUS")
def _battery(s: Snapshot, m: Message, _now: float) -> Snapshot:
    cells = [cell / 1e3 for cell in m.voltages if cell != UNKNOWN_VOLTAGE]
    reading = _battery_reading(m, sum(cells) if cells else None)
    return s._replace(battery=s.battery._replace(battery_status=reading))


def _battery_reading(m: Message, voltage: float | None) -> BatteryReading:
    """The fields that both messages about the battery share, and a voltage [V], which each tells in its own way."""
    return BatteryReading(
        voltage=voltage,
        current=m.current_battery / 100.0 if m.current_battery >= 0 else None,
        charge_left=m.battery_remaining / 100.0 if m.battery_remaining >= 0 else None,
    )


@HANDLERS.handles("SERVO_OUTPUT_RAW")
def _servo_outputs(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return s._replace(
        actuation=s.actuation._replace(
            servos=tuple(getattr(m, f"servo{number}_raw") for number in range(1, SERVOS + 1))
        )
    )


@HANDLERS.handles("CONTROL_STATUS")
def _control_status(s: Snapshot, m: Message, _now: float) -> Snapshot:
    asked_by = s.operator.control_asked_by if m.gcs_main == s.operator.in_control else 0
    allowed = bool(m.flags & mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED)
    return s._replace(
        operator=s.operator._replace(in_control=m.gcs_main, takeover_allowed=allowed, control_asked_by=asked_by)
    )


@HANDLERS.handles("AUTOPILOT_VERSION")
def _version(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return s._replace(identity=s.identity._replace(capabilities=m.capabilities))


@HANDLERS.handles("PARAM_VALUE")
def _parameter(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if m.param_id not in s.parameters.values and len(s.parameters.values) >= MAX_PARAMETERS:
        return s
    value = decode_value(m.param_value, m.param_type, value_encoding(s.identity.autopilot, s.identity.capabilities))
    types = s.parameters.types
    if types.get(m.param_id) != m.param_type:
        types = {**types, m.param_id: m.param_type}
    parameters = {**s.parameters.values, m.param_id: value}
    return s._replace(parameters=s.parameters._replace(values=parameters, total=m.param_count, types=types))


HANDLERS.handles("STATUSTEXT")(add_status_text)


# Mission


@HANDLERS.handles("MISSION_CURRENT")
def _mission_current(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.mission_state == mavlink.MISSION_STATE_COMPLETE and s.mission.state == mavlink.MISSION_STATE_ACTIVE:
        s = add_line(s, now, mavlink.MAV_SEVERITY_INFO, mission_done_words(s))
    begins = m.mission_state == mavlink.MISSION_STATE_ACTIVE and s.mission.state != m.mission_state
    if begins and s.mission.state != mavlink.MISSION_STATE_PAUSED:
        s = mission_begun(s)
    return s._replace(
        mission=s.mission._replace(
            current=m.seq,
            total=None if m.total == units.NO_ITEM else m.total,
            state=m.mission_state,
            reached=frozenset(seq for seq in s.mission.reached if seq < m.seq) if begins else s.mission.reached,
            plan_ids=PlanIds(now, m.mission_id, m.fence_id, m.rally_points_id),
        )
    )


@HANDLERS.handles("MISSION_ITEM_REACHED")
def _item_reached(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return leg_reached(s._replace(mission=s.mission._replace(reached=s.mission.reached | {m.seq})), m.seq)


HANDLERS.handles("MISSION_ITEM_INT")(mission_item)
