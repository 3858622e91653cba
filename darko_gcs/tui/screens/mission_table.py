"""The table of the mission screen: items with their legs, and what each leg takes in the hover and in the cruise."""

from __future__ import annotations

import math
from collections.abc import Mapping

from darko_gcs.state.missions.leg_predictions import LegPrediction
from darko_gcs.state.missions.mission_frames import place_of
from darko_gcs.state.missions.mission_labels import FRAME_LABELS, field_text, mission_command_of
from darko_gcs.state.missions.mission_legs import MissionLeg
from darko_gcs.state.missions.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import command_name
from darko_gcs.tui.widgets.row_table import RowTable
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans import MissionItem

COLUMNS = ("", " #", "item", "  north", "   east", " alt", " leg", "climb", "way", "hover s J", "cruise s J")
WAY_LABELS = {LegMode.NONE: "auto", LegMode.HOVER: "hover", LegMode.FORWARD: "cruise"}
NEXT_WAYS = {0.0: "then auto", 3.0: "then hover", 4.0: "then cruise"}  # by the MAV_VTOL_STATE of a transition
SHORT_NAMES = {
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: "return home",
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: "takeoff",
    mavlink.MAV_CMD_NAV_VTOL_LAND: "land",
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: "loiter",
}
MAX_LABEL = 13  # cells


class MissionTable(RowTable):
    """One row for each item; the cursor's is the chosen one."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__([f"{name} " for name in COLUMNS], id=id, padding=0)

    def show(
        self,
        items: Items,
        s: Snapshot,
        legs: Mapping[int, MissionLeg],
        predictions: Mapping[int, LegPrediction],
        *,
        is_on_vehicle: bool,
    ) -> None:
        """Bring the rows up to date; the cursor stays in its row.

        Args:
            items: The mission that is edited.
            s: Progress and home of the vehicle.
            legs: By the item that each leads to.
            predictions: Of the legs that the vehicle has answered for.
            is_on_vehicle: Whether the vehicle has this mission, so that its progress is of these items.
        """
        progress = [_mark(s, seq) if is_on_vehicle else " " for seq in range(len(items))]
        self.show_rows(
            {
                str(seq): (progress[seq], *_item_cells(seq, item, s), *_leg_cells(legs.get(seq), predictions.get(seq)))
                for seq, item in enumerate(items)
            }
        )


def item_label(item: MissionItem) -> str:
    """Action of an item, in few words: "waypoint 2 s", "then cruise", "loiter 30 s"."""
    first, second = item.params[:2]
    name = SHORT_NAMES.get(item.command) or command_name(item.command).removeprefix("nav ").removeprefix("do ")
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
        name = NEXT_WAYS.get(first, name)
    elif item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
        name = f"speed {field_text(second)}" if second > 0.0 else "own speed"
    elif item.command == mavlink.MAV_CMD_DO_JUMP:
        name = f"jump {field_text(first)} x{field_text(second)}"
    elif item.command == mavlink.MAV_CMD_NAV_LOITER_TURNS:
        name = f"turns x{field_text(first)}"
    elif item.command == mavlink.MAV_CMD_NAV_LOITER_TIME:
        name = f"loiter {field_text(first)} s"
    elif item.command in {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_DELAY} and first > 0.0:
        name = f"{name} {field_text(first)} s"
    return name[:MAX_LABEL]


def _mark(s: Snapshot, seq: int) -> str:
    active = s.mission_state in {mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED}
    return "▶" if active and seq == s.mission_current else "✓" if seq in s.reached else " "


def _item_cells(seq: int, item: MissionItem, s: Snapshot) -> tuple[str, ...]:
    north = east = height = ""
    if mission_command_of(item).has_place:
        place = None if s.home is None else place_of(item, s.home, s.home_p)
        if place is not None:
            north, east = (
                f"{round(part - home, 1) + 0.0:.1f}" for part, home in zip(place, s.home_p[:2], strict=False)
            )
        height = "-" if math.isnan(item.z) else f"{round(item.z, 1) + 0.0:.1f}"
        height += f" {FRAME_LABELS.get(item.frame, item.frame)}"
    return f"{seq:>2} ", f"{item_label(item)} ", f"{north:>7} ", f"{east:>7} ", f"{height:>8} "


def _leg_cells(leg: MissionLeg | None, p: LegPrediction | None) -> tuple[str, ...]:
    if leg is None:
        return ("",) * 5
    way = "" if leg.is_take_off else WAY_LABELS[leg.asked]
    lengths = f"{leg.distance:>4.0f} ", f"{round(leg.climb, 1) + 0.0:>+5.1f} "
    if p is None:
        return *lengths, f"{way:<6} ", "", ""
    hover = _prediction(p.hover_time, p.hover_energy, chosen=p.leg_mode == LegMode.HOVER)
    return (
        *lengths,
        f"{way:<6} ",
        hover,
        _prediction(p.forward_time, p.forward_energy, chosen=p.leg_mode == LegMode.FORWARD),
    )


def _prediction(time: float, energy: float, *, chosen: bool) -> str:
    if not (math.isfinite(time) and math.isfinite(energy)):
        return "  --"
    return f"{time:>3.0f} {_joules(energy):>4}{'*' if chosen else ' '}"


def _joules(energy: float) -> str:
    """Number and prefix: "950", "9.1k", "12k"."""
    if energy < 999.5:
        return f"{energy:.0f}"
    return f"{energy / 1000.0:.1f}k" if energy < 9950.0 else f"{energy / 1000.0:.0f}k"
