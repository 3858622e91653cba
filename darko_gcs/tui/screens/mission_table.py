"""The table of the mission screen, figures and warnings of the whole plan, and its differences from another plan."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical, VerticalScroll
from textual.widgets import Label, Static

from darko_gcs.state.fence_edits import area_count
from darko_gcs.state.fence_shapes import LegDangers
from darko_gcs.state.flown_legs import flown_words, is_last_flight
from darko_gcs.state.mission_items import FRAME_LABELS, field_text, mission_command_of, place_of
from darko_gcs.state.mission_legs import LOW_LEG, TAKE_OFFS, MissionLeg, low_words
from darko_gcs.state.plan_difference import change_text, plan_changes
from darko_gcs.state.return_goal import LANDINGS
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import command_name, counted, label_of
from darko_gcs.state.values import FlownLeg, Items, LegPrediction, LogLine
from darko_gcs.tui.containment import Dialog
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.limit_editing import limit_cells
from darko_gcs.tui.widgets.row_list import RowTable
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.names import as_member
from protocol.plans import MissionItem, load
from protocol.plans.fence_rally import fence_items, rally_items

NO_PLAN_YET = "no plan: o opens a file, f fetches the vehicle's, i or a click on the map inserts an item"
NO_DANGERS = LegDangers()
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
    dangers: LegDangers = NO_DANGERS,
    low_leg: float = LOW_LEG,
) -> str:
    """Name, size and whereabouts of the plan, its legs, and what is worth a second look.

    Args:
        draft: The plan.
        s: What is known of the vehicle.
        legs: Of the mission.
        predictions: Of the legs that the vehicle has answered for.
        is_live: Whether there may be a vehicle.
        dangers: Legs that must not be flown.
        low_leg: Height above home below which a leg flown forward is low [m].
    """
    if not (draft.plan.items or draft.fence or draft.rally or any(draft.vehicle_plans)):
        return NO_PLAN_YET if is_live else _unrecorded(s)
    state = "not on the vehicle" if draft.changed else "as on the vehicle"
    unsaved = "" if draft.saved or not draft.changed else ", not saved"
    parts = [counted(len(draft.plan.items), "item")]
    parts += [f"fence of {counted(area_count(draft.fence), 'area')}"] if draft.fence else []
    parts += [counted(len(draft.rally), "rally point")] if draft.rally else []
    over = is_last_flight(s) or draft.changed
    totals = leg_totals(legs, predictions, {} if over else s.mission.flown, s.parameters.values.get(BATTERY_ENERGY))
    left_out = left_out_words(draft.plan.items) if "predicted" in totals else ""
    totals = f"{totals} (without {left_out})" if left_out else totals
    name = Path(draft.path).name or ("plan without a file" if draft.changed else "the vehicle's plan")
    warnings = plan_warnings(draft.plan.items, s, predictions, dangers, low_leg)
    flown = "" if draft.changed else flown_words(s)
    when, totals = ("last flight", f"next flight: {totals}") if over and flown and totals else ("flown", totals)
    texts = (f"{name}: {', '.join(parts)}, {state}{unsaved}", totals, f"{when}: {flown}" if flown else "", *warnings)
    return "; ".join(filter(None, texts))


def _unrecorded(s: Snapshot) -> str:
    """Without items in a recording: there is no mission, or nobody sent its items while it was recorded."""
    if not s.mission.total:
        return "no mission in the recording so far"
    return f"the mission's {counted(s.mission.total, 'item')} are not in the recording: only what item it is at"


def plan_warnings(
    items: Items,
    s: Snapshot,
    predictions: Mapping[int, LegPrediction],
    dangers: LegDangers = NO_DANGERS,
    low_leg: float = LOW_LEG,
) -> list[str]:
    """Warnings before the flight: legs through obstacles or out of the fence, low legs, and an end in the air.

    Args:
        items: The mission.
        s: What is known of the vehicle.
        predictions: Of the legs that the vehicle has answered for.
        dangers: Legs that must not be flown.
        low_leg: Height above home below which a leg flown forward is low [m].
    """
    warnings = [*dangers.words, *low_words(items, s, predictions, low_leg)]
    if items and not any(item.command in LAST_COMMANDS for item in items):
        warnings.append("no landing: it hovers at its last item")
    return warnings


WARNING_TIME = 3.0  # between two warnings about one thing [s]


def last_words(lines: Sequence[LogLine]) -> list[str]:
    """The newest line; before it the warning that came just before, if it is one itself: one of the two has the why."""
    if not lines:
        return []
    *earlier, last = lines[-2:]
    is_pair = all(line.severity <= mavlink.MAV_SEVERITY_WARNING for line in lines[-2:])
    return [line.text for line in earlier if is_pair and last.time - line.time < WARNING_TIME] + [last.text]


BATTERY_ENERGY = "SIM_BAT_ENERGY"  # parameter of the vehicle: energy of a full battery [J]
WAITS = {
    mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT,
}  # fmt: skip
DELAYS = {mavlink.MAV_CMD_NAV_WAYPOINT, mavlink.MAV_CMD_NAV_DELAY}  # with a time as their first parameter


def left_out_words(items: Items) -> str:
    """Parts of a mission that no leg is: "take-off, loiter, landing"; empty without any."""
    commands = {item.command for item in items}
    parts = {
        "take-off": commands & TAKE_OFFS,
        "loiter": commands & WAITS,
        "waits": [item for item in items if item.command in DELAYS and item.params[0] > 0.0],
        "landing": commands & (LANDINGS | {mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH}),
    }
    return ", ".join(name for name, found in parts.items() if found)


def leg_totals(
    legs: Sequence[MissionLeg],
    predictions: Mapping[int, LegPrediction],
    flown: Mapping[int, FlownLeg],
    battery: float | None = None,
) -> str:
    """All legs together: "legs 412 m, predicted 96 s, 9.1 kJ, 9 % of the battery"; without what is no leg.

    A leg that is flown counts as it was predicted when it began, as in its row.

    Args:
        legs: Of the mission.
        predictions: Of the legs that the vehicle has answered for.
        flown: Legs of the present flight.
        battery: Energy of a full one [J]; None where the vehicle does not tell it.
    """
    legs = [leg for leg in legs if not leg.is_take_off]
    if not legs:
        return ""
    text = f"legs {sum(_extent(leg, flown.get(leg.seq))[0] for leg in legs):.0f} m"
    begun = {seq: (leg.predicted_time, leg.predicted_energy) for seq, leg in flown.items()}
    told = {seq: prediction.chosen for seq, prediction in predictions.items()} | begun
    known = [told[leg.seq] for leg in legs if leg.seq in told]
    if not known:
        return text
    time, energy = sum(time for time, _ in known), sum(energy for _, energy in known)
    if not math.isfinite(time):
        return f"{text}, NOT POSSIBLE as asked"
    part = "" if len(known) == len(legs) else f" for {len(known)} of {len(legs)}"
    share = f", {100.0 * energy / battery:.0f} % of the battery" if battery is not None and battery > 0.0 else ""
    return f"{text}, predicted {time:.0f} s, {energy / 1000.0:.1f} kJ{share}{part}"


COLUMNS = ("", " #", "item", "  north", "   east", " alt", " leg", "climb", "by", "hover s J", "cruise s J")
FLOWN_COLUMNS = (*COLUMNS[:-2], "predicted", "flown s J")  # once a leg is flown
LAST_COLUMNS = (*COLUMNS[:-2], "last pred", "last s J")  # of the flight before, once the vehicle stands again
LIMIT_COLUMNS = ("", " #", "fence", "  north", "   east")
RALLY_COLUMNS = ("", " #", "point", "  north", "   east", "  height")
LEG_MODE_LABELS = {LegMode.NONE: "auto", LegMode.HOVER: "hover", LegMode.FORWARD: "cruise"}
NEXT_LEG_MODES = {0.0: "then auto", 3.0: "then hover", 4.0: "then cruise"}  # by the MAV_VTOL_STATE of a transition
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
        super().__init__(_headed(COLUMNS), id=id, padding=0)

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
        flown = s.mission.flown if is_on_vehicle and any(leg.is_over for leg in s.mission.flown.values()) else {}
        is_last = is_last_flight(s)
        self.use_names(_headed((LAST_COLUMNS if is_last else FLOWN_COLUMNS) if flown else COLUMNS))
        times = (_last_cells if is_last else _flown_cells) if flown else _prediction_cells
        progress = [_mark(s, seq) if is_on_vehicle else " " for seq in range(len(items))]
        self.show_rows(
            {
                str(seq): (
                    progress[seq],
                    *_item_cells(seq, item, legs.get(seq), s),
                    *_leg_cells(legs.get(seq), None if is_last else flown.get(seq)),
                    *times(predictions.get(seq), flown.get(seq)),
                )
                for seq, item in enumerate(items)
            }
        )

    def show_limits(self, items: Items, s: Snapshot, *, is_rally: bool) -> None:
        """The same for a fence or rally points."""
        home, home_p = s.position.home, s.position.home_p
        columns = RALLY_COLUMNS if is_rally else LIMIT_COLUMNS
        self.use_names(_headed(columns))
        rows = (("", *limit_cells(items, seq, item, home, home_p)) for seq, item in enumerate(items))
        self.show_rows({str(seq): row[: len(columns)] for seq, row in enumerate(rows)})


def _headed(columns: Sequence[str]) -> list[str]:
    return [f"{name} " for name in columns]


def item_label(item: MissionItem, leg: MissionLeg | None = None) -> str:
    """Action of an item, in few words: "waypoint 2 s", "then cruise", "loiter 30 s"; of a return, where it leads."""
    if leg is not None and leg.goal:
        return f"to {leg.goal}"[:MAX_LABEL]
    first, second = item.params[:2]
    name = SHORT_NAMES.get(item.command) or command_name(item.command).removeprefix("nav ").removeprefix("do ")
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
        name = NEXT_LEG_MODES.get(first, name)
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
    active = s.mission.state in {mavlink.MISSION_STATE_ACTIVE, mavlink.MISSION_STATE_PAUSED}
    return "▶" if active and seq == s.mission.current else "✓" if seq in s.mission.reached else " "


def _item_cells(seq: int, item: MissionItem, leg: MissionLeg | None, s: Snapshot) -> tuple[str, ...]:
    north = east = height = ""
    if mission_command_of(item).has_place:
        place = None if s.position.home is None else place_of(item, s.position.home, s.position.home_p)
        if place is not None:
            north, east = (
                f"{round(part - home, 1) + 0.0:.1f}" for part, home in zip(place, s.position.home_p[:2], strict=False)
            )
        height = "-" if math.isnan(item.z) else f"{round(item.z, 1) + 0.0:.1f}"
        height += f" {FRAME_LABELS.get(item.frame, item.frame)}"
    return f"{seq:>2} ", f"{item_label(item, leg)} ", f"{north:>7} ", f"{east:>7} ", f"{height:>8} "


def _extent(leg: MissionLeg, flown: FlownLeg | None) -> tuple[float, float]:
    """Length and climb of a leg [m], from where the vehicle was as it began, or from where it would begin now."""
    if flown is None or not math.isfinite(flown.distance):
        return leg.distance, leg.climb
    return flown.distance, flown.climb


def _leg_cells(leg: MissionLeg | None, flown: FlownLeg | None) -> tuple[str, str, str]:
    if leg is None:
        return ("",) * 3
    mode = "" if leg.is_take_off else LEG_MODE_LABELS[leg.asked]
    distance, climb = _extent(leg, flown)
    return f"{distance:>4.0f} ", f"{round(climb, 1) + 0.0:>+5.1f} ", f"{mode:<6} "


def _prediction_cells(p: LegPrediction | None, _leg: FlownLeg | None) -> tuple[str, str]:
    """Both ways of flying a leg, with a mark on the one that would be chosen."""
    if p is None:
        return "", ""
    return (
        _prediction(p.hover_time, p.hover_energy, chosen=p.leg_mode == LegMode.HOVER),
        _prediction(p.forward_time, p.forward_energy, chosen=p.leg_mode == LegMode.FORWARD),
    )


def _flown_cells(p: LegPrediction | None, leg: FlownLeg | None) -> tuple[str, str]:
    """The prediction as the leg began, or of one to come, and then its time and energy."""
    if leg is None:
        return "" if p is None else _prediction(*p.chosen, chosen=False), ""
    predicted = _prediction(leg.predicted_time, leg.predicted_energy, chosen=False)
    return predicted, _prediction(leg.time, leg.energy, chosen=False) if leg.is_over else "  ..."


def _last_cells(_prediction_of_next: LegPrediction | None, leg: FlownLeg | None) -> tuple[str, str]:
    """Both of a leg of the flight before; nothing of one that was not flown to its end."""
    return _flown_cells(None, leg) if leg is not None and leg.is_over else ("", "")


def _prediction(time: float, energy: float, *, chosen: bool) -> str:
    if not (math.isfinite(time) and math.isfinite(energy)):
        return "  --"
    return f"{time:>3.0f} {_joules(energy):>4}{'*' if chosen else ' '}"


def _joules(energy: float) -> str:
    """Number and prefix: "950", "9.1k", "12k"."""
    if energy < 999.5:
        return f"{energy:.0f}"
    return f"{energy / 1000.0:.1f}k" if energy < 9950.0 else f"{energy / 1000.0:.0f}k"


def return_words(leg: MissionLeg | None) -> str:
    """The end of a return that does not lead home: "lands at rally 0, 42 m from here"; else empty."""
    if leg is None or not leg.goal:
        return ""
    lands = "flies the landing from" if leg.goal.startswith("item") else "lands at"
    return f"{lands} {leg.goal}, {leg.distance:.0f} m away"


def choice_text(prediction: LegPrediction) -> str:
    """The vehicle's choice for a leg, and its reason: "cruise: less energy"."""
    mode = as_member(LegMode, prediction.leg_mode)
    name = "leg" if mode is None else LEG_MODE_LABELS[mode]
    return f"{name}: {label_of(DecisionReason, prediction.reason)}"


def whole_parts(parts: Sequence[str], width: int) -> str:
    """Texts beside each other, the last ones left out as a whole where there is no room [cells]."""
    shown = [part for part in parts if part]
    while len(shown) > 1 and len("  ".join(shown)) > width:
        shown.pop()
    return "  ".join(shown)


def flown_leg_words(s: Snapshot, row: int) -> str:
    """The leg to an item as it was flown: "flown 12.1 s, 640 J (predicted 11.8 s, 610 J)"; empty until then."""
    leg = s.mission.flown.get(row)
    if leg is None or not leg.is_over:
        return ""
    energy = f", {leg.energy:.0f} J" if math.isfinite(leg.energy) else ""
    when = "last flight" if is_last_flight(s) else "flown"
    return f"{when} {leg.time:.1f} s{energy} (predicted {leg.predicted_time:.1f} s, {leg.predicted_energy:.0f} J)"


PlanPair = tuple[str, Items, Items]  # what is compared, in words; the old plan, the new one


class DifferenceScreen(Dialog[None]):
    """Changed (~), added (+) and removed (-) items; the arrows and page keys scroll.

    Args:
        pairs: Plans to compare.
    """

    BINDINGS: ClassVar[list[BindingType]] = [Binding("escape,equals_sign,q", "dismiss", "Close")]

    def __init__(self, pairs: Sequence[PlanPair]) -> None:
        super().__init__()
        self._pairs = pairs

    def compose(self) -> ComposeResult:
        """A section for each pair."""
        lines: list[str] = []
        for title, old, new in self._pairs:
            changes = plan_changes(old, new)
            lines += [title, *(f"  {change_text(change)}" for change in changes)]
            lines += [] if changes else ["  the same"]
            lines.append("")
        with Vertical(classes="dialog help"):
            yield Label("Differences: ~ changed, + added, - removed", id="question", markup=False)
            with VerticalScroll():
                yield Static("\n".join(lines), markup=False)
            yield Static("Up/Down/PgUp/PgDn: scroll    Esc: close", classes="hint")

    def on_mount(self) -> None:
        """Let the keys scroll."""
        self.query_one(VerticalScroll).focus()


def file_pairs(path: str, own: tuple[Items, Items, Items]) -> list[PlanPair]:
    """Pairs to compare: a file's mission, fence and rally points with those of the plan that is edited.

    Raises:
        FileError: The file cannot be read; the message names it.
    """
    plan = load(Path(path).expanduser())
    held, names = (plan.items, fence_items(plan), rally_items(plan)), ("", ", fence", ", rally points")
    return [
        (f"From the file {path}{name} to this plan", old, new)
        for name, old, new in zip(names, held, own, strict=True)
        if old or new
    ]
