"""Messages of estimate, other vehicles, DarkO's own dialect and flight plans, folded into the snapshot.

Only DARKO_PLAN_STATUS begins a plan; whatever names another plan than the last status is late, and is ignored.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from darko_gcs.state.flight_plan_state import (
    FlightPlanState,
    PlanArea,
    PlanButton,
    PlanHappening,
    PlanPoint,
    PlanSetting,
)
from darko_gcs.state.flown_legs import leg_decided
from darko_gcs.state.message_log import HandlerTable, is_on_map
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import printable
from darko_gcs.state.values import (
    Actuators,
    Air,
    Decision,
    Doubt,
    Energy,
    HybridState,
    Jump,
    NetArena,
    Thresholds,
    Truth,
    uses_forward_v,
)
from protocol import units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Limit, Saturation
from protocol.engines.table_values import MAX_ENTRIES
from protocol.errors import LocalProtocolError
from protocol.frames import COVARIANCE_DIAGONAL, Geodetic, flying_attitude, flying_axes
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans import MissionItem
from protocol.units import NO_ITEM
from protocol.wire.message import Message

NORTH, EAST, DOWN, ROLL, PITCH, YAW = COVARIANCE_DIAGONAL
TEST_RATIOS = {
    "vel_ratio": "velocity", "pos_horiz_ratio": "position", "pos_vert_ratio": "height", "mag_ratio": "magnetometer",
    "hagl_ratio": "height above ground", "tas_ratio": "airspeed",
}  # fmt: skip

ESTIMATE_HANDLERS = HandlerTable()


@ESTIMATE_HANDLERS.handles("DARKO_TRUTH")
def _truth(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """The true state, with the nose along x as in the rest of the snapshot."""
    truth = Truth(
        time=m.time_usec / 1e6,
        p=tuple(m.position),
        v=tuple(m.velocity),
        q=flying_attitude(m.q),
        rates=flying_axes(m.rates),
        wind=tuple(m.wind),
    )
    return s._replace(estimates=s.estimates._replace(truth=truth))


@ESTIMATE_HANDLERS.handles("ODOMETRY")
def _odometry(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """Of ODOMETRY the deviations; pose and velocity come more often in other messages."""
    if m.estimator_type == mavlink.MAV_ESTIMATOR_TYPE_NAIVE:
        return s._replace(estimates=s.estimates._replace(doubt=None))
    pose, velocity = ([_root(v) for v in variances] for variances in (m.pose_covariance, m.velocity_covariance))
    doubt = Doubt(
        p=(pose[NORTH], pose[EAST], pose[DOWN]),
        v=max(velocity[NORTH], velocity[EAST], velocity[DOWN]),
        attitude=max(pose[ROLL], pose[PITCH], pose[YAW]),
    )
    return s._replace(estimates=s.estimates._replace(doubt=doubt))


@ESTIMATE_HANDLERS.handles("ESTIMATOR_STATUS")
def _status(s: Snapshot, m: Message, _now: float) -> Snapshot:
    told = [(ratio, reading) for name, reading in TEST_RATIOS.items() if math.isfinite(ratio := getattr(m, name))]
    worst, reading = max(told, default=(None, ""))
    lost = bool(is_place_lost(m.flags))
    return s._replace(estimates=s.estimates._replace(test_ratio=worst, worst_reading=reading, is_place_lost=lost))


def is_place_lost(flags: int | NDArray[np.int64]) -> Any:  # noqa: ANN401 - bool, or an array of them
    """Whether by its ESTIMATOR_STATUS a vehicle that knows its attitude has nothing that tells north and east."""
    return ((flags & mavlink.ESTIMATOR_ATTITUDE) != 0) & ((flags & mavlink.ESTIMATOR_POS_HORIZ_ABS) == 0)


def _root(variance: float) -> float:
    return math.sqrt(variance) if variance >= 0.0 else math.nan


NO_POSITION = (
    mavlink.POSITION_TARGET_TYPEMASK_X_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Y_IGNORE
    | mavlink.POSITION_TARGET_TYPEMASK_Z_IGNORE
)
OTHER_HANDLERS = HandlerTable()


@OTHER_HANDLERS.handles("WIND")
def _wind(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """ArduPilot's wind: where it comes from, its speed, and the share of it that blows down."""
    level = math.sqrt(max(m.speed**2 - m.speed_z**2, 0.0))
    course = math.radians(m.direction + 180.0)
    return s._replace(
        estimates=s.estimates._replace(wind=(level * math.cos(course), level * math.sin(course), m.speed_z))
    )


@OTHER_HANDLERS.handles("POSITION_TARGET_GLOBAL_INT")
def _global_target(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """ArduPilot's target; without a place above mean sea level there is none to show."""
    is_place = m.coordinate_frame in ABSOLUTE_ALTITUDE_FRAMES and not m.type_mask & NO_POSITION
    if not is_place or not is_on_map(m.lat_int, m.lon_int):
        return s._replace(guidance=s.guidance._replace(target_place=None))
    return s._replace(
        guidance=s.guidance._replace(target_place=Geodetic(units.from_e7(m.lat_int), units.from_e7(m.lon_int), m.alt))
    )


@OTHER_HANDLERS.handles("MISSION_ITEM")
def _float_mission_item(s: Snapshot, m: Message, now: float) -> Snapshot:
    """An item of the mission in the older message, with its place in floats."""
    try:
        return mission_item(s, m, now)
    except LocalProtocolError:  # its floats are no place
        return s


def mission_item(s: Snapshot, m: Message, _now: float) -> Snapshot:
    """The snapshot with an item of a plan.

    Raises:
        LocalProtocolError: The floats of a MISSION_ITEM are not a place.
    """
    items = s.plans.of_type(m.mission_type)
    if items is None or m.seq > len(items):
        return s
    items = (*items[: m.seq], MissionItem.from_message(m), *items[m.seq + 1 :])
    return s._replace(plans=s.plans.with_plan(m.mission_type, items))


MAX_JUMPS = 200
MAX_V_POINTS = 1200  # of the chart of V: two minutes at 10 Hz

DARKO_HANDLERS = HandlerTable()


@DARKO_HANDLERS.handles("DARKO_HYBRID_STATE")
def _hybrid(s: Snapshot, m: Message, _now: float) -> Snapshot:
    time = m.time_boot_ms / 1e3
    hybrid = HybridState(
        time=time,
        law=m.law,
        jumps=m.jumps,
        v_hover=m.v_hover,
        v_forward=m.v_forward,
        v_attitude=m.v_attitude,
        hover=Thresholds(m.v_hover_enter, m.v_hover_leave),
        forward=Thresholds(m.v_forward_enter, m.v_forward_leave),
        governor=m.governor,
        last_law=m.last_law,
        last_reason=m.last_reason,
    )
    changed = s.hybrid.state is None or s.hybrid.state.law != m.law
    history = s.hybrid.v_history
    if not history or time > history[-1][0]:
        history = (*history[-MAX_V_POINTS + 1 :], v_point(time, m.law, m.v_hover, m.v_forward))
    return s._replace(
        hybrid=s.hybrid._replace(state=hybrid, v_history=history, law_since=time if changed else s.hybrid.law_since)
    )


def v_point(time: float, law: int, v_hover: float, v_forward: float) -> tuple[float, float, float]:
    """A point of the chart of V: time [s], V of the hover law, V of the forward law.

    In forward flight the hover law's V is defined but far too large for the chart: NaN instead.
    """
    return time, math.nan if uses_forward_v(law) else v_hover, v_forward


@DARKO_HANDLERS.handles("DARKO_JUMP")
def _jump(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if s.hybrid.jumps and m.jump <= s.hybrid.jumps[-1].number:
        return s
    jump = Jump(
        time=m.time_usec / 1e6,
        number=m.jump,
        source=m.law_from,
        target=m.law_to,
        reason=m.reason,
        name=printable(m.name),
        v=m.v,
    )
    return s._replace(hybrid=s.hybrid._replace(jumps=(*s.hybrid.jumps[-MAX_JUMPS + 1 :], jump), law_since=jump.time))


@DARKO_HANDLERS.handles("DARKO_ACTUATORS")
def _actuators(s: Snapshot, m: Message, _now: float) -> Snapshot:
    actuators = Actuators(
        motor=tuple(m.motor_speed),
        motor_command=tuple(m.motor_command),
        thrust=tuple(m.thrust),
        elevon=tuple(m.elevon),
        elevon_command=tuple(m.elevon_command),
        motor_min=m.motor_min,
        motor_max=m.motor_max,
        elevon_max=m.elevon_max,
        limits=Limit(m.limits),
        saturation=Saturation(m.saturation),
    )
    saturated_now = dict.fromkeys(actuators.saturation, m.time_boot_ms / 1e3)
    return s._replace(
        actuation=s.actuation._replace(actuators=actuators, saturated_at={**s.actuation.saturated_at, **saturated_now})
    )


@DARKO_HANDLERS.handles("DARKO_ENERGY")
def _energy(s: Snapshot, m: Message, _now: float) -> Snapshot:
    energy = Energy(m.power, m.energy, tuple(m.energy_by_law), m.time_boot_ms / 1e3)
    return s._replace(battery=s.battery._replace(energy=energy))


@DARKO_HANDLERS.handles("DARKO_DECISION")
def _decision(s: Snapshot, m: Message, _now: float) -> Snapshot:
    decision = Decision(
        time=m.time_boot_ms / 1e3,
        seq=None if m.seq == NO_ITEM else m.seq,
        leg_mode=m.way,
        reason=m.reason,
        distance=m.distance,
        climb=m.climb,
        tail_wind=m.tail_wind,
        cross_wind=m.cross_wind,
        hover_time=m.hover_time,
        hover_energy=m.hover_energy,
        forward_time=m.forward_time,
        forward_energy=m.forward_energy,
    )
    return leg_decided(s._replace(guidance=s.guidance._replace(decision=decision)), decision)


@DARKO_HANDLERS.handles("DARKO_ARENA")
def _arena(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if min(m.length, m.width, m.height) <= 0.0:
        return s
    return s._replace(
        arena=NetArena(
            name=printable(m.name),
            centre=(m.x, m.y),
            heading=m.heading,
            length=m.length,
            width=m.width,
            height=m.height,
            margin=m.margin,
        )
    )


@DARKO_HANDLERS.handles("DARKO_AIR")
def _air(s: Snapshot, m: Message, _now: float) -> Snapshot:
    estimate, true = (tuple(wind) for wind in (m.wind_estimate, m.wind_true))
    return s._replace(estimates=s.estimates._replace(air=Air(estimate, true, m.airspeed_estimate, m.airspeed_true)))


MAX_HAPPENINGS = 100
MAX_LATITUDE, MAX_LONGITUDE = 89.0, 180.0  # of a place that a map can show [deg]

FLIGHT_PLAN_HANDLERS = HandlerTable()
Row = TypeVar("Row")


@FLIGHT_PLAN_HANDLERS.handles("DARKO_PLAN_STATUS")
def _plan_status(s: Snapshot, m: Message, _now: float) -> Snapshot:
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
    return s._replace(flight_plan=plan)


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
    return s._replace(flight_plan=plan)
