"""Folds events of the ground station's own side of the link into the snapshot: answers, transfers, loss."""

from __future__ import annotations

from functools import singledispatch

from darko_gcs.state.command_words import pilot_words
from darko_gcs.state.message_log import add_line
from darko_gcs.state.missions.plan_parts import ALL_PLANS, MISSION, PLAN_TITLES, with_plan
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.text import counted, printable, reason_text
from protocol.dialect import mavlink
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
    was_in_progress = s.in_progress is not None and s.in_progress.request == e.request
    if was_in_progress:
        s = updated(s, in_progress=None)
    words = s.asked.get(e.request, pilot_words(e.command))
    s = updated(s, asked={request: asked for request, asked in s.asked.items() if request != e.request})
    answer = "done" if was_in_progress and accepted else reason_text(e.reason)
    return add_line(s, now, INFO if accepted else WARNING, f"{words}: {answer}")


@_after.register
def _command_progress(e: CommandProgress, s: Snapshot, now: float) -> Snapshot:
    is_new = s.in_progress is None or s.in_progress.request != e.request
    s = updated(s, in_progress=e)
    words = s.asked.get(e.request, pilot_words(e.command))
    return add_line(s, now, INFO, f"{words}: in progress (x cancels it)") if is_new else s


@_after.register
def _control_requested(e: ControlRequested, s: Snapshot, now: float) -> Snapshot:
    s = updated(s, control_asked_by=e.system)
    return add_line(s, now, NOTICE, f"Ground station {e.system} asks for control (press k to answer)")


@_after.register
def _mission_progress(e: MissionProgress, s: Snapshot, _now: float) -> Snapshot:
    return updated(s, transfer=(e.direction, e.done, e.total))


@_after.register
def _mission_uploaded(e: MissionUploaded, s: Snapshot, now: float) -> Snapshot:
    if e.is_partial:
        return add_line(
            updated(s, transfer=None), now, INFO, f"{PLAN_TITLES[e.kind]}: {counted(e.count, 'item')} replaced"
        )
    s = updated(s, transfer=None, reached=frozenset() if e.kind == MISSION else s.reached)
    return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} of {counted(e.count, 'item')} uploaded")


@_after.register
def _mission_downloaded(e: MissionDownloaded, s: Snapshot, now: float) -> Snapshot:
    s = with_plan(updated(s, transfer=None), e.kind, e.items)
    if e.items:
        return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} of {counted(len(e.items), 'item')} downloaded")
    return add_line(s, now, INFO, "No mission on the vehicle") if e.kind == MISSION else s


@_after.register
def _mission_cleared(e: MissionCleared, s: Snapshot, now: float) -> Snapshot:
    reached = frozenset() if e.kind in {MISSION, ALL_PLANS} else s.reached
    s = with_plan(updated(s, transfer=None, reached=reached), e.kind, ())
    return add_line(s, now, INFO, f"{PLAN_TITLES[e.kind]} cleared")


@_after.register
def _mission_failed(e: MissionFailed, s: Snapshot, now: float) -> Snapshot:
    s = updated(s, transfer=None)
    if e.kind != MISSION and e.operation == "download" and e.result == mavlink.MAV_MISSION_UNSUPPORTED:
        return s  # a vehicle that supports no fence has none: no failure
    text = f"{PLAN_TITLES[e.kind]} {e.operation.replace('_', ' ')} failed: {reason_text(e.reason)}"
    return add_line(s, now, WARNING, text)


@_after.register
def _parameter_confirmed(e: ParameterConfirmed, s: Snapshot, now: float) -> Snapshot:
    return add_line(s, now, INFO, f"Parameter {e.name} is {e.value:.7g}")


@_after.register
def _parameter_failed(e: ParameterFailed, s: Snapshot, now: float) -> Snapshot:
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
    return add_line(s, now, NOTICE, f"Vehicle {e.system}/{e.component} found")


@_after.register
def _vehicle_lost(e: VehicleLost, s: Snapshot, now: float) -> Snapshot:
    return add_line(updated(s, lost=True), now, WARNING, f"Vehicle lost: silent for {e.age:.0f} s")


@_after.register
def _vehicle_returned(e: VehicleReturned, s: Snapshot, now: float) -> Snapshot:
    return add_line(updated(s, lost=False), now, NOTICE, f"Vehicle is back after {e.gap:.0f} s")
