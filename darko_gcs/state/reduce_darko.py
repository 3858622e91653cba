"""Folds the messages of DarkO's own dialect (DARKO_*) into the snapshot."""

from __future__ import annotations

import math

from darko_gcs.state.message_handlers import HandlerTable
from darko_gcs.state.snapshot import Snapshot, updated
from darko_gcs.state.text import printable
from darko_gcs.state.values import (
    Actuators,
    Air,
    Decision,
    Energy,
    HybridState,
    Jump,
    Thresholds,
    uses_forward_v,
)
from protocol.dialect.vocabulary import Limit, Saturation
from protocol.units import NO_ITEM
from protocol.wire.message import Message

__all__ = ["DARKO_HANDLERS", "MAX_V_POINTS", "v_point"]

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
    changed = s.hybrid is None or s.hybrid.law != m.law
    history = s.v_history
    if not history or time > history[-1][0]:
        history = (*history[-MAX_V_POINTS + 1 :], v_point(time, m.law, m.v_hover, m.v_forward))
    return updated(s, hybrid=hybrid, v_history=history, law_since=time if changed else s.law_since)


def v_point(time: float, law: int, v_hover: float, v_forward: float) -> tuple[float, float, float]:
    """A point of the chart of V: time [s], V of the hover law, V of the forward law.

    In forward flight the hover law's V is defined but far too large for the chart: NaN instead.
    """
    return time, math.nan if uses_forward_v(law) else v_hover, v_forward


@DARKO_HANDLERS.handles("DARKO_JUMP")
def _jump(s: Snapshot, m: Message, _now: float) -> Snapshot:
    if s.jumps and m.jump <= s.jumps[-1].number:
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
    return updated(s, jumps=(*s.jumps[-MAX_JUMPS + 1 :], jump), law_since=jump.time)


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
    return updated(s, actuators=actuators, saturated_at={**s.saturated_at, **saturated_now})


@DARKO_HANDLERS.handles("DARKO_ENERGY")
def _energy(s: Snapshot, m: Message, _now: float) -> Snapshot:
    return updated(s, energy=Energy(m.power, m.energy, tuple(m.energy_by_law)))


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
    return updated(s, decision=decision)


@DARKO_HANDLERS.handles("DARKO_AIR")
def _air(s: Snapshot, m: Message, _now: float) -> Snapshot:
    estimate, true = (tuple(wind) for wind in (m.wind_estimate, m.wind_true))
    return updated(s, air=Air(estimate, true, m.airspeed_estimate, m.airspeed_true))
