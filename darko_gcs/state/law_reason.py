"""The law in force, and the reason why the vehicle stays with it, in plain words.

The vehicle does not send it: it follows from what the jumps of its table ask for (``sitl/supervisor/guards.py``).
"""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import v_text
from darko_gcs.state.values import VTOL_LABELS, HybridState
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from protocol.names import as_member

CALM_WIND = 3.0  # estimated, below which the linear law of the hover takes over [m/s]
STANDING_SPEED = 2.0  # below which the vehicle counts as at rest [m/s]
ENTERS = {Law.INDI, Law.HOVER_ZERO_MOMENT}  # from which a hover leads to the linear law
LINEAR = {Law.HOVER_LINEAR, Law.FORWARD_LINEAR}
ON_THE_WAY = {mavlink.MAV_LANDED_STATE_TAKEOFF: "taking off", mavlink.MAV_LANDED_STATE_LANDING: "landing"}


def law_reason(s: Snapshot) -> str:
    """Words such as "wind estimate 4.6 m/s: INDI stays"; empty where nothing is known, or on the ground."""
    h = s.hybrid.state
    law = None if h is None else as_member(Law, h.law)
    if h is not None and law in LINEAR and _is_up(s):
        leave = (h.forward if law is Law.FORWARD_LINEAR else h.hover).leave
        return f"V {v_text(h.v)} below {leave:g}: the law stays" if h.v <= leave else ""
    return why_not_linear(s)


def why_not_linear(s: Snapshot) -> str:
    """The same of a law that leads to a linear one; empty of any other."""
    h = s.hybrid.state
    law = None if h is None else as_member(Law, h.law)
    if h is None or law not in ENTERS or not _is_up(s):
        return ""
    why = _kept_by(s, h)
    return f"{why}: {'INDI' if law is Law.INDI else 'the law'} stays" if why else ""


def is_wind_guessed(s: Snapshot) -> bool:
    """True while a wind that the vehicle estimates is only a guess: by its own word, or as it stands on the ground."""
    told = s.estimates.wind_deviation is not None
    return s.estimates.is_wind_unobserved or (told and not _is_up(s))


def _is_up(s: Snapshot) -> bool:
    return bool(s.status.landed_state != mavlink.MAV_LANDED_STATE_ON_GROUND)


def _kept_by(s: Snapshot, h: HybridState) -> str:
    """The hindrance that keeps a hover from the linear law, the one that matters most."""
    if s.status.landed_state in ON_THE_WAY:
        return ON_THE_WAY[s.status.landed_state]
    if s.status.vtol_state != mavlink.MAV_VTOL_STATE_MC:
        return VTOL_LABELS.get(s.status.vtol_state, "")
    wind = s.estimates.wind
    if wind is not None and (speed := math.hypot(*wind[:2])) >= CALM_WIND:
        return f"wind estimate {speed:.1f} m/s"
    if s.position.v is not None and math.hypot(*s.position.v) >= STANDING_SPEED:
        return "moving"
    return f"V {v_text(h.v)} not below {h.hover.enter:g}" if not h.v < h.hover.enter else ""
