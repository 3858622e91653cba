"""Status line below the mission: figures of the whole plan, and warnings about it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from darko_gcs.state.missions.leg_predictions import LegPrediction
from darko_gcs.state.missions.mission_legs import LANDINGS, LOW_LEG, MissionLeg, low_legs
from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted
from darko_gcs.tui.plan_draft import PlanDraft
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode

NO_PLAN_YET = "no plan: o opens a file, f fetches the vehicle's, i or a click on the map inserts an item"
LOW_WARNING = "LOW: "
LAST_COMMANDS = LANDINGS | {
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_LOITER_UNLIM, mavlink.MAV_CMD_DO_JUMP
}  # fmt: skip


def plan_status(
    draft: PlanDraft,
    s: Snapshot,
    legs: Sequence[MissionLeg],
    predictions: Mapping[int, LegPrediction],
    *,
    is_live: bool,
) -> str:
    """Name, size and whereabouts of the plan, its legs, and what is worth a second look.

    Args:
        draft: The plan.
        s: What is known of the vehicle.
        legs: Of the mission.
        predictions: Of the legs that the vehicle has answered for.
        is_live: Whether there may be a vehicle.
    """
    if not draft.plan.items and not any(draft.vehicle_plans):
        return NO_PLAN_YET if is_live else "no mission in the recording so far"
    state = "not on the vehicle" if draft.changed else "as on the vehicle"
    unsaved = "" if draft.saved or not draft.changed else ", not saved"
    limits = (("fence", draft.fence), ("rally points", draft.rally))
    parts = [counted(len(draft.plan.items), "item")]
    parts += [f"{name} of {len(items)}" for name, items in limits if items]
    totals = leg_totals(legs, predictions)
    name = Path(draft.path).name or ("plan without a file" if draft.changed else "the vehicle's plan")
    texts = (f"{name}: {', '.join(parts)}, {state}{unsaved}", totals, *plan_warnings(draft.plan.items, s, predictions))
    return "; ".join(filter(None, texts))


def plan_warnings(items: Items, s: Snapshot, predictions: Mapping[int, LegPrediction]) -> list[str]:
    """Warnings before the flight: low legs, and an end in the air."""
    forward = [seq for seq, prediction in predictions.items() if prediction.leg_mode == LegMode.FORWARD]
    hovered = {seq for seq, prediction in predictions.items() if prediction.leg_mode == LegMode.HOVER}
    low = [seq for seq in low_legs(items, s, forward) if seq not in hovered]
    warnings = [f"{LOW_WARNING}{_legs_to(low)} below {LOW_LEG:g} m in forward flight"] if low else []
    if items and not any(item.command in LAST_COMMANDS for item in items):
        warnings.append("no landing: it hovers at its last item")
    return warnings


def _legs_to(items: Sequence[int]) -> str:
    return f"{'leg' if len(items) == 1 else 'legs'} to {', '.join(map(str, items))}"


def leg_totals(legs: Sequence[MissionLeg], predictions: Mapping[int, LegPrediction]) -> str:
    """All legs together: "legs 412 m, predicted 96 s, 9.1 kJ"; without take-off, descent of a landing, and waiting."""
    legs = [leg for leg in legs if not leg.is_take_off]
    if not legs:
        return ""
    text = f"legs {sum(leg.distance for leg in legs):.0f} m"
    known = [predictions[leg.seq].chosen for leg in legs if leg.seq in predictions]
    if not known:
        return text
    time, energy = sum(time for time, _ in known), sum(energy for _, energy in known)
    if not math.isfinite(time):
        return f"{text}, NOT POSSIBLE as asked"
    part = "" if len(known) == len(legs) else f" for {len(known)} of {len(legs)}"
    return f"{text}, predicted {time:.0f} s, {energy / 1000.0:.1f} kJ{part}"
