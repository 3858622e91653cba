"""Requests and what became of them, folded into the snapshot: ours, and those of stations in a recording.

On the link the station knows its requests itself (``reduce_events``): there these messages change nothing.
"""

from __future__ import annotations

import math
from functools import singledispatch

from darko_gcs.state.arrivals import accepted_point
from darko_gcs.state.message_log import HandlerTable, add_line, is_on_map
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.speed_in_force import accepted_command, asked_speed
from darko_gcs.state.text import RESTARTED, counted, pilot_words, printable, reason_text, request_words, vehicle_name
from darko_gcs.state.values import ALL_PLANS, MISSION, PLAN_TITLES
from protocol import units
from protocol.dialect import mavlink
from protocol.engines.table_values import decode_value
from protocol.events import (
    CommandDone,
    CommandProgress,
    ControlRequested,
    Event,
    FlightPlanAnswered,
    FlightPlanFailed,
    FlightPlanReceived,
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
from protocol.frames import Geodetic
from protocol.names import enum_name, is_global_frame
from protocol.tools.option_values import GROUND_SYSTEM
from protocol.wire.message import Message, source_of

INFO, NOTICE, WARNING = mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_NOTICE, mavlink.MAV_SEVERITY_WARNING


def reduce_event(s: Snapshot, event: Event, now: float) -> Snapshot:
    """The snapshot after an event of the ground endpoint.

    Args:
        s: The snapshot before.
        event: What happened.
        now: When, on the caller's clock [s].
    """
    return _after(event, s, now)


@singledispatch
def _after(_event: Event, s: Snapshot, _now: float) -> Snapshot:
    return s


@_after.register
def _command_done(e: CommandDone, s: Snapshot, now: float) -> Snapshot:
    if e.command == mavlink.MAV_CMD_REQUEST_MESSAGE:  # sent automatically, not by the operator: not logged
        return s
    accepted = e.result == mavlink.MAV_RESULT_ACCEPTED
    if accepted and e.command == mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT:  # every step of a move is one
        return s
    was_in_progress = s.operator.in_progress is not None and s.operator.in_progress.request == e.request
    if was_in_progress:
        s = s._replace(operator=s.operator._replace(in_progress=None))
    words = s.operator.asked.get(e.request, pilot_words(e.command))
    s = s._replace(
        operator=s.operator._replace(
            asked={request: asked for request, asked in s.operator.asked.items() if request != e.request}
        )
    )
    s = accepted_point(accepted_command(s, e.command), e.command) if accepted else s
    answer = "done" if was_in_progress and accepted else reason_text(e.reason)
    return add_line(s, now, INFO if accepted else WARNING, f"{words}: {answer}")


@_after.register
def _command_progress(e: CommandProgress, s: Snapshot, now: float) -> Snapshot:
    is_new = s.operator.in_progress is None or s.operator.in_progress.request != e.request
    s = s._replace(operator=s.operator._replace(in_progress=e))
    words = s.operator.asked.get(e.request, pilot_words(e.command))
    return add_line(s, now, INFO, f"{words}: in progress (x cancels it)") if is_new else s


@_after.register
def _control_requested(e: ControlRequested, s: Snapshot, now: float) -> Snapshot:
    s = s._replace(operator=s.operator._replace(control_asked_by=e.system))
    return add_line(s, now, NOTICE, f"Ground station {e.system} asks for control (press k to answer)")


@_after.register
def _mission_progress(e: MissionProgress, s: Snapshot, _now: float) -> Snapshot:
    return s._replace(plans=s.plans._replace(transfer=(e.direction, e.done, e.total)))


@_after.register
def _mission_uploaded(e: MissionUploaded, s: Snapshot, now: float) -> Snapshot:
    if e.is_partial:
        return add_line(
            s._replace(plans=s.plans._replace(transfer=None)),
            now,
            INFO,
            f"{PLAN_TITLES[e.kind]}: {counted(e.count, 'item')} replaced",
        )
    s = s._replace(
        plans=s.plans._replace(transfer=None),
        mission=s.mission._replace(reached=frozenset() if e.kind == MISSION else s.mission.reached),
    )
    return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} of {counted(e.count, 'item')} uploaded")


@_after.register
def _mission_downloaded(e: MissionDownloaded, s: Snapshot, now: float) -> Snapshot:
    s = s._replace(plans=s.plans.with_plan(e.kind, e.items)._replace(transfer=None))
    if e.items:
        return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} of {counted(len(e.items), 'item')} downloaded")
    return add_line(s, now, INFO, "No mission on the vehicle") if e.kind == MISSION else s


@_after.register
def _mission_cleared(e: MissionCleared, s: Snapshot, now: float) -> Snapshot:
    reached = frozenset() if e.kind in {MISSION, ALL_PLANS} else s.mission.reached
    plans = s.plans.with_plan(e.kind, ())._replace(transfer=None)
    s = s._replace(plans=plans, mission=s.mission._replace(reached=reached))
    return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} cleared")


@_after.register
def _mission_failed(e: MissionFailed, s: Snapshot, now: float) -> Snapshot:
    s = s._replace(plans=s.plans._replace(transfer=None))
    if e.kind != MISSION and e.operation == "download" and e.result == mavlink.MAV_MISSION_UNSUPPORTED:
        return s  # a vehicle that supports no fence has none: no failure
    if e.operation == "download" and e.reason == RESTARTED:
        return s  # it is asked again
    text = f"{PLAN_TITLES[e.kind]} {e.operation.replace('_', ' ')} failed: {reason_text(e.reason)}"
    return add_line(s, now, WARNING, text)


@_after.register
def _parameter_confirmed(e: ParameterConfirmed, s: Snapshot, now: float) -> Snapshot:
    return add_line(s, now, INFO, f"Parameter {e.name} is {e.value:.7g}")


@_after.register
def _parameter_failed(e: ParameterFailed, s: Snapshot, now: float) -> Snapshot:
    if not e.name and e.reason == RESTARTED:
        return s  # it is asked again
    return add_line(s, now, WARNING, f"Parameter {e.name or 'list'}: {reason_text(e.reason)}")


@_after.register
def _flight_plan_received(_e: FlightPlanReceived, s: Snapshot, now: float) -> Snapshot:
    name = "" if s.flight_plan is None else f" {s.flight_plan.name}"
    return add_line(s, now, INFO, f"Flight plan{name} received")


@_after.register
def _flight_plan_answered(e: FlightPlanAnswered, s: Snapshot, now: float) -> Snapshot:
    text = f"Flight plan refused: {printable(e.text)}" if e.text else "Flight plan loaded"
    return add_line(s, now, WARNING if e.text else INFO, text)


@_after.register
def _flight_plan_failed(e: FlightPlanFailed, s: Snapshot, now: float) -> Snapshot:
    return add_line(s, now, WARNING, f"Flight plan not received: {e.reason}")


@_after.register
def _vehicle_found(e: VehicleFound, s: Snapshot, now: float) -> Snapshot:
    return add_line(s, now, NOTICE, f"{vehicle_name((e.system, e.component)).capitalize()} found")


@_after.register
def _vehicle_lost(e: VehicleLost, s: Snapshot, now: float) -> Snapshot:
    return add_line(
        s._replace(link=s.link._replace(lost=True)), now, WARNING, f"Vehicle lost: silent for {e.age:.0f} s"
    )


@_after.register
def _vehicle_returned(e: VehicleReturned, s: Snapshot, now: float) -> Snapshot:
    return add_line(s._replace(link=s.link._replace(lost=False)), now, NOTICE, f"Vehicle is back after {e.gap:.0f} s")


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
    if (
        not s.session.is_replay
        or s.identity.source is None
        or source == s.identity.source
        or m.target_system not in {0, s.identity.source[0]}
    ):
        return s
    text = f"Sent{'' if source[0] == GROUND_SYSTEM else f' by {source[0]}/{source[1]}'}: {words}"
    return s if s.log.lines and s.log.lines[-1].text == text else add_line(s, now, INFO, text)


def _answered(s: Snapshot, m: Message, now: float, words: str, *, accepted: bool) -> Snapshot:
    if not s.session.is_replay or source_of(m) != s.identity.source:
        return s
    return add_line(s, now, INFO if accepted else WARNING, words)


@REQUEST_HANDLERS.handles("COMMAND_LONG")
def _command_long(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC or m.confirmation:
        return s
    params = tuple(getattr(m, f"param{number}") for number in range(1, 8))
    words = request_words(m.command, params, is_ours=s.is_darko)
    s = _remembered(s, m.command, words)
    if s.session.is_replay and m.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
        s = asked_speed(s, m.param1, m.param2)
    if m.command == mavlink.MAV_CMD_DO_REPOSITION:
        words += _place_words(s, params[4], params[5], params[6])
    return _sent(s, m, now, words)


@REQUEST_HANDLERS.handles("COMMAND_INT")
def _command_int(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC:
        return s
    params = (m.param1, m.param2, m.param3, m.param4, m.x, m.y, m.z)
    words = request_words(m.command, params, is_ours=s.is_darko)
    s = _remembered(s, m.command, words)
    if m.command == mavlink.MAV_CMD_DO_REPOSITION and is_global_frame(m.frame):
        words += _place_words(s, units.from_e7(m.x), units.from_e7(m.y), m.z)
    return _sent(s, m, now, words)


def _remembered(s: Snapshot, command: int, words: str) -> Snapshot:
    """In a recording, what was asked for by a MAV_CMD last: its answer is told in the same words as live."""
    if not s.session.is_replay:
        return s
    return s._replace(operator=s.operator._replace(asked={**s.operator.asked, command: words}))


def _place_words(s: Snapshot, lat: float, lon: float, height: float) -> str:
    """A place from home, as the operator enters it."""
    up = f", {height:.1f} m up" if math.isfinite(height) else ""
    if s.position.home is None or not (math.isfinite(lat) and math.isfinite(lon)):
        return up
    if not is_on_map(round(lat * 1e7), round(lon * 1e7)):
        return up
    place = s.position.local(Geodetic(lat, lon, s.position.home.alt))
    if place is None:
        return up
    return f" north {place[0] - s.position.home_p[0]:.1f}, east {place[1] - s.position.home_p[1]:.1f} m{up}"


@REQUEST_HANDLERS.handles("COMMAND_ACK")
def _command_ack(s: Snapshot, m: Message, now: float) -> Snapshot:
    if m.command in AUTOMATIC or m.result == mavlink.MAV_RESULT_IN_PROGRESS:
        return s
    asked = s.operator.asked.get(m.command, pilot_words(m.command))
    words = f"{asked}: {reason_text(enum_name('MAV_RESULT', m.result))}"
    accepted = m.result == mavlink.MAV_RESULT_ACCEPTED
    s = accepted_command(s, m.command) if accepted and s.session.is_replay else s
    return _answered(s, m, now, words, accepted=accepted)


@REQUEST_HANDLERS.handles("PARAM_SET")
def _param_set(s: Snapshot, m: Message, now: float) -> Snapshot:
    is_cast = s.identity.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA  # integers as floats of the same value
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
