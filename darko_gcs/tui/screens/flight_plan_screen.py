"""The flight plan: its blocks as buttons, where it is, its waypoints and variables, and what happened in it.

One rule for what moves, stops or drops the vehicle: it asks first. A key that the plan itself gives a block does not
ask, but has to be pressed twice: the same key does something else on other screens.
"""

from __future__ import annotations

import math
import string
from collections.abc import Callable
from pathlib import Path
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Horizontal, Vertical
from textual.reactive import reactive
from textual.widgets import DataTable, Static

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanButton, PlanPoint, PlanSetting
from darko_gcs.state.number_ranges import LOCAL_PLACE, NUMBER
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.station.station import Station
from darko_gcs.tui.actions import ACTIONS, why_unreachable
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.map_content import LoadedFlightPlan
from darko_gcs.tui.map_panel import MovableMap
from darko_gcs.tui.own_keys import named_keys
from darko_gcs.tui.screens.dialogs import SOUTH_HELP, WEST_HELP, AskScreen, FormField, Named, confirm
from darko_gcs.tui.widgets.plan_panels import PlanBlockList, PlanEventPanel, PlanHeadPanel, key_name
from darko_gcs.tui.widgets.row_list import RowTable
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.errors import ProtocolError
from protocol.flight_plans import load_flight_plan, shipped_plan_names
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import NameMapping, load_name_mapping
from protocol.flight_plans.plan_package import pack_plan
from protocol.frames import Vector


class PlanPointTable(RowTable):
    """Waypoints in metres of the plan's origin; the one under the cursor is the chosen one."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(("waypoint", "E", "N", "up"), id=id)

    @property
    def chosen(self) -> int:
        """Number of the waypoint under the cursor; 0 without one."""
        numbers = list(self.texts)
        return int(numbers[self.cursor_row]) if 0 <= self.cursor_row < len(numbers) else 0

    def choose(self, number: int) -> None:
        """Put the cursor on a waypoint."""
        if str(number) in self.texts:
            self.choose_row(list(self.texts).index(str(number)))

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the waypoints that the plan shows, where they are now."""
        points = () if plan is None else plan.points.values()
        self.show_rows(
            {
                str(p.number): (p.name, *(f"{round(part, 1) + 0.0:.1f}" for part in p.position))
                for p in points
                if p.is_shown
            }
        )


class PlanSettingTable(RowTable):
    """Variables with their limits."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(("variable", "value", "limits"), id=id)

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the variables as they are now."""
        settings = () if plan is None else plan.settings.values()
        self.show_rows(
            {str(s.number): (s.label, f"{s.value:.6g}", f"{limits_text(s)} {s.unit}".strip()) for s in settings}
        )


def limits_text(setting: PlanSetting) -> str:
    """The limits of a variable, "1..5"; empty without any."""
    low, high = ("" if math.isnan(limit) else f"{limit:g}" for limit in (setting.low, setting.high))
    return f"{low}..{high}" if low or high else ""


ANSWER_TIME = 1.0  # of the vehicle to a move of a waypoint [s]
SECOND_PRESS = 2.0  # within which a plan's key is pressed again to act [s]
PLAN_KEYS = (  # that a plan may give its blocks; ctrl with c, i, j, m, p, q and z mean something else to terminals
    *string.ascii_letters, *string.digits, *(f"f{n}" for n in range(1, 13)), *(f"ctrl+{c}" for c in "bdeghklnrstuvwxy")
)  # fmt: skip
FALLBACKS = {action.key: action.name for action in ACTIONS if not action.needs_vehicle}  # of keys no block has


class FlightPlanScreen(StationScreen[None]):
    """One flight plan, flown or not."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    BINDINGS: ClassVar[list[BindingType]] = named_keys(
        "flight_plan",
        [
            *(Binding(key, f"plan_key('{key}')", show=False) for key in PLAN_KEYS),
            Binding("escape", "close", "Back"),
            Binding("tab", "app.focus_next", "Next part", tooltip="Blocks, map, waypoints, variables"),
            Binding("ctrl+f", "fly", "Fly", tooltip="Fly the plan from the block it is in"),
            Binding(
                "shift+up",
                "move(0, 1, 0)",
                "Move",
                show=False,
                tooltip="Move the chosen waypoint (< > change the step)",
            ),
            Binding("shift+down", "move(0, -1, 0)", show=False),
            Binding("shift+right", "move(1, 0, 0)", show=False),
            Binding("shift+left", "move(-1, 0, 0)", show=False),
            Binding("less_than_sign", "step(-1)", show=False),
            Binding("greater_than_sign", "step(1)", show=False),
            Binding("space", "hold", "Hold", tooltip="Leave the plan: stop and hover here"),
            Binding("ctrl+o", "load", "Load", tooltip="Have the vehicle load a plan from a file, on the ground"),
            Binding("f5", "fetch", "Fetch", show=False, tooltip="Fetch the plan from the vehicle again"),
        ],
    )
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, station: Station | None, clock: Callable[[], float], named: Named = str) -> None:
        super().__init__()
        self._station, self._clock, self._named = station, clock, named
        self._is_ready = False  # the app hands out snapshots as soon as a screen is pushed, before it is mounted
        self._first_press: tuple[str, float] = ("", -math.inf)  # of a plan's key, and when
        self._movable = 0  # the waypoint that may be moved without another question
        self._wanted: tuple[int, Vector, float] = (0, (0.0, 0.0, 0.0), 0.0)  # waypoint, place, and when it was asked

    def compose(self) -> ComposeResult:
        """Status bar, head, blocks, map, tables, events, notice, footer."""
        yield StatusBar().data_bind(FlightPlanScreen.snapshot, FlightPlanScreen.now)
        yield PlanHeadPanel("", id="plan-head").data_bind(FlightPlanScreen.snapshot)
        with Container(id="plan-panels"):
            yield PlanBlockList(id="plan-blocks")
            with Vertical(id="plan-right"):
                map_panel = MovableMap("Waypoints", LoadedFlightPlan(), id="plan-map")
                yield map_panel.data_bind(FlightPlanScreen.snapshot, FlightPlanScreen.now)
                with Horizontal(id="plan-tables"):
                    yield PlanPointTable(id="plan-points")
                    yield PlanSettingTable(id="plan-settings")
                yield PlanEventPanel("Events", id="plan-events").data_bind(FlightPlanScreen.snapshot)
        yield Static("", id="plan-notice", markup=False)
        yield KeyFooter()

    def on_mount(self) -> None:
        """Begin with the blocks."""
        self._is_ready = True
        self.blocks.focus()
        self._show()

    @property
    def blocks(self) -> PlanBlockList:
        """The buttons."""
        return self.query_one("#plan-blocks", PlanBlockList)

    @property
    def map(self) -> MovableMap:
        """The map."""
        return self.query_one("#plan-map", MovableMap)

    @property
    def points(self) -> PlanPointTable:
        """The table of waypoints."""
        return self.query_one("#plan-points", PlanPointTable)

    def watch_snapshot(self, old: Snapshot, s: Snapshot) -> None:
        """Follow the vehicle."""
        if self._is_ready and (s.flight_plan is not old.flight_plan or s.log.lines is not old.log.lines):
            self._show()
            if s.log.lines and s.log.lines is not old.log.lines:
                self.show_notice(s.log.lines[-1].text)

    def _show(self) -> None:
        plan = self.snapshot.flight_plan
        self.blocks.show(plan)
        self.points.show(plan)
        self.query_one("#plan-settings", PlanSettingTable).show(plan)
        self.map.chosen = self.points.chosen

    def show_notice(self, text: str) -> None:
        """Show a text above the footer."""
        self.query_one("#plan-notice", Static).update(text)

    # Keys

    def action_close(self) -> None:
        """Back to the flight."""
        self.dismiss(None)

    def action_fetch(self) -> None:
        """Fetch the plan again."""
        if (station := self._vehicle()) is not None:
            station.flight_plan.fetch()

    def action_fly(self) -> None:
        """Fly the plan, after asking."""
        plan, station = self.snapshot.flight_plan, self._vehicle()
        if station is None:
            return
        if plan is None:
            self.show_notice("The vehicle has no flight plan")
            return
        question = f"Fly the flight plan? It continues in block {plan.block_name(plan.block)}."
        confirm(self.app, self._named(question), lambda: station.flight_plan.start(self._clock()))

    def action_load(self) -> None:
        """Ask for a file, and send its plan."""
        station = self._vehicle()
        if station is None:
            return
        found = sorted(str(path) for path in Path().glob("*.xml"))

        def check(values: tuple[str, ...]) -> str | None:
            try:
                plan = load_flight_plan(Path(values[0]).expanduser())
                mapping = load_name_mapping(Path(values[1]).expanduser()) if values[1] else NameMapping()
                check_flown(plan, mapping).require_flown()
            except ProtocolError as error:
                return str(error)
            station.flight_plan.load(pack_plan(plan, mapping), self._clock())
            return None

        fields = [
            FormField(
                "Flight plan (.xml)",
                found[0] if found else "",
                f"Of Paparazzi, or shipped: {', '.join(shipped_plan_names())}",
            ),
            FormField("Names (.toml), if any", "", "What the plan's own names mean on this vehicle; may stay empty"),
        ]
        self.app.push_screen(AskScreen(self._named("Load a flight plan on the vehicle"), fields, check))

    def action_move(self, east: int, north: int, up: int) -> None:
        """Move the chosen waypoint by a step."""
        self.map.action_move(east, north, up)

    def action_step(self, by: int) -> None:
        """Move by smaller or larger steps."""
        self.map.change_step(by)

    def action_hold(self) -> None:
        """Leave the plan and hover, after asking."""
        if (station := self._vehicle()) is not None:
            question = self._named("Stop and hover here? This interrupts the flight plan.")
            confirm(self.app, question, lambda: station.hold(self._clock()))

    def action_plan_key(self, key: str) -> None:
        """Enter the block of a key that is pressed twice; one of no block works as elsewhere if it commands nothing."""
        plan = self.snapshot.flight_plan
        buttons = () if plan is None else plan.blocks.values()
        button = next((button for button in buttons if key_name(button.key) == key), None)
        if button is not None:
            self._press(key, button)
        elif key == "f5":
            self.action_fetch()
        elif key in FALLBACKS:
            self.app.call_later(self.app.run_action, f"act('{FALLBACKS[key]}')")
        else:
            self.show_notice(f"{key}: no block has this key")

    def _press(self, key: str, button: PlanButton) -> None:
        before, self._first_press = self._first_press, (key, self.now)
        if button.locked:
            self.show_notice(f"Block {button.name} is not flown: {button.locked}")
        elif before[0] == key and self.now - before[1] <= SECOND_PRESS:
            self._first_press = ("", -math.inf)
            self._enter(button.number)
        else:
            self.show_notice(f"{key} again: {button.label} (block {button.name})")

    def _enter(self, number: int) -> None:
        if (station := self._vehicle()) is not None:
            station.flight_plan.jump_to_block(number, self._clock())

    # Blocks, waypoints, variables

    @on(PlanBlockList.Chosen)
    def _block_chosen(self, event: PlanBlockList.Chosen) -> None:
        plan = self.snapshot.flight_plan
        button = None if plan is None else plan.blocks.get(event.number)
        if plan is None or button is None or self._vehicle() is None:
            return
        if button.locked:
            self.show_notice(f"Block {button.name} is not flown: {button.locked}")
            return
        left = f" The vehicle leaves {plan.block_name(plan.block)}." if self.snapshot.flies_plan else ""
        confirm(self.app, self._named(f"Enter block {button.name}?{left}"), lambda: self._enter(button.number))

    @on(PlanPointTable.RowHighlighted, "#plan-points")
    def _point_highlighted(self) -> None:
        self.map.chosen = self.points.chosen

    @on(MovableMap.PointChosen)
    def _point_chosen(self, event: MovableMap.PointChosen) -> None:
        self.points.choose(event.number)
        self.map.chosen = event.number

    @on(MovableMap.PointMoved)
    def _point_moved(self, event: MovableMap.PointMoved) -> None:
        """Move it: the first time it is asked, then it follows the keys until another one is moved."""
        plan = self.snapshot.flight_plan
        point = None if plan is None else plan.points.get(event.number)
        if point is None or self._vehicle() is None:
            return
        (north, east, up), (x, y, z) = event.by, self._wanted_place(point)
        place = (x + east, y + north, z + up)
        self._wanted = (point.number, place, self._clock())
        if point.number == self._movable:
            self._move(point.number, place)
            return

        def go() -> None:
            self._movable = point.number
            self._move(point.number, place)

        name = point.name
        question = (
            f"Move {name}? The vehicle follows if it flies there. Further moves of this waypoint need no confirmation."
        )
        confirm(self.app, self._named(question), go)

    def _wanted_place(self, point: PlanPoint) -> Vector:
        """Position that a waypoint has, or is about to have: keys may come faster than the vehicle's answers."""
        number, place, asked = self._wanted
        is_under_way = number == point.number and self._clock() - asked < ANSWER_TIME
        return place if is_under_way else point.position

    def _move(self, number: int, place: Vector) -> None:
        if (station := self._vehicle()) is not None:
            station.flight_plan.move_waypoint(number, place, self._clock())

    @on(DataTable.RowSelected, "#plan-points")
    def _edit_point(self) -> None:
        plan = self.snapshot.flight_plan
        point = None if plan is None else plan.points.get(self.points.chosen)
        if point is None or self._vehicle() is None:
            return
        labels = ("East of plan's origin [m]", "North of plan's origin [m]", "Up [m]")
        helps = (WEST_HELP, SOUTH_HELP, "Above the plan's origin")
        fields = [
            FormField(label, f"{value:.2f}", help_text)
            for label, value, help_text in zip(labels, point.position, helps, strict=True)
        ]

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None:
                x, y, z = (float(value) for value in values)
                self._move(point.number, (x, y, z))

        title = self._named(f"Move waypoint {point.name}")
        self.app.push_screen(AskScreen(title, fields, ranges=LOCAL_PLACE), answered)

    @on(DataTable.RowSelected, "#plan-settings")
    def _edit_setting(self, event: DataTable.RowSelected) -> None:
        plan, station = self.snapshot.flight_plan, self._vehicle()
        number = int(event.row_key.value or 0)
        if plan is None or station is None or number not in plan.settings:
            return
        setting = plan.settings[number]
        limits = limits_text(setting)

        def check(values: tuple[str, ...]) -> str | None:
            value = float(values[0])
            if value < setting.low or value > setting.high:  # neither holds of a limit that there is not
                return f"{setting.name}: {value:g} is outside {limits}"
            station.flight_plan.set_variable(number, value, self._clock())
            return None

        title = setting.name if setting.label == setting.name else f"{setting.label}: {setting.name}"
        label = f"Value [{setting.unit}]" if setting.unit else "Value"
        fields = [FormField(f"{label} {limits}", f"{setting.value:.6g}", "The plan on the vehicle uses it at once")]
        self.app.push_screen(AskScreen(self._named(title), fields, check, ranges=[NUMBER]))

    # Inside

    def _vehicle(self) -> Station | None:
        """The vehicle if it can be commanded; else the notice says why not."""
        reason = why_unreachable(self._station, self.snapshot)
        if reason:
            self.show_notice(reason)
            return None
        return self._station
