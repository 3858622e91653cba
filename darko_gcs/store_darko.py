"""Folding the vehicle's own dialect into the snapshot: what only a DarkO says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from darko_gcs.meanings import MOST
from darko_gcs.snapshot import (
    Actuators,
    Air,
    Decision,
    Energy,
    Hybrid,
    Jump,
    Snapshot,
    Thresholds,
    counts_forward,
)
from darko_gcs.words import printable
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Limit, Saturation
from protocol.engines.parameters import decode_value

__all__ = ["DARKO_HANDLERS", "KEPT_V", "Handler", "v_point"]

KEPT_JUMPS = 200
KEPT_V = 1200  # two minutes at 10 Hz
NO_ITEM = 0xFFFF

Handler = Callable[[Snapshot, Message, float], Snapshot]


def _hybrid(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001 - one signature for all
    time = m.time_boot_ms / 1e3
    hybrid = Hybrid(
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
        history = (*history[-KEPT_V + 1 :], v_point(time, m.law, m.v_hover, m.v_forward))
    return replace(s, hybrid=hybrid, v_history=history, law_since=time if changed else s.law_since)


def v_point(time: float, law: int, v_hover: float, v_forward: float) -> tuple[float, float, float]:
    """A point of the chart of V. On the wing the hover law's V is defined, but far above all that is worth a chart."""
    return time, math.nan if counts_forward(law) else v_hover, v_forward


def _jump(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
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
    return replace(s, jumps=(*s.jumps[-KEPT_JUMPS + 1 :], jump), law_since=jump.time)


def _actuators(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
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
    now_saturated = dict.fromkeys(actuators.saturation, m.time_boot_ms / 1e3)
    return replace(s, actuators=actuators, saturated_at={**s.saturated_at, **now_saturated})


def _energy(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, energy=Energy(m.power, m.energy, tuple(m.energy_by_law)))


def _decision(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    decision = Decision(
        time=m.time_boot_ms / 1e3,
        seq=None if m.seq == NO_ITEM else m.seq,
        way=m.way,
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
    return replace(s, decision=decision)


def _air(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    estimate, true = (tuple(wind) for wind in (m.wind_estimate, m.wind_true))
    return replace(s, air=Air(estimate, true, m.airspeed_estimate, m.airspeed_true))


def _parameter(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if m.param_id not in s.parameters and len(s.parameters) >= MOST:
        return s
    by_value = s.autopilot == mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA
    value = m.param_value if by_value else decode_value(m.param_value, m.param_type)
    return replace(s, parameters={**s.parameters, m.param_id: value}, parameter_count=m.param_count)


DARKO_HANDLERS: dict[str, Handler] = {
    "DARKO_ACTUATORS": _actuators,
    "DARKO_AIR": _air,
    "DARKO_DECISION": _decision,
    "DARKO_ENERGY": _energy,
    "DARKO_HYBRID_STATE": _hybrid,
    "DARKO_JUMP": _jump,
    "PARAM_VALUE": _parameter,
}
