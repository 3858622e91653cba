"""Folding the vehicle's own dialect into the snapshot: what only a DarkO says."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

from darko_gcs.meanings import MOST
from darko_gcs.snapshot import (
    FORWARD_LAWS,
    GIVEN_UP,
    Actuators,
    Air,
    Decision,
    Energy,
    Hybrid,
    Jump,
    Snapshot,
)
from darko_gcs.words import printable
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.engines.parameters import decode_value

__all__ = ["DARKO_HANDLERS", "KEPT_V", "Handler", "v_point"]

KEPT_JUMPS = 200
KEPT_V = 1200  # two minutes at 10 Hz
NO_ITEM = 0xFFFF

Handler = Callable[[Snapshot, Message, float], Snapshot]


def _hybrid(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001 - one signature for all
    time = m.time_boot_ms / 1e3
    hybrid = Hybrid(
        time,
        m.law,
        m.jumps,
        m.v_hover,
        m.v_forward,
        m.v_enter,
        m.v_leave,
        m.governor,
        m.last_law,
        m.last_reason,
        m.v_attitude,
    )
    changed = s.hybrid is None or s.hybrid.law != m.law
    history = s.v_history
    if not history or time > history[-1][0]:
        history = (*history[-KEPT_V + 1 :], v_point(time, m.law, m.v_hover, m.v_forward))
    s = replace(s, hybrid=hybrid, v_history=history, law_since=time if changed else s.law_since)
    # The message has room for one pair of thresholds, and upright it is the hover law's.
    return s if m.law in FORWARD_LAWS else replace(s, hover_limits=(m.v_enter, m.v_leave))


def v_point(time: float, law: int, v_hover: float, v_forward: float) -> tuple[float, float, float]:
    """A point of the chart of V. On the wing the hover law's V is defined, but far above all that is worth a chart."""
    return time, math.nan if law in FORWARD_LAWS else v_hover, v_forward


def _jump(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    if s.jumps and m.jump <= s.jumps[-1].number:
        return s
    jump = Jump(m.time_usec / 1e6, m.jump, m.law_from, m.law_to, m.reason, printable(m.name), m.v)
    return replace(s, jumps=(*s.jumps[-KEPT_JUMPS + 1 :], jump), law_since=jump.time)


def _actuators(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    actuators = Actuators(
        tuple(m.motor_speed),
        tuple(m.motor_command),
        tuple(m.thrust),
        tuple(m.elevon),
        tuple(m.elevon_command),
        m.motor_min,
        m.motor_max,
        m.elevon_max,
        m.limits,
        m.given_up,
    )
    time, before = m.time_boot_ms / 1e3, s.given_up_at or (-math.inf,) * len(GIVEN_UP)
    given_up_at = tuple(time if m.given_up & 1 << bit else at for bit, at in enumerate(before))
    return replace(s, actuators=actuators, given_up_at=given_up_at)


def _energy(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    return replace(s, energy=Energy(m.power, m.energy, (*m.energy_by_law, m.energy_attitude)))


def _decision(s: Snapshot, m: Message, now: float) -> Snapshot:  # noqa: ARG001
    decision = Decision(
        m.time_boot_ms / 1e3, None if m.seq == NO_ITEM else m.seq, m.way, m.reason, m.distance, m.climb, m.tail_wind,
        m.cross_wind, m.hover_time, m.hover_energy, m.forward_time, m.forward_energy,
    )  # fmt: skip
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
