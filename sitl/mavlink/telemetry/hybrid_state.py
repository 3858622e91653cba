"""Messages of the DARKO dialect about the hybrid controller, its actuators and its energy, one function each.

``protocol/dialect/darko.xml`` defines them. A Lyapunov value that is not defined is sent as NaN.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from protocol import frames, units
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.wire.message import Message
from sitl.mavlink.telemetry.navigation import attitude_on_wire, axes_on_wire
from sitl.mavlink.telemetry.streams import StreamTable
from sitl.mavlink.telemetry.vehicle_snapshot import VehicleSnapshot
from sitl.prediction.mode_choice import Decision
from sitl.simulation.recording import JumpRecord

MAX_LAWS = 16  # entries of DARKO_ENERGY.energy_by_law

HYBRID_STREAMS = StreamTable()


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_HYBRID_STATE, 10.0)
def hybrid_state(s: VehicleSnapshot) -> Message:
    """DARKO_HYBRID_STATE: V of each linear law with its thresholds, the law in force and why it took over."""
    return mavlink.MAVLink_darko_hybrid_state_message(
        time_boot_ms=s.ms,
        jumps=s.jumps,
        v_hover=_or_nan(s.v_hover),
        v_forward=_or_nan(s.v_forward),
        v_attitude=_or_nan(s.v_attitude),
        v_hover_enter=s.v_enter,
        v_hover_leave=s.v_leave,
        v_forward_enter=s.v_forward_enter,
        v_forward_leave=s.v_forward_leave,
        governor=s.governor,
        law=s.law,
        last_law=s.last_law,
        last_reason=s.last_reason,
    )


def jump(record: JumpRecord) -> Message:
    """DARKO_JUMP: one jump, at its own time; sent once, for the station's list of jumps."""
    return mavlink.MAVLink_darko_jump_message(
        time_usec=units.microseconds(record.time),
        jump=record.number,
        v=record.v,
        law_from=record.source,
        law_to=record.target,
        reason=record.reason,
        name=record.name.encode("ascii"),
    )


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_ACTUATORS, 20.0)
def actuators(s: VehicleSnapshot) -> Message:
    """DARKO_ACTUATORS: what was asked of the actuators, what they did, and which of their limits was met."""
    return mavlink.MAVLink_darko_actuators_message(
        time_boot_ms=s.ms,
        motor_speed=list(s.motor),
        motor_command=list(s.motor_command),
        thrust=list(s.thrust),
        elevon=list(s.elevon),
        elevon_command=list(s.elevon_command),
        motor_min=s.motor_min,
        motor_max=s.motor_max,
        elevon_max=s.elevon_max,
        limits=s.limits,
        saturation=s.saturation,
    )


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_ENERGY, 2.0)
def energy(s: VehicleSnapshot) -> Message:
    """DARKO_ENERGY: power and energy drawn, in total and by each law."""
    return mavlink.MAVLink_darko_energy_message(
        time_boot_ms=s.ms, power=s.power, energy=s.energy, energy_by_law=_by_number(s.energy_by_law)
    )


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_AIR, 5.0)
def air(s: VehicleSnapshot) -> Message:
    """DARKO_AIR: the estimated wind and the true one."""
    return mavlink.MAVLink_darko_air_message(
        time_boot_ms=s.ms,
        wind_estimate=list(frames.flip(s.wind_estimate)),
        wind_true=list(frames.flip(s.wind)),
        airspeed_estimate=s.airspeed_estimate,
        airspeed_true=s.airspeed,
    )


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_DARKO_TRUTH, 0.0)
def truth(s: VehicleSnapshot) -> Message:
    """DARKO_TRUTH: the state as it is, to hold the estimate against."""
    body = s.plant.body
    return mavlink.MAVLink_darko_truth_message(
        time_usec=units.microseconds(s.time),
        position=list(frames.flip(body.position)),
        velocity=list(frames.flip(body.velocity)),
        q=list(attitude_on_wire(body.attitude)),
        rates=list(axes_on_wire(body.rates)),
        wind=list(frames.flip(s.wind)),
    )


def decision(ms: int, seq: int, made: Decision) -> Message:
    """DARKO_DECISION: whether a leg is hovered or flown forward, and why.

    Args:
        ms: Time since boot [ms].
        seq: Mission item at the end of the leg.
        made: The decision.
    """
    return mavlink.MAVLink_darko_decision_message(
        time_boot_ms=ms,
        distance=made.leg.distance,
        climb=made.leg.climb,
        tail_wind=made.leg.tail_wind,
        cross_wind=made.leg.cross_wind,
        hover_time=made.hover.time,
        hover_energy=made.hover.energy,
        forward_time=made.forward.time,
        forward_energy=made.forward.energy,
        seq=seq,
        way=made.leg_mode,
        reason=made.reason,
    )


@HYBRID_STREAMS.sends(mavlink.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT, 5.0)
def named_values(s: VehicleSnapshot) -> list[Message]:
    """The hybrid controller's key numbers as NAMED_VALUE_FLOAT, for tools without the DARKO dialect."""
    values = {
        "V": _or_nan(s.v_hover),
        "law": float(s.law),
        "jumps": float(s.jumps),
        "governor": s.governor,
        "power": s.power,
    }
    return [
        mavlink.MAVLink_named_value_float_message(s.ms, name.encode("ascii"), value) for name, value in values.items()
    ]


def _or_nan(value: float | None) -> float:
    return math.nan if value is None else value


def _by_number(energy_by_law: Mapping[Law, float]) -> list[float]:
    """Energies in the order of the laws' numbers on the wire [J]."""
    entries = [0.0] * MAX_LAWS
    for law, joules in energy_by_law.items():
        entries[law] = joules
    return entries
