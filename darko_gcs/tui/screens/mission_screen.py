"""The mission: a table and a map of its items, edited, compared with vehicle and file, sent, and followed."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.message import Message
from textual.reactive import reactive
from textual.widgets import DataTable, Static

from darko_gcs.state.fence_edits import limit_label
from darko_gcs.state.fence_shapes import WARNINGS, LegDangers, fence_breaches, leg_dangers, obedience_words
from darko_gcs.state.mission_items import coordinate_texts, height_text, item_summary, mission_command_of
from darko_gcs.state.mission_legs import (
    FLOWN_MISSION,
    MissionLeg,
    known_predictions,
    leg_chains,
    mission_legs,
)
from darko_gcs.state.plan_difference import changed_range, item_now
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.values import ALL_PLANS, FENCE, MISSION, PLAN_TYPES, RALLY, Items, LegPrediction
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import armed_first, must_arm, start_question, why_unreachable
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.map_content import EditedMission
from darko_gcs.tui.map_panel import MovableMap
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.dialogs import AskScreen, ChooseScreen, FileDialog, FormField, Named, confirm
from darko_gcs.tui.screens.limit_editing import LimitEditing
from darko_gcs.tui.screens.mission_editing import MissionEditing
from darko_gcs.tui.screens.mission_table import (
    DifferenceScreen,
    MissionTable,
    PlanPair,
    choice_text,
    file_pairs,
    flown_leg_words,
    last_words,
    plan_status,
    return_words,
    whole_parts,
)
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.errors import FileError, LocalProtocolError
from protocol.plans import load, save
from protocol.ranges import finite

PARTS_OF_ACTIONS = {  # parts of the plan that some keys are for: actions, and edits by their names
    "leg_mode": {MISSION}, "turn": {FENCE}, "move": {MISSION}, "duplicate": {MISSION}, "heights": {MISSION},
    "survey": {MISSION}, "start": {MISSION}, "fly_from": {MISSION}, "set_current": {MISSION},
}  # fmt: skip
NOT_IN_A_REPLAY = frozenset({"edit_plan", "upload", "start", "fly_from", "fetch", "set_current", "clear"})

OTHER_PART = "To the map; there, back to the table"
MISSION_KEYS: list[BindingType] = [
    Binding("tab", "other_part", "Map", tooltip=OTHER_PART),
    Binding("e,enter", "edit_plan('edit')", "Edit", priority=True, key_display="e", tooltip="Edit the item"),
    Binding("i", "edit_plan('insert', 1)", "Ins", tooltip="Insert an item below; into the fence, an area"),
    Binding("x,delete", "edit_plan('remove')", "Del", key_display="x", tooltip="Remove the item"),
    Binding("u", "upload", "Upload", tooltip="Send the plan to the vehicle, and read it back"),
    Binding("s", "start", "Run", tooltip="Fly the mission from its first item, or resume it"),
    Binding("o", "open", "Open", tooltip="Open a plan file"),
    Binding("m,escape", "close", "Back", tooltip="Back to the flight; Esc, too"),
    Binding("question_mark", "app.act('help')", "Help", key_display="?", tooltip="These keys"),
    Binding("w", "save", "Save", tooltip="Write the plan to a file"),
    Binding(
        "space",
        "edit_plan('leg_mode')",
        "Leg mode",
        tooltip="Fly the leg in hover, in cruise (forward flight), or let the vehicle choose",
    ),
    Binding(
        "space",
        "edit_plan('turn')",
        "In/out",
        id="mission.leg-mode",
        tooltip="Stay out of the area instead of inside it, or the other way round",
    ),
    Binding("z,ctrl+z", "edit_plan('undo')", "Undo", key_display="z", tooltip="Undo the last edit"),
    Binding("equals_sign", "compare", "Differ", key_display="=", tooltip="What differs from vehicle and file"),
    Binding("f", "fetch", "Fetch", tooltip="Fetch the vehicle's plans"),
    Binding("G", "other_plan(1)", "Fence", id="mission.fence", tooltip="Edit the fence; again: rally points, mission"),
    Binding("G", "other_plan(2)", "Rally", id="mission.fence", tooltip="Edit the rally points, after the fence"),
    Binding("G", "other_plan(0)", "Mission", id="mission.fence", tooltip="Edit the mission again"),
    Binding("N", "edit_plan('survey')", "Survey", show=False, tooltip="Put in a survey: lines over an area"),
    Binding("R", "edit_plan('heights')", "Heights", show=False, tooltip="Give all items one height, but landings"),
    Binding("L", "low_leg", "Low legs", show=False, tooltip="Choose the height below which a leg is called low"),
    Binding("S", "fly_from", "Run from", show=False, tooltip="Fly the mission from the item"),
    Binding("j", "set_current", "Jump", show=False, tooltip="Continue the running mission at this item"),
    Binding("c", "clear", "Clear", show=False, tooltip="Delete a plan on the vehicle"),
    Binding("I", "edit_plan('insert', 0)", "Insert above", show=False, tooltip="Insert an item above"),
    Binding("D", "edit_plan('duplicate')", "Duplicate", show=False, tooltip="Duplicate the item"),
    Binding("Z,ctrl+y", "edit_plan('redo')", "Redo", show=False, tooltip="Redo the last undone edit"),
    Binding("shift+up", "edit_plan('move', -1)", "Move up", show=False, tooltip="Move the item up"),
    Binding("shift+down", "edit_plan('move', 1)", "Move down", show=False, tooltip="Move the item down"),
    Binding(
        "less_than_sign", "edit_plan('step', -1)", "Finer", show=False, key_display="<", tooltip="Map: smaller steps"
    ),
    Binding(
        "greater_than_sign", "edit_plan('step', 1)", "Wider", show=False, key_display=">", tooltip="Map: larger steps"
    ),
]


Clock = Callable[[], float]


def ask_start(app: App[Any], question: str, station: Station, clock: Clock, *, arm: bool) -> None:
    """Begin the mission, or go on with it: the same as on the flight screen."""
    confirm(app, question, lambda: station.plans.start_mission(clock(), arm=arm))


def ask_fly_from(app: App[Any], named: Named, s: Snapshot, station: Station, clock: Clock, row: int) -> None:
    """Fly the mission from an item, also if it is not flown now."""
    left = f" This interrupts item {s.mission.current}." if s.mission.state == mavlink.MISSION_STATE_ACTIVE else ""
    which = {1: "Item 0 is", 2: "Items 0 and 1 are"}.get(row, f"Items 0 to {row - 1} are")
    skipped = f" {which} skipped." if row else ""
    question, arm = named(f"{armed_first(s, f'Fly the mission from item {row}?')}{skipped}{left}"), must_arm(s)
    confirm(app, question, lambda: station.plans.start_mission(clock(), first=row, arm=arm))


def ask_continue_at(app: App[Any], named: Named, station: Station, clock: Clock, row: int) -> None:
    """Continue the mission at an item."""
    question = named(f"Continue the mission at item {row}?")
    confirm(app, question, lambda: station.plans.set_current(row, clock()))


CLEAR_CHOICES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally points", ALL_PLANS: "All three"}
PLAN_SUFFIXES = (".plan", ".waypoints", ".txt")
MAX_FILES_LISTED = 50  # of the working folder, in the dialog that opens a file
PART_TITLES = {MISSION: "Mission", FENCE: "Fence", RALLY: "Rally points"}
IN_THE_AIR = "The vehicle is in the air. Send it this plan?"
MAX_LOW_LEG = 1000.0  # that can be chosen [m]
ASK_PERIOD = 1.0  # between looks at which legs the vehicle is to predict [s]


class LowLegChosen(Message):
    """The height was chosen below which a leg flown forward is low [m]."""

    def __init__(self, height: float) -> None:
        super().__init__()
        self.height = height


class MissionMap(MovableMap):
    """The map beside the table, or instead of it."""

    BINDINGS: ClassVar[list[BindingType]] = [Binding("tab", "screen.other_part", "Table", tooltip=OTHER_PART)]


class MissionScreen(StationScreen[None]):
    """One plan, edited here and sent as a whole."""

    HORIZONTAL_BREAKPOINTS = [(0, "-single"), (110, "-beside")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    BINDINGS: ClassVar[list[BindingType]] = named_keys("mission", MISSION_KEYS)
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(
        self, station: Station | None, clock: Callable[[], float], draft: PlanDraft, named: Named = str
    ) -> None:
        super().__init__()
        self.draft, self._part = draft, MISSION
        self._edits: dict[int, MissionEditing | LimitEditing] = {
            MISSION: MissionEditing(self), FENCE: LimitEditing(self, FENCE), RALLY: LimitEditing(self, RALLY)
        }  # fmt: skip
        self.low_leg = draft.low_leg  # height below which a leg flown forward is low [m]
        self._dangers = LegDangers()
        self.fleet: tuple[Snapshot, ...] = ()  # all vehicles on the link
        self._station, self._clock, self._named = station, clock, named
        self._is_ready = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted
        self._on_map = EditedMission()
        self._legs: tuple[MissionLeg, ...] = ()
        self._predictions: dict[int, LegPrediction] = {}
        self._asked_at = -ASK_PERIOD

    def compose(self) -> ComposeResult:
        """Status bar, table and map, the item, notice, status, footer."""
        yield StatusBar().data_bind(MissionScreen.snapshot, MissionScreen.now)
        with Container(id="mission-parts"):
            yield MissionTable(id="items")
            mission_map = MissionMap("Mission", self._on_map, id="mission-map")
            yield mission_map.data_bind(MissionScreen.snapshot, MissionScreen.now)
        yield Static("", id="mission-item", markup=False)
        yield Static("", id="mission-notice", markup=False)
        yield Static("", id="mission-status", markup=False)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Fill table and map."""
        self._is_ready = True
        self.table.focus()
        self.show_draft()
        self._follow(EMPTY_SNAPSHOT, self.snapshot)

    @property
    def _editing(self) -> MissionEditing | LimitEditing:
        return self._edits[self._part]

    @property
    def shown_items(self) -> Items:
        """Items of the part that is edited: mission, fence or rally points."""
        return {MISSION: self.draft.plan.items, FENCE: self.draft.fence, RALLY: self.draft.rally}[self._part]

    @property
    def table(self) -> MissionTable:
        """The table of items."""
        return self.query_one("#items", MissionTable)

    @property
    def map(self) -> MovableMap:
        """The map of items."""
        return self.query_one("#mission-map", MovableMap)

    # The vehicle

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle: its plans, its progress, transfers, predictions."""
        if self._is_ready and self.query("#mission-map"):  # as the station ends, its widgets go first
            self.map.fleet = self.fleet
            self._follow(old, s)

    def _follow(self, old: Snapshot, s: Snapshot) -> None:
        draft = self.draft
        vehicle_plans = (s.plans.mission, s.plans.fence, s.plans.rally)
        if vehicle_plans != draft.vehicle_plans and s.identity.source is not None:
            draft.vehicle_plans = vehicle_plans
            draft.changed = draft.changed and not draft.is_on_vehicle(s)  # false after an accepted upload
            if not draft.changed:
                self._show_vehicle_plan(s)
        progress = (s.mission.current, s.mission.reached, s.mission.state, s.position.home, s.position.home_p)
        before = (old.mission.current, old.mission.reached, old.mission.state, old.position.home, old.position.home_p)
        told = (s.mission.leg_predictions, s.mission.flown), (old.mission.leg_predictions, old.mission.flown)
        if progress != before or any(new is not before for new, before in zip(*told, strict=True)):
            self._show_items()
        if s.log.lines and s.log.lines is not old.log.lines:
            self._show_status()

    def watch_now(self) -> None:
        """Ask about the legs from time to time: the wind changes, and the vehicle is elsewhere."""
        if self._is_ready and self.now - self._asked_at >= ASK_PERIOD:
            self._show_items()

    def _show_vehicle_plan(self, s: Snapshot) -> None:
        row = self.table.cursor_row
        try:
            self.draft.follow_vehicle(s)
        except LocalProtocolError as error:
            self.show_notice(f"The vehicle's fence or rally points cannot be saved: {error}")
        self.show_draft(row)
        self.map.fit_plan()

    @property
    def _planned(self) -> Snapshot:
        """The vehicle with fence and rally points of the plan."""
        plans, draft = self.snapshot.plans, self.draft
        return self.snapshot._replace(
            plans=plans._replace(fence=draft.fence or plans.fence, rally=draft.rally or plans.rally)
        )

    def _ask_about_legs(self) -> None:
        self._asked_at = self.now
        self._legs = mission_legs(self.draft.plan.items, self._planned, self.draft.begins_at)
        chains = leg_chains(self._legs)
        if self._station is not None and self.snapshot.is_darko and not self.snapshot.link.lost:
            self._station.predict_legs([chain for _, chain in chains], self._clock())
        self._predictions = known_predictions(self._legs, self.snapshot)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """A recording's mission can be looked at, compared and saved; some keys belong to one part of the plan."""
        if action == "other_plan" and parameters != (self._next_part,):
            return False
        name = str(parameters[0]) if action == "edit_plan" and parameters else action
        parts = PARTS_OF_ACTIONS.get(name, PLAN_TYPES)
        is_offered = self._part in parts and (self._station is not None or action not in NOT_IN_A_REPLAY)
        return is_offered and super().check_action(action, parameters)

    # What is shown

    def show_draft(self, row: int = 0) -> None:
        """Show the draft after a change, with the cursor on a row."""
        self._show_items()
        self.table.choose_row(row)
        self.map.chosen = self.table.cursor_row
        self._show_status()

    def _show_items(self) -> None:
        self._ask_about_legs()
        draft, s = self.draft, self.snapshot
        legs = {leg.seq: leg for leg in self._legs}
        held = not draft.changed
        if self._part == MISSION:
            self.table.show(draft.plan.items, s, legs, self._predictions, is_on_vehicle=held)
        else:
            self.table.show_limits(self.shown_items, s, is_rally=self._part == RALLY)
        self._dangers = leg_dangers(self._planned, self._legs, self.map.overlay.overlay)
        warned = (self._dangers.warned, self.low_leg)
        plans = (draft.plan.items, draft.fence, draft.rally)
        if self._on_map.show(plans, self._part, warned, is_on_vehicle=held):
            self.map.redraw()
        self.show_item()
        self._show_status()

    def show_notice(self, text: str) -> None:
        """Show a text below the table; "" clears it."""
        self.query_one("#mission-notice", Static).update(text)

    def show_item(self) -> None:
        """The item under the cursor: parameters, place, and why its leg is flown as it is."""
        items, row = self.shown_items, self.table.cursor_row
        if row >= len(items):
            self.query_one("#mission-item", Static).update("")
            return
        if self._part != MISSION:
            text = (
                f"{PART_TITLES[self._part]}: {row} {limit_label(items, row)}  {' '.join(coordinate_texts(items[row]))}"
            )
            self.query_one("#mission-item", Static).update(text)
            return
        item, prediction = items[row], self._predictions.get(row)
        kind = mission_command_of(item)
        place = " ".join(coordinate_texts(item)) if kind.has_place else ""
        why = "" if prediction is None else choice_text(prediction)
        flown = "" if self.draft.changed else flown_leg_words(self.snapshot, row)
        height = height_text(item) if kind.has_place else ""
        goal = return_words(next((leg for leg in self._legs if leg.seq == row), None))
        parts = (f"{row} {'Return' if goal else kind.label}", goal, flown, item_summary(item), height, why, place)
        shown = self.query_one("#mission-item", Static)
        shown.update(whole_parts(parts, self.size.width - 2))

    def _show_status(self) -> None:
        is_live, shown = self._station is not None, self.query_one("#mission-status", Static)
        text = plan_status(
            self.draft,
            self.snapshot,
            self._legs,
            self._predictions,
            is_live=is_live,
            dangers=self._dangers,
            low_leg=self.low_leg,
        )
        lines = [text, *last_words(self.snapshot.log.lines)]
        shown.set_class(any(warning in text for warning in WARNINGS), "-warned")
        shown.update("\n".join(lines))

    # Edits

    def action_edit_plan(self, edit: str, *arguments: int) -> None:
        """Make an edit, by its name in ``MissionEditing``."""
        getattr(self._editing, edit)(*arguments)

    @on(MovableMap.PointChosen)
    def _item_chosen(self, event: MovableMap.PointChosen) -> None:
        self.table.choose_row(event.number)

    @on(DataTable.RowHighlighted, "#items")
    def _row_chosen(self) -> None:
        self.map.chosen = self.table.cursor_row
        self.show_item()

    @on(MovableMap.PointMoved)
    def _shift_item(self, event: MovableMap.PointMoved) -> None:
        self._editing.shift(event.number, event.by)

    @on(MovableMap.PlacePressed)
    def _add_waypoint(self, event: MovableMap.PlacePressed) -> None:
        self._editing.add_waypoint(event.place)

    # Keys

    def action_close(self) -> None:
        """Back to the flight; an unsent plan stays for the next time."""
        if self.draft.is_at_risk:
            self.app.notify("The plan is not on the vehicle. Press m to see it again", severity="warning")
        self.dismiss(None)

    @property
    def _next_part(self) -> int:
        """Part of the plan that is edited after this one."""
        return PLAN_TYPES[(PLAN_TYPES.index(self._part) + 1) % len(PLAN_TYPES)]

    def action_other_plan(self, part: int) -> None:
        """Edit another part of the plan, a MAV_MISSION_TYPE."""
        self._part = part
        self.refresh_bindings()
        self.map.border_title = PART_TITLES[self._part]
        self.show_draft()
        hints = {
            MISSION: "",
            FENCE: "Fence: i puts an area in, a click chooses a corner or adds one, Space: in or out",
        }
        self.show_notice(hints.get(self._part, "Rally points: a click or i puts one in, e edits its place and height"))

    def action_low_leg(self) -> None:
        """Ask for the height below which a leg flown forward is called low."""

        def check(values: tuple[str, ...]) -> str | None:
            self.post_message(LowLegChosen(float(values[0])))
            return None

        help_text = "Legs flown forward below it get a warning; 0: none"
        fields = [FormField("Height above home [m]", f"{self.low_leg:g}", help_text)]
        ranges = [finite("height", 0.0, MAX_LOW_LEG, "m", default=False)]
        self.app.push_screen(AskScreen("Legs flown forward below this are low", fields, check, ranges=ranges))

    @on(LowLegChosen)
    def _take_low_leg(self, event: LowLegChosen) -> None:
        self.low_leg = self.draft.low_leg = event.height
        self._show_items()

    def action_other_part(self) -> None:
        """From the table to the map, and back; a small terminal shows one of them at a time."""
        to_map = not self.map.has_focus
        self.set_class(to_map, "-map")
        (self.map if to_map else self.table).focus()

    def action_open(self) -> None:
        """Ask for a file and load it."""
        found = sorted(str(path) for suffix in ("*.plan", "*.waypoints") for path in Path().rglob(suffix))
        recent = self.draft.recent.paths
        first = self.draft.path or next(iter((*found, *recent)), "")
        known = (*recent, *found[:MAX_FILES_LISTED])

        def ask() -> None:
            self.show_notice("")
            title = "Open a plan (.plan or QGC WPL 110)"
            self.app.push_screen(FileDialog(title, first, known=known, suffixes=PLAN_SUFFIXES, check=self._open))

        self._confirm_loss(ask)

    def _open(self, path: str) -> str | None:
        try:
            self.draft.take(load(Path(path).expanduser()), path)
        except FileError as error:
            return str(error)
        self.draft.recent.add(path)
        self.show_draft()
        self.map.fit_plan()
        return None

    def action_save(self) -> None:
        """Ask for a file and save the plan."""
        self.show_notice("")
        first, known = self.draft.path or "mission.plan", self.draft.recent.paths
        title = "Save the plan (.plan or .waypoints)"
        self.app.push_screen(FileDialog(title, first, known=known, suffixes=PLAN_SUFFIXES, check=self._save))

    def _save(self, path: str) -> str | None:
        try:
            save(self.draft.to_save(self.snapshot), Path(path).expanduser())
        except FileError as error:
            return str(error)
        self.draft.path, self.draft.saved = path, True
        self.draft.recent.add(path)
        self.show_notice(f"Saved {path}")
        self._show_status()
        return None

    def action_compare(self) -> None:
        """Show what differs between this plan and the vehicle's, and between this plan and its file."""
        draft, s = self.draft, self.snapshot
        pairs: list[PlanPair] = []
        if s.identity.source is not None:
            pairs.append(("From the vehicle's mission to this plan", s.plans.mission, draft.plan.items))
            limits = (("fence", s.plans.fence, draft.fence), ("rally points", s.plans.rally, draft.rally))
            pairs += [
                (f"From the vehicle's {name} to this plan's", old, new) for name, old, new in limits if old or new
            ]
        try:
            pairs += file_pairs(draft.path, (draft.plan.items, draft.fence, draft.rally)) if draft.path else []
        except FileError as error:
            self.show_notice(str(error))
        if pairs:
            self.app.push_screen(DifferenceScreen(pairs))
        elif not draft.path:
            self.show_notice("There is nothing to compare with: no vehicle, no file")

    def action_upload(self) -> None:
        """Send the plan to the vehicle, and read it back; of a mission that is being flown, only what is changed."""
        station, s = self._vehicle(), self.snapshot
        if station is None:
            return
        items, current, is_flown = self.draft.plan.items, None, s.mission.state == mavlink.MISSION_STATE_ACTIVE
        if not (items or self.draft.fence or self.draft.rally or any(self.draft.vehicle_plans)):
            self.show_notice("There is no plan to send")
            return
        if is_flown and not self.draft.changed:
            self.show_notice("The vehicle has this plan already: nothing was sent")
            return
        changed = None
        if s.mission.state in FLOWN_MISSION and s.mission.current is not None:
            current = item_now(s.plans.mission, items, s.mission.current)
            changed = changed_range(s.plans.mission, items) if self.draft.changes_single_items_of(s) else None
        limits, has_fence, has_rally = self.draft.limit_names, bool(self.draft.fence), bool(self.draft.rally)
        obeyed = obedience_words(s, has_fence=has_fence, has_rally=has_rally)
        question = "A mission is being flown. Replace it?" if is_flown else IN_THE_AIR
        question += obeyed
        send = partial(self._upload, station, items, current)
        if self.draft.leaves_mission(s) and limits:
            question = f"Send {limits}?{obeyed}"
            send = partial(self._upload, station, None)
        elif changed is not None:
            which = f"item {changed.start}" if len(changed) == 1 else f"items {changed.start} to {changed.stop - 1}"
            turn = " The vehicle turns there at once." if is_flown and s.mission.current in changed else ""
            question = f"Change {which} of the mission that {'is being flown' if is_flown else 'waits'}?{turn}"
            send = partial(self._replace_items, station, changed)
        if is_flown or (s.status.armed and s.status.is_airborne):
            question = " ".join((question, *(f"{words}." for words in fence_breaches(self._planned))))
            confirm(self.app, self._named(question), send)
        else:
            send()

    def _upload(self, station: Station, items: Items | None, current: int | None = None) -> None:
        draft = self.draft
        draft.changed, draft.vehicle_plans = True, ()  # until the vehicle has it
        limits = {"fence": draft.fence, "rally": draft.rally}
        station.plans.upload(items, self._clock(), **limits, verify=True, current=current)

    def _replace_items(self, station: Station, changed: range) -> None:
        self.draft.changed, self.draft.vehicle_plans = True, ()
        station.plans.replace_items(self.draft.plan.items, changed, self._clock())

    def action_fetch(self) -> None:
        """Replace the plan by the vehicle's."""
        station = self._vehicle()
        if station is not None:
            self._confirm_loss(lambda: self._fetch(station))

    def _fetch(self, station: Station) -> None:
        self.draft.changed, self.draft.vehicle_plans = False, ()
        station.plans.download(self._clock())

    def action_clear(self) -> None:
        """Delete the vehicle's mission, fence, rally points or all three; the table keeps its plan."""
        station = self._vehicle()
        if station is None:
            return

        def chosen(number: int | None) -> None:
            if number is not None:
                self.draft.changed, self.draft.saved = True, False
                station.plans.clear(tuple(CLEAR_CHOICES)[number], self._clock())

        self.show_notice("")
        self.app.push_screen(ChooseScreen(self._named("Delete on the vehicle"), tuple(CLEAR_CHOICES.values())), chosen)

    def action_set_current(self) -> None:
        """Continue the mission at the item under the cursor."""
        station, row = self._flown_from(), self.table.cursor_row
        if station is not None:
            ask_continue_at(self.app, self._named, station, self._clock, row)

    def action_start(self) -> None:
        """Fly the mission: from its first item, or on from its current one."""
        if (station := self._flown_from()) is not None:
            question = start_question(self.snapshot, self.map.overlay.overlay, self.low_leg)
            arm = must_arm(self.snapshot)
            ask_start(self.app, self._named(question), station, self._clock, arm=arm)

    def action_fly_from(self) -> None:
        """Fly the mission from the item under the cursor, also if it is not flown now."""
        if (station := self._flown_from()) is not None:
            ask_fly_from(self.app, self._named, self.snapshot, station, self._clock, self.table.cursor_row)

    # Inside

    def _flown_from(self) -> Station | None:
        """The vehicle, if it has the items of the table."""
        station = self._vehicle()
        if station is not None and self.draft.changed:
            self.show_notice("The vehicle does not have this plan: press u to upload it")
            return None
        return station if self.draft.plan.items else None

    def _confirm_loss(self, then: Callable[[], None]) -> None:
        """Do something that replaces the plan, after asking if the plan would be lost."""
        if self.draft.is_at_risk:
            confirm(self.app, "The plan is neither saved nor on the vehicle. Discard it?", then)
        else:
            then()

    def _vehicle(self) -> Station | None:
        """The vehicle if it can be commanded; else the notice says why not."""
        reason = why_unreachable(self._station, self.snapshot)
        self.show_notice(reason)
        return None if reason else self._station
