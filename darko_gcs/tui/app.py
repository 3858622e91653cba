"""The application: hands the newest snapshot to the screens ten times a second and sends the operator's requests."""

from __future__ import annotations

import asyncio
import gc
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from datetime import datetime
from functools import partial
from pathlib import Path
from typing import ClassVar

from textual import events
from textual.binding import Binding, BindingType
from textual.command import Provider
from textual.screen import ModalScreen, Screen
from textual.widget import Widget

from darko_gcs.errors import GroundError
from darko_gcs.feed.feed import Feed
from darko_gcs.feed.gamepad import Gamepad, StickDevice
from darko_gcs.preferences import FAULT_SHOWN_TIME, KEYS_FILE, PreferencesFile
from darko_gcs.state.chart_views import BUILT_IN, MAX_CHARTS, ChartView, ChartViews
from darko_gcs.state.map_overlay import Overlay, load_overlay
from darko_gcs.state.sticks import STICK_KEYS
from darko_gcs.state.text import format_time
from darko_gcs.tui.actions import ACTIONS, Request, control_question, disarm_question, why_unreachable
from darko_gcs.tui.alert_calls import AlertCalls
from darko_gcs.tui.containment import EXIT_CRASHED, on
from darko_gcs.tui.failure_dialog import ask_failure
from darko_gcs.tui.flight_dialogs import (
    armed_words,
    ask_fleet,
    ask_go_to,
    ask_go_to_place,
    ask_speed,
    ask_start,
    ask_take_off,
    ask_transition,
    choose_panels,
    fleet_snapshots,
    named,
)
from darko_gcs.tui.kept_look import KeptLook
from darko_gcs.tui.key_footer import TypedKeys
from darko_gcs.tui.map_panel import MapPanel, MovableMap
from darko_gcs.tui.own_keys import own_keys
from darko_gcs.tui.palette import (
    PaletteEntry,
    StationCommands,
    action_entries,
    help_sections,
    place_entries,
    player_entries,
    screen_bindings,
    screen_entries,
)
from darko_gcs.tui.plan_draft import PlanDraft
from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.screens.dialogs import FileDialog, HelpScreen, QuitScreen, confirm
from darko_gcs.tui.screens.flight_plan_screen import FlightPlanScreen
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.screens.inspector_screen import InspectorScreen
from darko_gcs.tui.screens.jumps_screen import JumpsScreen
from darko_gcs.tui.screens.messages_screen import MessagesScreen
from darko_gcs.tui.screens.mission_screen import MissionScreen
from darko_gcs.tui.screens.parameters_screen import DoneChange, ParametersScreen
from darko_gcs.tui.screens.pilot_screen import PilotScreen
from darko_gcs.tui.screens.preflight_screen import PreflightScreen
from darko_gcs.tui.view_controls import ZOOMED, ViewControls
from darko_gcs.tui.ways_out import ignore_interrupts, is_hung_up, leave, watch_signals, watch_terminal
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from darko_gcs.tui.widgets.panel import PANEL_STYLES
from darko_gcs.tui.widgets.status_bar import FleetStrip
from protocol.dialect import mavlink
from protocol.errors import FileError

REFRESH_PERIOD = 0.1  # [s]
OVERLAY_SUFFIXES = (".geojson", ".json", ".kml")
STDIN = 0  # the terminal, for Textual
FOLLOWING_SCREENS = (
    FlightPlanScreen, MissionScreen, ParametersScreen, MessagesScreen, InspectorScreen, ChartsScreen, JumpsScreen,
    PreflightScreen,
)  # fmt: skip
ACTION_BY_NAME = {action.name: action for action in ACTIONS}
FLIGHT_ACTIONS = {action.name: action.key for action in ACTIONS if action.needs_vehicle}
VEHICLE_KEYS = {name: ACTION_BY_NAME[name].key for name in ("next_vehicle", "previous_vehicle")}
VIEW_ACTIONS: Mapping[str, Sequence[type[Widget]]] = {  # and the panels that they change
    "zoom_in": ZOOMED, "zoom_out": ZOOMED, "zoom_fit": ZOOMED, "follow": (MapPanel,), "more": (FlightPanel,),
    "panels": (FlightPanel,),
}  # fmt: skip
FLEET_ACTIONS = frozenset({"fleet", "next_vehicle", "previous_vehicle", "strip"})


class GroundStationApp(ViewControls):
    """The ground station on a feed: a vehicle or a recording."""

    TITLE = "DarkO"
    CSS_PATH = "app.tcss"
    COMMANDS: ClassVar[set[type[Provider] | Callable[[], type[Provider]]]] = {StationCommands}
    COMPONENT_CLASSES: ClassVar[set[str]] = {f"panel--{name}" for name in PANEL_STYLES}
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            action.key,
            f"act('{action.name}')",
            action.label or action.short or action.help,
            show=bool(action.label),
            id=action.name,
        )
        for action in ACTIONS
    ]
    failure: GroundError | None = None  # why it could not start

    def __init__(self, feed: Feed, preferences: PreferencesFile | None = None, on_alert: Sequence[str] = ()) -> None:
        super().__init__()
        for name in [name for name, theme in self.available_themes.items() if theme.ansi]:
            self.unregister_theme(name)  # they blend no colours: a dialog would blank the flight behind it
        self.feed = feed
        self.calls = AlertCalls(self, on_alert)
        self.kept = KeptLook(self, preferences)
        self.draft = PlanDraft()
        self.changes: list[DoneChange] = []  # that were made here, newest last
        self.overlay: Overlay = ()  # on every map
        self.live_page = self.recording = ""  # address of the page in 3-D, file of the recording; empty without
        self.own_keys: Mapping[str, str] = {}  # of the pilot, by the names of bindings
        self.views, self.view = ChartViews(), next(iter(BUILT_IN.values()))
        self._wants_truth = False
        self._leaving: asyncio.Task[None] | None = None  # after the terminal was closed
        self._last_pull = time.monotonic()
        self._keys = TypedKeys(self, self._tell_ignored_keys, is_guarded=feed.station is not None)

    async def on_mount(self) -> None:
        """Open the feed and begin to show it."""
        self._keys.start()
        watch_signals(self.end_at_once)
        if self.is_web:
            ignore_interrupts()
        if not self.is_headless:
            watch_terminal(STDIN, self.end_at_once)
        try:
            await self.feed.open()
        except GroundError as error:
            self.failure = error
            self.exit(error.exit_code)
            return
        problems = self._use_own_keys()
        await self.push_screen(self.first_screen())
        self.kept.restore()
        for problem in problems:
            self.notify(problem, severity="warning", timeout=FAULT_SHOWN_TIME, markup=False)
        if self.draft.plan.items:
            self.notify(f"{self.draft.path} is open: press m to show it, then u to upload it")
        self.set_interval(REFRESH_PERIOD, self.pull)

    def _use_own_keys(self) -> Sequence[str]:
        """Take the pilot's own keys; a line about what is wrong with their file, if anything is."""
        if self.kept.preferences is None:
            return ()
        named = [binding for binding in [*self.BINDINGS, *screen_bindings()] if isinstance(binding, Binding)]
        self.own_keys, problems = own_keys(self.kept.preferences.path.with_name(KEYS_FILE), named)
        self.set_keymap(dict(self.own_keys))
        return problems

    async def on_unmount(self) -> None:
        """Close the feed, also after an error."""
        self._keys.stop()
        if self.crash:
            self._record_end("The ground station ended by an error")
        await self.feed.close()

    async def on_event(self, event: events.Event) -> None:
        """Take keys one at a time; everything else at once."""
        is_queued = not (event.is_forwarded or self._is_stick(event) or self._keys.has_turn(event))
        if isinstance(event, events.Key | events.Paste) and is_queued:
            self._keys.add(event)
        else:
            await super().on_event(event)

    def on_app_focus(self) -> None:
        """Draw everything: a page of the browser that has just been opened is empty."""
        self.refresh()

    def _is_stick(self, event: events.Event) -> bool:
        """True for a key of flight by hand, which may not wait for the one before."""
        return isinstance(event, events.Key) and bool(self.screen_stack) and isinstance(self.screen, PilotScreen)

    def on_key(self, event: events.Key) -> None:
        """Say why a flight key does nothing where it does nothing."""
        keys = {self.own_keys.get(name, key) for name, key in (FLIGHT_ACTIONS | VEHICLE_KEYS).items()}
        if event.key not in keys or event.key in self.screen.active_bindings:
            return
        if event.key in {self.own_keys.get(name, key) for name, key in VEHICLE_KEYS.items()}:
            if self.feed.fleet is None and isinstance(self.screen, FlightScreen):
                self.notify("A replay shows one vehicle: start it with --vehicle ID for another one")
            return
        if self.feed.station is None:
            self._can_command()
        elif not isinstance(self.screen, ModalScreen):
            self.notify(f"{event.key}: flight keys work on the flight screen; Esc goes back", severity="warning")

    def _tell_ignored_keys(self) -> None:
        self.notify("Keys that arrived at once (a paste?) were ignored", severity="warning")

    def must_go_on(self) -> bool:
        """While a vehicle is armed, or a plan would be lost."""
        return self.feed.station is not None and bool(armed_words(self.feed) or self.draft.is_at_risk)

    def tell_error(self, text: str) -> None:
        """Tell an error in a notice, in the message log and in the recording."""
        super().tell_error(text)
        if self.feed.station is not None:
            self.feed.station.add_line(self.feed.now, text, mavlink.MAV_SEVERITY_ERROR)
            self.feed.note(text)

    def first_screen(self) -> FlightScreen:
        """The screen that is always at the bottom."""
        return FlightScreen()

    def pull(self) -> None:
        """Hand the newest snapshot to every screen that is seen, also beneath dialogs."""
        if not self.is_running:  # it ends: the screens lose their widgets one by one
            return
        before, self._last_pull = self._last_pull, time.monotonic()
        self.guarded(lambda: self.feed.advance(self._last_pull - before), "the feed")
        self.draft.note_beginning(self.feed.snapshot)
        for screen in self._seen_screens():
            self.guarded(partial(self._show_on, screen), type(screen).__name__)
        self.guarded(lambda: self.calls.follow(fleet_snapshots(self.feed) or (self.feed.snapshot,)), "alerts")
        self._request_truth()

    def _seen_screens(self) -> list[Screen[object]]:
        """The uppermost screen that covers all others, and the dialogs above it."""
        first = next((k for k in range(len(self.screen_stack) - 1, 0, -1) if not self.screen_stack[k].is_modal), 0)
        return self.screen_stack[first:]

    def _show_on(self, screen: Screen[object]) -> None:
        if isinstance(screen, FlightScreen):
            screen.show_snapshot(self.feed.snapshot, self.feed.snapshot_now, fleet_snapshots(self.feed))
        elif isinstance(screen, FOLLOWING_SCREENS):
            if isinstance(screen, MissionScreen):
                screen.fleet = fleet_snapshots(self.feed)
            screen.now, screen.snapshot = self.feed.snapshot_now, self.feed.snapshot

    def _request_truth(self) -> None:
        """Have a simulation tell the truth as long as it is compared on the screen."""
        wanted = any(isinstance(screen, FlightScreen) and screen.shows_truth for screen in self.screen_stack)
        if wanted is not self._wants_truth:
            self._wants_truth = wanted
            self.request(lambda station, now: station.want_truth(now, wanted=wanted))

    # Actions

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """Flight commands exist on the flight screen of a vehicle only: elsewhere their keys mean something else."""
        if action == "act" and parameters:
            return self._offers(str(parameters[0]), self.screen)
        return super().check_action(action, parameters)

    def _offers(self, name: str, screen: Screen[object]) -> bool:
        """Whether one of the table's actions can be done on a screen; none while a dialog is open."""
        if screen.is_modal:
            return False
        if name == "acknowledge":
            return bool(self.feed.station)
        if name in FLIGHT_ACTIONS or name in FLEET_ACTIONS:
            far_end = self.feed.station if name in FLIGHT_ACTIONS else self.feed.fleet
            return far_end is not None and isinstance(screen, FlightScreen)
        if name in VIEW_ACTIONS and not any(screen.query(kind) for kind in VIEW_ACTIONS[name]):
            return False
        return name != "restart" or self.feed.restart is not None or self.feed.station is not None

    def action_act(self, name: str) -> None:
        """Run one of the table's actions, after asking if it must be confirmed."""
        action = ACTION_BY_NAME[name]
        if action.needs_vehicle and not self._can_command():
            return
        if (refusal := action.refusal(self.feed.snapshot)) is not None:
            self.notify(refusal, severity="warning")
            return
        question = action.question(self.feed.snapshot)
        if question is None:
            action.run(self)
        else:
            self._confirm(question, lambda: action.run(self))

    def _can_command(self) -> bool:
        """Whether a vehicle can be commanded; else a notice says why not."""
        reason = why_unreachable(self.feed.station, self.feed.snapshot)
        if reason:
            self.notify(reason, severity="warning")
        return not reason

    def named(self, question: str) -> str:
        """A question about the active vehicle, with its id if there are several."""
        return named(self.feed, question)

    def _confirm(self, question: str, then: Callable[[], None], yes: str = "y") -> None:
        """Ask a question about the active vehicle, and go on after a yes."""
        confirm(self, self.named(question), then, yes)

    def request(self, request: Request) -> None:
        """Send a request to the vehicle; none on a recording."""
        if self.feed.station is not None:
            request(self.feed.station, self.feed.now)

    def ask_disarm(self) -> None:
        """Ask, then disarm; by force only if the question was about the air, wherever the vehicle is by then."""
        s = self.feed.snapshot
        question, force = disarm_question(s), s.status.is_airborne

        def disarm() -> None:
            self.request(lambda station, now: station.disarm(now, force=force))

        if question is None:
            disarm()
        else:
            self._confirm(question, disarm, yes="D" if force else "y")  # y also begins flight by hand, where d turns

    def ask_take_off(self) -> None:
        """Ask for the height, then take off."""
        ask_take_off(self, self.feed, self.request)

    def ask_go_to(self) -> None:
        """Ask for the point, then go there."""
        ask_go_to(self, self.feed, self.request)

    def ask_transition(self) -> None:
        """Ask, then transition."""
        ask_transition(self, self.feed, self.request)

    def ask_start(self) -> None:
        """Ask, then fly the vehicle's mission."""
        ask_start(self, self.feed, self.draft, self.request, self.overlay)

    def fly_by_hand(self, device: StickDevice | None = None) -> None:
        """Open the sticks; without a device those of the keyboard."""
        station = self.feed.station
        if station is not None:
            over = partial(self._keys.ignore_held, meant=STICK_KEYS, why="flight by hand has ended")
            now, s = (lambda: self.feed.now), (lambda: self.feed.snapshot)
            sticks = PilotScreen(station, now, s, on_end=over, device=device)
            self.push_screen(sticks, self._tell_end_by_hand)

    def fly_by_gamepad(self) -> None:
        """The same with the gamepad that is connected."""
        try:
            self.fly_by_hand(Gamepad())
        except GroundError as error:
            self.notify(str(error), severity="warning", markup=False)

    def _tell_end_by_hand(self, text: str | None) -> None:
        if text:
            self.bell()
            self.notify(text, severity="warning", markup=False)

    def show_preflight(self) -> None:
        """Open the list of what hinders arming."""

        def ask() -> None:
            self.request(lambda station, now: station.check_arming(now))

        self.push_screen(PreflightScreen(ask, lambda: self.feed.now, self.feed.snapshot))

    def ask_failure(self) -> None:
        """Ask what shall fail, then have it fail."""
        ask_failure(self, self.feed, self.request)

    def ask_control(self) -> None:
        """Ask, then take, share or give back control."""
        question, request = control_question(self.feed.snapshot)
        self._confirm(question, lambda: self.request(request))

    def ask_speed(self) -> None:
        """Ask for the speed, then fly at it; the vehicle answers if it can."""
        ask_speed(self, self.feed, self.request)

    def ask_fleet(self) -> None:
        """Ask for a command to all vehicles, then send it."""
        ask_fleet(self, self.feed)

    def choose_next_vehicle(self, step: int) -> None:
        """Make another vehicle the active one."""
        if self.feed.fleet is not None and len(self.feed.fleet.stations) > 1:
            self.feed.fleet.choose_next(step)
            self.pull()
        else:
            self.notify("There is no other vehicle on the link")

    @on(FleetStrip.Chosen)
    def _choose_vehicle(self, event: FleetStrip.Chosen) -> None:
        if self.feed.fleet is not None:
            self.feed.fleet.choose(event.system)
            self.pull()

    def acknowledge(self) -> None:
        """The pilot has seen the alerts of all vehicles."""
        if not any(s.session.alerts for s in fleet_snapshots(self.feed) or (self.feed.snapshot,)):
            self.notify("There is no alert")
            return
        for station in self.feed.fleet.stations.values() if self.feed.fleet is not None else ():
            station.acknowledge()
        self.request(lambda station, _now: station.acknowledge())
        self.clear_notifications()
        self.pull()

    def change_strip(self) -> None:
        """Show more or fewer lines of the vehicles' strip."""
        if isinstance(self.screen, FlightScreen):
            self.screen.change_strip()

    def show_mission(self) -> None:
        """Open the mission screen, once."""
        self._open(MissionScreen(self.feed.station, lambda: self.feed.now, self.draft, self.named))

    def show_flight_plan(self) -> None:
        """Open the flight plan screen, once."""
        self._open(FlightPlanScreen(self.feed.station, lambda: self.feed.now, self.named))

    def show_parameters(self) -> None:
        """Open the parameter screen, once."""
        self._open(
            ParametersScreen(self.feed.station, lambda: self.feed.now, self.kept.preferences, self.named, self.changes)
        )

    def show_messages(self) -> None:
        """Open the message log, once."""
        self._open(MessagesScreen(self.time_text))

    def show_inspector(self) -> None:
        """Open the list of every message, once."""
        self._open(InspectorScreen(self.feed.traffic, lambda: self.feed.snapshot_now, self.feed.station))

    def show_jumps(self) -> None:
        """Open the list of jumps, once."""
        self._open(JumpsScreen())

    def show_charts(self) -> None:
        """Open the charts, once."""
        self._open(ChartsScreen(self.feed.history, self.views, self.view, self._keep_view))

    def _keep_view(self, view: ChartView) -> None:
        self.view = view

    @on(InspectorScreen.Chart)
    def _chart_field(self, event: InspectorScreen.Chart) -> None:
        """Draw a field that was chosen in the inspector in a chart of its own, first."""
        before = () if self.view.name else self.view.charts[: MAX_CHARTS - 1]
        self.view = ChartView(charts=((event.path,), *before))
        self.show_charts()

    def _open(self, screen: Screen[None]) -> None:
        """Open a screen, once; its first key already finds the vehicle."""
        if not isinstance(self.screen, type(screen)):
            self.push_screen(screen)
            self.pull()

    def time_text(self, when: float) -> str:
        """A time of the feed's clock [s] as text: time of day; of what is no live flight, the time in it."""
        live = f"{datetime.fromtimestamp(time.time() - self.feed.now + when).astimezone():%H:%M:%S}"
        return f"{format_time(when):>7}" if self.feed.station is None else live

    def show_help(self) -> None:
        """Open the list of keys."""
        offered = [action for action in ACTIONS if self.check_action("act", (action.name,))]
        is_live = self.feed.station is not None
        self.push_screen(
            HelpScreen(help_sections(self.screen, offered, self.extra_keys(), self.own_keys, is_live=is_live))
        )

    def extra_keys(self) -> list[tuple[str, str]]:
        """Keys beside those of the table, with their texts."""
        return []

    def open_overlay(self) -> None:
        """Ask for a file of shapes, and lay them over the maps."""

        def check(path: str) -> str | None:
            try:
                self.overlay = load_overlay(Path(path).expanduser())
            except FileError as error:
                return str(error)
            for screen in self.screen_stack:
                for shown in (*screen.query(MapPanel), *screen.query(MovableMap)):
                    shown.take_overlay(self.overlay)
            return None

        found = sorted(str(path) for suffix in OVERLAY_SUFFIXES for path in Path().glob(f"*{suffix}"))
        title = "Lay shapes over the maps (.geojson or .kml)"
        self.push_screen(FileDialog(title, "", known=found, suffixes=OVERLAY_SUFFIXES, check=check))

    def watch_theme(self) -> None:
        """Keep the theme for the next time."""
        self.kept.keep()

    def choose_panels(self) -> None:
        """Ask which panels of the flight screen to show."""
        for screen in self.screen_stack:
            if isinstance(screen, FlightScreen):
                choose_panels(self, screen, self.kept.keep)

    @on(MapPanel.PlaceClicked)
    def _ask_go_to_place(self, event: MapPanel.PlaceClicked) -> None:
        if self._can_command():
            ask_go_to_place(self, self.feed, event.place, self.request)

    def ask_restart(self) -> None:
        """Restart the simulator of ``--sitl``, asking first if its vehicle is armed; without one ask, then reboot."""
        if self.feed.restart is None:
            self._confirm("Reboot the vehicle? It starts anew.", lambda: self.request(lambda s, now: s.reboot(now)))
        elif (armed := armed_words(self.feed)) and not self.feed.snapshot.link.lost:
            self._confirm(f"{armed} Restart the simulator?", self._restart)
        else:
            self._restart()

    def _restart(self) -> None:
        if self.feed.restart is not None:
            self.run_worker(self.feed.restart())

    def ask_quit(self) -> None:
        """Quit; ask first if the vehicle is armed or the plan would be lost."""
        if isinstance(self.screen, QuitScreen):
            return
        reasons: list[str] = []
        if self.feed.station is not None:
            reasons += filter(None, [armed_words(self.feed)])
        if self.draft.is_at_risk:
            reasons.append("The plan is neither saved nor on the vehicle.")
        if reasons:
            self.push_screen(QuitScreen(" ".join([*reasons, "Quit anyway?"])), self._quit_if)
        else:
            self._quit_if(True)

    def _quit_if(self, yes: bool | None) -> None:
        if yes:
            self._record_end("The operator quit")
            self.exit(0)

    async def action_quit(self) -> None:
        """Ctrl+Q and the palette's Quit: the same question as q."""
        self.ask_quit()

    def action_help_quit(self) -> None:
        """Ctrl+C, which Textual only explains: the same question as q."""
        self.ask_quit()

    def end_at_once(self, reason: str) -> None:
        """End without a question, because nobody can answer one; the recording says why."""
        if self._leaving is not None:
            return
        self._record_end(reason)
        if not self.is_headless and is_hung_up(STDIN):
            self._leaving = asyncio.create_task(leave(self.feed.close))
        else:
            self.exit(0)

    def _record_end(self, reason: str) -> None:
        if self.feed.snapshot.identity.source is None:
            return  # a recording of nothing is not kept
        self.feed.note(f"{reason}, vehicle armed" if self.feed.snapshot.status.armed else reason)

    def palette_entries(self, screen: Screen[object]) -> list[PaletteEntry]:
        """The command palette: what can be done on the screen below it."""
        offered = {action.name: action for action in ACTIONS if self._offers(action.name, screen)}
        soon = partial(self.set_timer, 0.1, self.action_screenshot)  # when the palette has gone
        return [
            *action_entries(offered.values(), self.action_act, self.own_keys),
            *screen_entries(self, screen, offered, self.own_keys),
            *player_entries(self),
            *place_entries(self, self.feed.snapshot, self.live_page, self.recording, self.open_overlay),
            PaletteEntry("Save a picture of the screen", "An SVG file", soon, "screenshot print"),
            PaletteEntry("Change the colour theme", "Saved for the next start", self.action_change_theme, "dark light"),
        ]


def run_screens(app: GroundStationApp) -> int:
    """Run an app until the operator quits; returns the exit code.

    Raises:
        GroundError: It could not begin.
    """
    gc.set_threshold(5_000, 10, 100)  # the usual 700 cost 4 % of the processor; 50,000 at once 0.3 s, also of sticks
    gc.freeze()  # what is loaded stays: each search of it for garbage took 0.1 s and more, also while sticks are sent
    code = app.run()
    if app.failure is not None:
        raise app.failure
    if not app.crash:
        return code or app.return_code or 0
    print(f"darko-gcs: ended by an error of its own: {app.crash}; {app.errors.words}", file=sys.stderr)
    if app.feed.station is not None and (armed := armed_words(app.feed)):
        print(f"darko-gcs: {armed} {_fate(app)}", file=sys.stderr)
    return EXIT_CRASHED


def _fate(app: GroundStationApp) -> str:
    """Words for the fate of an armed vehicle without its ground station."""
    if app.feed.restart is not None:
        return "Its simulator, started by --sitl, was stopped with the ground station."
    return "It flies on and acts on the lost link (NAV_DLL_ACT); start darko-gcs again to take it back."
