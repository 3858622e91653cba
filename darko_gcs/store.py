"""Folding messages and events into the snapshot: pure functions, one per message."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from darko_gcs.mode_names import mode_name
from darko_gcs.plans import ALL, FENCE, MISSION, PARTS, RALLY, with_part
from darko_gcs.snapshot import EMPTY, Line, Navigation, OpenText, PlanIds, Snapshot
from darko_gcs.store_darko import DARKO_HANDLERS, Handler
from darko_gcs.words import printable
from protocol import units
from protocol.codec import Message, Source, source_of
from protocol.dialect import mavlink
from protocol.events import (
    CommandDone,
    CommandProgress,
    ControlRequested,
    Event,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionProgress,
    MissionUploaded,
    ParameterConfirmed,
    ParameterFailed,
    VehicleFound,
    VehicleLost,
    VehicleReturned,
)
from protocol.frames import FLYING_DISPLAY, Geodetic, quaternion_from_euler
from protocol.frames import heading as heading_of
from protocol.plans.mission import MissionItem

__all__ = ["note", "reduce", "reduce_event"]

KEPT_LINES = 300
KEPT_TRACK = 1500
TRACK_STEP = 0.15  # [m]
RESTART = 1.0  # boot time going back by more than this is another boot [s],
CERTAIN = 3  # if so many messages in a row say so: one may have been held up on its way
# What is still true of a vehicle that started anew; all the rest belongs to the flight before.
OUTLIVES_RESTART = (
    "source", "autopilot", "kind", "armed", "mode", "critical", "heartbeat_at", "lost", "restarts", "parameters",
    "parameter_count", "meanings",
    "mission", "fence", "rally", "transfer", "messages", "open_text", "received", "rate", "loss", "unrecorded",
    "signing", "refused",
)  # fmt: skip
PLAN = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally plan", ALL: "Mission, fence and rally plan"}
INFO, NOTICE, WARNING = mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_NOTICE, mavlink.MAV_SEVERITY_WARNING


LARGEST = 1e9  # of the numbers of NUMBERS, in their units
# Fields that must be numbers and within LARGEST, or the message is passed over: unsigned, anybody may have sent it.
# Where another field is not a number, that is for the screens to say.
NUMBERS = {
    "ATTITUDE": ("roll", "pitch", "yaw"),
    "ATTITUDE_QUATERNION": ("q1", "q2", "q3", "q4", "repr_offset_q"),
    "DARKO_ACTUATORS": (
        "motor_speed", "motor_command", "thrust", "elevon", "elevon_command", "motor_min", "motor_max", "elevon_max",
    ),
    "DARKO_AIR": ("wind_estimate", "wind_true", "airspeed_estimate", "airspeed_true"),
    "DARKO_DECISION": ("distance", "climb", "tail_wind", "cross_wind"),
    "DARKO_ENERGY": ("power", "energy", "energy_by_law"),
    "DARKO_HYBRID_STATE": ("governor",),  # a threshold may be infinite: the law is never left
    "LOCAL_POSITION_NED": ("x", "y", "z", "vx", "vy", "vz"),
    "NAV_CONTROLLER_OUTPUT": ("xtrack_error", "alt_error"),
    "POSITION_TARGET_LOCAL_NED": ("x", "y", "z"),
    "VFR_HUD": ("airspeed", "groundspeed"),
    "WIND_COV": ("wind_x", "wind_y", "wind_z"),
}  # fmt: skip
MOST_LATITUDE, MOST_LONGITUDE = 89_0000000, 180_0000000  # [1e-7 deg]: no map has a place for more


def reduce(s: Snapshot, message: Message, now: float) -> Snapshot:
    """The snapshot after one message.

    Args:
        s: The snapshot before.
        message: A decoded message of anybody; only those of the first vehicle that is heard count, and what its other
            components say in words.
        now: When it came, on the caller's clock [s].
    """
    kind = message.get_type()
    if kind == "HEARTBEAT":
        return _heartbeat(s, message, now)
    if s.source is not None and not _is_heard(kind, source_of(message), s.source):
        return s
    handler = HANDLERS.get(kind)
    if handler is None or not _is_sound(kind, message):
        return s
    boot = getattr(message, "time_boot_ms", None)
    if boot is not None:
        s = _at_boot_time(s, boot / 1e3, now)
        if s.earlier:  # held up on its way, or the first of a new start: not shown
            return s
    return handler(s, message, now)


def note(s: Snapshot, now: float, severity: int, text: str) -> Snapshot:
    """The snapshot with one more line in its log; what could command a terminal is taken out of it."""
    return replace(s, messages=(*s.messages[-KEPT_LINES + 1 :], Line(now, severity, printable(text))))


def _is_sound(kind: str, m: Message) -> bool:
    values = (getattr(m, name) for name in NUMBERS.get(kind, ()))
    numbers = (number for value in values for number in (value if isinstance(value, list) else (value,)))
    return all(abs(number) < LARGEST for number in numbers)


def _is_on_a_map(latitude: int, longitude: int) -> bool:
    return abs(latitude) <= MOST_LATITUDE and abs(longitude) <= MOST_LONGITUDE


def _is_heard(kind: str, source: Source, vehicle: Source) -> bool:
    if kind == "MISSION_ITEM_INT":  # in a log, the mission comes from whoever uploaded it
        return True
    return source == vehicle or (kind == "STATUSTEXT" and source[0] == vehicle[0])


def _heartbeat(s: Snapshot, m: Message, now: float) -> Snapshot:
    source = source_of(m)
    if m.autopilot == mavlink.MAV_AUTOPILOT_INVALID or source[1] != mavlink.MAV_COMP_ID_AUTOPILOT1:
        return s
    if s.source is not None and s.source != source:
        return s
    return replace(
        s,
        source=source,
        autopilot=m.autopilot,
        kind=m.type,
        armed=bool(m.base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED),
        mode=_mode_name(m),
        critical=m.system_status in {mavlink.MAV_STATE_CRITICAL, mavlink.MAV_STATE_EMERGENCY},
        heartbeat_at=now,
        lost=False,
    )


def _mode_name(m: Message) -> str:
    return mode_name(m.autopilot, m.type, m.custom_mode) or f"MODE {m.custom_mode}"


def _at_boot_time(s: Snapshot, boot: float, now: float) -> Snapshot:
    if s.boot is None or boot >= s.boot - RESTART:
        return replace(s, boot=boot, earlier=0)
    if s.earlier + 1 < CERTAIN:
        return replace(s, earlier=s.earlier + 1)
    s = replace(EMPTY, **{name: getattr(s, name) for name in OUTLIVES_RESTART})
    return note(replace(s, boot=boot, restarts=s.restarts + 1), now, NOTICE, "The vehicle restarted")


def _attitude_quaternion(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001 - one signature for all
    q = (m.q1, m.q2, m.q3, m.q4)
    offset = tuple(m.repr_offset_q)
    return replace(s, q=q, repr_offset=offset if any(offset) else FLYING_DISPLAY, heading=heading_of(q))


def _attitude(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if s.repr_offset is not None:  # the quaternion says it without a singularity
        return s
    return replace(s, q=quaternion_from_euler(m.roll, m.pitch, m.yaw), heading=m.yaw % (2.0 * math.pi))


def _local_position(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, p=(m.x, m.y, m.z), v=(m.vx, m.vy, m.vz), track=_longer(s.track, (m.x, m.y)))


def _longer(track: tuple[tuple[float, float], ...], at: tuple[float, float]) -> tuple[tuple[float, float], ...]:
    if track and math.dist(track[-1], at) < TRACK_STEP:
        return track
    if len(track) >= KEPT_TRACK:  # every other old point goes, so that the whole flight stays in view
        track = track[: KEPT_TRACK // 2 : 2] + track[KEPT_TRACK // 2 :]
    return (*track, at)


def _global_position(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if not _is_on_a_map(m.lat, m.lon):
        return s
    here = Geodetic(units.from_e7(m.lat), units.from_e7(m.lon), units.from_millimetres(m.alt))
    return replace(s, geodetic=here, relative_altitude=units.from_millimetres(m.relative_alt))


def _position_target(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, target=(m.x, m.y, m.z))


def _home(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if not _is_on_a_map(m.latitude, m.longitude):
        return s
    home = Geodetic(units.from_e7(m.latitude), units.from_e7(m.longitude), units.from_millimetres(m.altitude))
    p = (m.x, m.y, m.z)
    return replace(s, home=home, home_p=p if all(map(math.isfinite, p)) else s.home_p)


def _vfr_hud(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, airspeed=m.airspeed, ground_speed=m.groundspeed, throttle=m.throttle / 100.0)


def _wind(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, wind=(m.wind_x, m.wind_y, m.wind_z))


def _navigation(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    bearing = math.radians(m.target_bearing)
    return replace(s, navigation=Navigation(m.xtrack_error, m.alt_error, float(m.wp_dist), bearing))


def _extended_state(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, landed_state=m.landed_state, vtol_state=m.vtol_state)


def _sys_status(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    bit = mavlink.MAV_SYS_STATUS_PREARM_CHECK
    ready = bool(m.onboard_control_sensors_health & bit) if m.onboard_control_sensors_present & bit else None
    s = replace(s, prearm_ok=ready)
    if m.voltage_battery != 0xFFFF and s.voltage is None:
        s = replace(s, voltage=m.voltage_battery / 1e3)
    if m.battery_remaining >= 0 and s.battery is None:
        s = replace(s, battery=m.battery_remaining / 100.0)
    return s


def _battery(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    cells = [cell / 1e3 for cell in m.voltages if cell != 0xFFFF]
    return replace(
        s,
        voltage=sum(cells) if cells else s.voltage,
        current=m.current_battery / 100.0 if m.current_battery >= 0 else None,
        battery=m.battery_remaining / 100.0 if m.battery_remaining >= 0 else s.battery,
    )


def _control_status(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    asks = s.asks_for_control if m.gcs_main == s.in_control else 0
    takeover = bool(m.flags & mavlink.GCS_CONTROL_STATUS_FLAGS_TAKEOVER_ALLOWED)
    return replace(s, in_control=m.gcs_main, takeover=takeover, asks_for_control=asks)


def _mission_current(s: Snapshot, m: Message, now: float) -> Snapshot:
    begins = m.mission_state == mavlink.MISSION_STATE_ACTIVE and s.mission_state != m.mission_state
    reached = frozenset(seq for seq in s.reached if seq < m.seq) if begins else s.reached
    total = None if m.total == 0xFFFF else m.total
    ids = PlanIds(now, m.mission_id, m.fence_id, m.rally_points_id)
    return replace(
        s, mission_current=m.seq, mission_count=total, mission_state=m.mission_state, reached=reached, plan_ids=ids
    )


def _item_reached(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, reached=s.reached | {m.seq})


def _mission_item(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if m.mission_type not in PARTS:
        return s
    held: tuple[MissionItem, ...] = getattr(s, PARTS[m.mission_type])
    if m.seq > len(held):
        return s
    return with_part(s, m.mission_type, (*held[: m.seq], MissionItem.from_message(m), *held[m.seq + 1 :]))


def _status_text(s: Snapshot, m: Message, now: float) -> Snapshot:
    key, last = (source_of(m)[1], m.id, m.chunk_seq), s.open_text
    if m.id and last is not None and key == last[:3] and s.messages and s.messages[-1] is last.line:
        line = last.line._replace(text=last.line.text + printable(m.text))
        s = replace(s, messages=(*s.messages[:-1], line))
    else:
        s = note(s, now, m.severity, m.text)
    return replace(s, open_text=OpenText(key[0], m.id, m.chunk_seq + 1, s.messages[-1]))


HANDLERS: dict[str, Handler] = {
    **DARKO_HANDLERS,
    "ACTUATOR_OUTPUT_STATUS": lambda s, m, now: s,  # noqa: ARG005 - DARKO_ACTUATORS says more
    "ATTITUDE": _attitude,
    "ATTITUDE_QUATERNION": _attitude_quaternion,
    "BATTERY_STATUS": _battery,
    "CONTROL_STATUS": _control_status,
    "EXTENDED_SYS_STATE": _extended_state,
    "GLOBAL_POSITION_INT": _global_position,
    "HOME_POSITION": _home,
    "LOCAL_POSITION_NED": _local_position,
    "MISSION_CURRENT": _mission_current,
    "MISSION_ITEM_INT": _mission_item,
    "MISSION_ITEM_REACHED": _item_reached,
    "NAV_CONTROLLER_OUTPUT": _navigation,
    "POSITION_TARGET_LOCAL_NED": _position_target,
    "STATUSTEXT": _status_text,
    "SYS_STATUS": _sys_status,
    "VFR_HUD": _vfr_hud,
    "WIND_COV": _wind,
}


def reduce_event(s: Snapshot, event: Event, now: float) -> Snapshot:
    """The snapshot after something happened on this side of the link."""
    handler = EVENT_HANDLERS.get(type(event))
    return s if handler is None else handler(s, event, now)


def said(reason: str) -> str:
    """A result's name, or a reason in words, as it is shown; names of parameters and files keep their letters."""
    return reason.lower().replace("_", " ") if reason.isupper() else reason


def command_name(command: int) -> str:
    """A command's name without its prefix."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    return entry.name.removeprefix("MAV_CMD_").replace("_", " ").lower() if entry else f"command {command}"


def _command_done(s: Snapshot, e: CommandDone, now: float) -> Snapshot:
    if e.command == mavlink.MAV_CMD_REQUEST_MESSAGE:  # this side's own business: nobody ordered it
        return s
    fine = e.result == mavlink.MAV_RESULT_ACCEPTED
    if s.in_progress is not None and s.in_progress.request == e.request:
        s = replace(s, in_progress=None)
    return note(s, now, INFO if fine else WARNING, f"{command_name(e.command)}: {said(e.reason)}")


def _command_progress(s: Snapshot, e: CommandProgress, now: float) -> Snapshot:
    begun = s.in_progress is None or s.in_progress.request != e.request
    s = replace(s, in_progress=e)
    return note(s, now, INFO, f"{command_name(e.command)}: in progress, x cancels") if begun else s


def _control_requested(s: Snapshot, e: ControlRequested, now: float) -> Snapshot:
    s = replace(s, asks_for_control=e.system)
    return note(s, now, NOTICE, f"Ground station {e.system} asks for control: k answers")


def _mission_progress(s: Snapshot, e: MissionProgress, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, transfer=(e.direction, e.done, e.total))


def _mission_uploaded(s: Snapshot, e: MissionUploaded, now: float) -> Snapshot:
    reached = frozenset() if e.kind == MISSION else s.reached
    return note(replace(s, transfer=None, reached=reached), now, INFO, f"{PLAN[e.kind]} of {e.count} items uploaded")


def _mission_downloaded(s: Snapshot, e: MissionDownloaded, now: float) -> Snapshot:
    s = with_part(replace(s, transfer=None), e.kind, e.items)
    if e.items:
        return note(s, now, INFO, f"{PLAN[e.kind]} of {len(e.items)} items downloaded")
    return note(s, now, INFO, "No mission on the vehicle") if e.kind == MISSION else s


def _mission_cleared(s: Snapshot, e: MissionCleared, now: float) -> Snapshot:
    reached = frozenset() if e.kind in {MISSION, ALL} else s.reached
    s = with_part(replace(s, transfer=None, reached=reached), e.kind, ())
    return note(s, now, INFO, f"{PLAN[e.kind]} cleared")


def _mission_failed(s: Snapshot, e: MissionFailed, now: float) -> Snapshot:
    if e.kind != MISSION and e.operation == "download" and e.result == mavlink.MAV_MISSION_UNSUPPORTED:
        return replace(s, transfer=None)  # a vehicle that keeps none has none
    text = f"{PLAN[e.kind]} {e.operation.replace('_', ' ')} failed: {said(e.reason)}"
    return note(replace(s, transfer=None), now, WARNING, text)


EVENT_HANDLERS: dict[type, Callable[[Snapshot, Any, float], Snapshot]] = {
    CommandDone: _command_done,
    CommandProgress: _command_progress,
    ControlRequested: _control_requested,
    MissionProgress: _mission_progress,
    MissionUploaded: _mission_uploaded,
    MissionDownloaded: _mission_downloaded,
    MissionCleared: _mission_cleared,
    MissionFailed: _mission_failed,
    ParameterConfirmed: lambda s, e, now: note(s, now, INFO, f"Parameter {e.name} is {e.value:.7g}"),
    ParameterFailed: lambda s, e, now: note(s, now, WARNING, f"Parameter {e.name or 'list'}: {said(e.reason)}"),
    VehicleFound: lambda s, e, now: note(s, now, NOTICE, f"Vehicle {e.system}/{e.component} found"),
    VehicleLost: lambda s, e, now: note(replace(s, lost=True), now, WARNING, f"Vehicle lost: silent for {e.age:.0f} s"),
    VehicleReturned: lambda s, e, now: note(
        replace(s, lost=False), now, NOTICE, f"Vehicle is back after {e.gap:.0f} s"
    ),
}
