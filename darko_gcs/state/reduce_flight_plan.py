"""Folds the messages of flight plans (DARKO_PLAN_*) into the snapshot.

Only DARKO_PLAN_STATUS begins a plan; whatever names another plan than the last status is late, and is ignored.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

from darko_gcs.state.flight_plan_state import (
    FlightPlanState,
    PlanArea,
    PlanButton,
    PlanHappening,
    PlanPoint,
    PlanSetting,
)
from darko_gcs.state.message_handlers import HandlerTable
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.text import printable
from protocol import units
from protocol.engines.flight_plan_table import MAX_ENTRIES
from protocol.frames import Geodetic
from protocol.wire.message import Message

MAX_HAPPENINGS = 100
MAX_LATITUDE, MAX_LONGITUDE = 89.0, 180.0  # of a place that a map can show [deg]

FLIGHT_PLAN_HANDLERS = HandlerTable()
Row = TypeVar("Row")


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_STATUS")
def _status(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = s.flight_plan
    if plan is None or (plan.plan_id, plan.entries) != (m.plan_id, m.entries):
        plan = FlightPlanState(plan_id=m.plan_id, entries=m.entries, name=printable(m.name))
    plan = replace(
        plan,
        block=m.block,
        stage=m.stage,
        line=m.line,
        stage_text=printable(m.stage_text),
        aim=m.aim,
        block_time=m.block_time,
        stage_time=m.stage_time,
        flight_time=m.flight_time,
    )
    return updated(s, flight_plan=plan)


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_BLOCK")
def _block(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = _meant(s, m)
    if plan is None:
        return s
    name, label = printable(m.name), printable(m.strip_button)
    button = PlanButton(
        number=m.number,
        name=name,
        label=label or name,
        key=printable(m.shortcut),
        group=printable(m.group),
        locked=printable(m.locked),
        has_button=bool(label),
    )
    return _with(s, replace(plan, blocks=_sorted({**plan.blocks, m.number: button})))


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_WAYPOINT")
def _waypoint(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = _meant(s, m)
    if plan is None:
        return s
    lat, lon = units.from_e7(m.lat), units.from_e7(m.lon)
    is_placed = abs(lat) <= MAX_LATITUDE and abs(lon) <= MAX_LONGITUDE
    place = Geodetic(lat, lon, m.alt) if is_placed else None
    point = PlanPoint(m.number, printable(m.name), (m.x, m.y, m.z), place, bool(m.shown))
    return _with(s, replace(plan, points=_sorted({**plan.points, m.number: point})))


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_VARIABLE")
def _variable(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = _meant(s, m)
    if plan is None:
        return s
    name, label, unit = (printable(text) for text in (m.name, m.label, m.unit))
    setting = PlanSetting(m.number, name, label or name, m.value, m.minimum, m.maximum, m.step, unit)
    return _with(s, replace(plan, settings=_sorted({**plan.settings, m.number: setting})))


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_SECTOR")
def _sector(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = _meant(s, m)
    if plan is None:
        return s
    area = PlanArea(m.number, printable(m.name), tuple(number for number in m.corners if number), bool(m.fence))
    return _with(s, replace(plan, areas=_sorted({**plan.areas, m.number: area})))


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_EVENT")
def _event(s: Snapshot, m: Message, _now: float) -> Snapshot:
    plan = s.flight_plan
    if plan is None or m.plan_id != plan.plan_id or any(h.number == m.number for h in plan.happenings):
        return s
    happening = PlanHappening(m.number, m.time_usec / 1e6, m.kind, m.line, m.from_block, m.to_block, printable(m.text))
    in_order = sorted((*plan.happenings, happening), key=lambda h: h.time)  # one that was missed comes late
    return _with(s, replace(plan, happenings=tuple(in_order[-MAX_HAPPENINGS:])))


def _meant(s: Snapshot, m: Message) -> FlightPlanState | None:
    """The plan that an entry belongs to; None if it is not the present one, or its table is full."""
    plan = s.flight_plan
    if plan is None or m.plan_id != plan.plan_id or m.entry >= min(plan.entries, MAX_ENTRIES):
        return None
    return plan


def _sorted(table: dict[int, Row]) -> dict[int, Row]:
    return dict(sorted(table.items()))


def _with(s: Snapshot, plan: FlightPlanState) -> Snapshot:
    return updated(s, flight_plan=plan)
