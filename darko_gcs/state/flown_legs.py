"""Time and energy of each leg of the mission as it was flown, beside what the vehicle predicted when it began.

The prediction is that of DARKO_DECISION, which the vehicle sends as it begins a leg: nothing is asked for, and a
recording has it, too.
"""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Decision, FlownLeg
from protocol.dialect import mavlink


def mission_begun(s: Snapshot) -> Snapshot:
    """The snapshot as a mission begins from its first item: nothing of it is flown."""
    return s._replace(mission=s.mission._replace(flown={}, began=None if s.link.boot is None else _meter(s)))


def leg_decided(s: Snapshot, d: Decision) -> Snapshot:
    """The snapshot after a decision: the leg to its item begins; one that is decided again begins again."""
    predicted = d.chosen
    if d.seq is None or predicted is None:
        return s
    leg = FlownLeg(*_meter(s), *predicted, distance=d.distance, climb=d.climb)
    return s._replace(mission=s.mission._replace(flown={**s.mission.flown, d.seq: leg}))


def leg_reached(s: Snapshot, seq: int) -> Snapshot:
    """The snapshot at the end of the leg to an item; legs that were decided before begin there."""
    time, energy = _meter(s)
    flown = {
        number: leg if leg.is_over else leg._replace(began=time, energy_before=energy)
        for number, leg in s.mission.flown.items()
    }
    leg = s.mission.flown.get(seq)
    if leg is not None and not leg.is_over:
        flown[seq] = leg._replace(time=time - leg.began, energy=energy - leg.energy_before)
    return s._replace(mission=s.mission._replace(flown=flown))


def mission_done_words(s: Snapshot) -> str:
    """The end of the mission, with what it took: "Mission done: 52 s, 3.1 kJ; legs 33.5 s, 1.9 kJ (predicted ...)"."""
    if s.mission.began is None:
        return "Mission done"
    time, energy = (now - then for now, then in zip(_meter(s), s.mission.began, strict=True))
    taken = f"Mission done: {time:.0f} s{_kilojoules(energy)}"
    return "; ".join(filter(None, (taken, flown_words(s))))


def flown_words(s: Snapshot) -> str:
    """All legs that are flown beside their predictions: "legs 33.5 s, 1.9 kJ (predicted 33.0 s, 1.8 kJ)"."""
    legs = [leg for leg in s.mission.flown.values() if leg.is_over]
    if not legs:
        return ""
    time, energy = sum(leg.time for leg in legs), sum(leg.energy for leg in legs)
    predicted = sum(leg.predicted_time for leg in legs), sum(leg.predicted_energy for leg in legs)
    wanted = f"{predicted[0]:.1f} s{_kilojoules(predicted[1])}"
    return f"legs {time:.1f} s{_kilojoules(energy)} (predicted {wanted})"


def is_last_flight(s: Snapshot) -> bool:
    """Whether the flown legs are those of a flight that is over: the vehicle stands, and a next one is predicted."""
    return s.status.landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND and not s.status.armed


def _kilojoules(energy: float) -> str:
    return f", {energy / 1e3:.1f} kJ" if math.isfinite(energy) else ""


def _meter(s: Snapshot) -> tuple[float, float]:
    """The vehicle's time [s] and the energy used until then [J]; NaN for what it does not tell."""
    time = math.nan if s.link.boot is None else s.link.boot
    used = s.battery.energy
    if used is None or used.time is None:
        return time, math.nan
    return time, used.total + used.power * max(0.0, time - used.time)
