"""Requests of ground stations in a recording, and the vehicle's answers: lines of the message log.

On the link the station knows its requests itself (``reduce_events``): there these messages change nothing.
"""

from __future__ import annotations

import math

from darko_gcs.state.command_words import pilot_words, request_words
from darko_gcs.state.message_handlers import HandlerTable, is_on_map
from darko_gcs.state.message_log import add_line
from darko_gcs.state.missions.plan_parts import MISSION, PLAN_TITLES
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted, printable, reason_text
from protocol import units
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GROUND_SYSTEM
from protocol.engines.parameter_values import decode_value
from protocol.frames import Geodetic, is_global_frame
from protocol.names import enum_name
from protocol.wire.message import Message, source_of

AUTOMATIC = frozenset(  # sent by programs, not by an operator
    {
        mavlink.MAV_CMD_REQUEST_MESSAGE,
        mavlink.MAV_CMD_SET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_GET_MESSAGE_INTERVAL,
        mavlink.MAV_CMD_GET_HOME_POSITION,
        mavlink.MAV_CMD_REQUEST_PROTOCOL_VERSION,
        mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES,
        mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT,  # every step of a move is one
    }
)
REQUEST_HANDLERS = HandlerTable()


def _sent(s: Snapshot, m: Message, now: float, words: str) -> Snapshot:
    """A line about a request to the vehicle; a repetition on a lossy link has none."""
    source = source_of(m)
    if not s.is_replay or s.source is None or source == s.source or m.target_system not in {0, s.source[0]}:
        return s
    text = f"Sent{'' if source[0] == GROUND_SYSTEM else f' by {source[0]}/{source[1]}'}: {words}"
    return s if s.messages and s.messages[-1].text == text else add_line(s, now, INFO, text)


def _answered(s: Snapshot, m: Message, now: float, words: str, *, accepted: bool) -> Snapshot:
    if not s.is_replay or source_of(m) != s.source:
        return s
    return add_line(s, now, INFO if accepted else WARNING, words)


@REQUEST_HANDLERS.handles("COMMAND_LONG")
def _command_long(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC or m.confirmation:
        return s
    params = tuple(getattr(m, f"param{number}") for number in range(1, 8))
    words = request_words(m.command, params)
    if m.command == mavlink.MAV_CMD_DO_REPOSITION:
        words += _place_words(s, params[4], params[5], params[6])
    return _sent(s, m, now, words)


@REQUEST_HANDLERS.handles("COMMAND_INT")
def _command_int(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC:
        return s
    words = request_words(m.command, (m.param1, m.param2, m.param3, m.param4, m.x, m.y, m.z))
    if m.command == mavlink.MAV_CMD_DO_REPOSITION and is_global_frame(m.frame):
        words += _place_words(s, units.from_e7(m.x), units.from_e7(m.y), m.z)
    return _sent(s, m, now, words)


def _place_words(s: Snapshot, lat: float, lon: float, height: float) -> str:
    """A place from home, as the operator enters it."""
    up = f", {height:.1f} m up" if math.isfinite(height) else ""
    if s.home is None or not (math.isfinite(lat) and math.isfinite(lon)):
        return up
    if not is_on_map(round(lat * 1e7), round(lon * 1e7)):
        return up
    place = s.local(Geodetic(lat, lon, s.home.alt))
    if place is None:
        return up
    return f" north {place[0] - s.home_p[0]:.1f}, east {place[1] - s.home_p[1]:.1f} m{up}"


@REQUEST_HANDLERS.handles("COMMAND_ACK")
def _command_ack(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC or m.result == mavlink.MAV_RESULT_IN_PROGRESS:
        return s
    words = f"{pilot_words(m.command)}: {reason_text(enum_name('MAV_RESULT', m.result))}"
    return _answered(s, m, now, words, accepted=m.result == mavlink.MAV_RESULT_ACCEPTED)


@REQUEST_HANDLERS.handles("PARAM_SET")
def _param_set(s: Snapshot, m: Message, now: float) -> Snapshot:
    is_cast = s.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA  # integers as floats of the same value
    value = m.param_value if is_cast else decode_value(m.param_value, m.param_type)
    return _sent(s, m, now, f"parameter {printable(m.param_id)} = {value:.7g}")


@REQUEST_HANDLERS.handles("MISSION_COUNT")
def _mission_count(s: Snapshot, m: Message, now: float) -> Snapshot:
    return _sent(s, m, now, f"{_title(m)} of {counted(m.count, 'item')}")


@REQUEST_HANDLERS.handles("MISSION_WRITE_PARTIAL_LIST")
def _mission_partial(s: Snapshot, m: Message, now: float) -> Snapshot:
    return _sent(s, m, now, f"{_title(m)} changed at items {m.start_index} to {m.end_index}")


@REQUEST_HANDLERS.handles("MISSION_CLEAR_ALL")
def _mission_clear(s: Snapshot, m: Message, now: float) -> Snapshot:
    return _sent(s, m, now, f"clear the {_title(m)}")


@REQUEST_HANDLERS.handles("MISSION_SET_CURRENT")
def _mission_set_current(s: Snapshot, m: Message, now: float) -> Snapshot:
    return _sent(s, m, now, f"continue at item {m.seq}")


@REQUEST_HANDLERS.handles("MISSION_ACK")
def _mission_ack(s: Snapshot, m: Message, now: float) -> Snapshot:
    words = reason_text(enum_name("MAV_MISSION_RESULT", m.type, "MAV_MISSION"))
    return _answered(s, m, now, f"{_title(m)}: {words}", accepted=m.type == mavlink.MAV_MISSION_ACCEPTED)


def _title(m: Message) -> str:
    """The plan that a message is about: "mission", "fence"."""
    return PLAN_TITLES.get(getattr(m, "mission_type", MISSION), "plan").lower()
