"""The application: pulls snapshots ten times a second, and is the only one that talks to the vehicle."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable
from datetime import datetime
from typing import ClassVar

from textual.app import App, SystemCommand
from textual.binding import Binding, BindingType
from textual.screen import Screen

from darko_gcs.actions import ACTIONS, Action, control_question
from darko_gcs.errors import GroundError
from darko_gcs.feed import Feed
from darko_gcs.screens.dialogs import AskScreen, ConfirmScreen, HelpScreen, ask_number
from darko_gcs.screens.fly import FlyScreen
from darko_gcs.screens.messages import MessagesScreen
from darko_gcs.screens.mission import Draft, MissionScreen
from darko_gcs.screens.parameters import ParametersScreen
from darko_gcs.widgets.map import MapPanel
from darko_gcs.widgets.numbers import FlightPanel
from darko_gcs.words import clock
from protocol.dialect import mavlink

__all__ = ["GroundStation"]

REFRESH = 0.1  # [s]
BY_NAME = {action.name: action for action in ACTIONS}


class GroundStation(App[int]):
    """The ground station on a feed: a vehicle or a recording."""

    TITLE = "DarkO"
    CSS_PATH = "app.tcss"
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(action.key, f"act('{action.name}')", action.label or action.help, show=bool(action.label))
        for action in ACTIONS
    ]
    failure: GroundError | None = None  # why it could not start

    def __init__(self, feed: Feed) -> None:
        super().__init__()
        self.feed = feed
        self.draft = Draft()
        self._pulled = time.monotonic()

    async def on_mount(self) -> None:
        """Open the feed and begin to look at it."""
        try:
            await self.feed.open()
        except GroundError as error:
            self.failure = error
            self.exit(error.exit_code)
            return
        await self.push_screen(self.first_screen())
        if self.draft.plan.items:
            self.notify(f"{self.draft.path} is open: m shows it, u there sends it to the vehicle")
        self.set_interval(REFRESH, self.pull)

    async def on_unmount(self) -> None:
        """Close the feed, whatever ended the app."""
        await self.feed.close()

    def first_screen(self) -> FlyScreen:
        """The screen that is always at the bottom."""
        return FlyScreen()

    def pull(self) -> None:
        """Hand the newest snapshot to every screen that shows it, also below dialogs."""
        now = time.monotonic()
        self.feed.advance(now - self._pulled)
        self._pulled = now
        for screen in self.screen_stack:
            if isinstance(screen, FlyScreen | MissionScreen | ParametersScreen | MessagesScreen):
                screen.now = self.feed.now
                screen.snapshot = self.feed.snapshot

    # Actions

    def action_act(self, name: str) -> None:
        """Do one of the table's actions, after asking where it matters."""
        action = BY_NAME[name]
        if action.needs_vehicle and not self._may_command():
            return
        question = action.confirm(self.feed.snapshot)
        if question is None:
            action.do(self)
            return

        def answered(yes: bool | None) -> None:
            if yes:
                action.do(self)

        self.push_screen(ConfirmScreen(question), answered)

    def _may_command(self) -> bool:
        if self.feed.station is None:
            self.notify("This is a recording: there is no vehicle to command", severity="warning")
        elif self.feed.snapshot.source is None:
            self.notify("No vehicle has been heard yet", severity="warning")
        elif self.feed.snapshot.lost:
            self.notify("The vehicle is silent: nothing was sent", severity="warning")
        else:
            return True
        return False

    def tell(self, request: str) -> None:
        """One of the station's requests without arguments."""
        getattr(self.feed.station, request)(self.feed.now)

    def disarm(self) -> None:
        """Disarm; asked for in the air, it was confirmed and is meant."""
        station = self.feed.station
        if station is not None:
            station.disarm(self.feed.now, force=self.feed.snapshot.landed_state in {2, 3, 4})

    def ask_take_off(self) -> None:
        """Ask for the height, then take off."""

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None and self.feed.station is not None:
                self.feed.station.take_off(float(values[0]), self.feed.now)

        self.push_screen(AskScreen("Take off", [("Height above home [m]", "3")]), answered)

    def ask_go_to(self) -> None:
        """Ask for the point, then go there."""
        p = self.feed.snapshot.from_home or (0.0, 0.0, -3.0)
        fields = [
            ("North of home [m]", f"{round(p[0], 1) + 0.0:.1f}"),
            ("East of home [m]", f"{round(p[1], 1) + 0.0:.1f}"),
            ("Height above home [m]", f"{-p[2]:.1f}"),
        ]

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None and self.feed.station is not None:
                north, east, height = (float(value) for value in values)
                self.feed.station.go_to(north, east, height, self.feed.now)

        self.push_screen(AskScreen("Go to", fields), answered)

    def ask_transition(self) -> None:
        """Ask, then change to the other way of flying; the answer is for the question, whatever happened meanwhile."""
        s = self.feed.snapshot
        forward = s.vtol_state not in {mavlink.MAV_VTOL_STATE_FW, mavlink.MAV_VTOL_STATE_TRANSITION_TO_FW}
        question = "Tip over into forward flight?" if forward else "Leave forward flight and hover?"
        if s.mission_state == mavlink.MISSION_STATE_ACTIVE:
            question += " A mission is being flown."

        def answered(yes: bool | None) -> None:
            if yes and self.feed.station is not None:
                self.feed.station.transition(self.feed.now, forward=forward)

        self.push_screen(ConfirmScreen(question), answered)

    def ask_control(self) -> None:
        """Ask, then do the one thing that is to be done about who is in control."""
        question, request = control_question(self.feed.snapshot)

        def answered(yes: bool | None) -> None:
            if yes and self.feed.station is not None:
                getattr(self.feed.station, request)(self.feed.now)

        self.push_screen(ConfirmScreen(question), answered)

    def ask_speed(self) -> None:
        """Ask for the speed, then fly at it; the vehicle says what it makes of it."""
        fields = [("Speed [m/s]", ""), ("0 airspeed, 1 over ground", "0")]

        def check(values: tuple[str, ...]) -> str | None:
            if ask_number(values[0]) is None:
                return f"Speed: {values[0]!r} is not a number"
            return None if values[1] in {"0", "1"} else "The speed is 0, in the air, or 1, over ground"

        def answered(values: tuple[str, ...] | None) -> None:
            if values is not None and self.feed.station is not None:
                self.feed.station.change_speed(float(values[0]), self.feed.now, over_ground=values[1] == "1")

        self.push_screen(AskScreen("Change speed", fields, check), answered)

    def show_mission(self) -> None:
        """Open the mission screen, once."""
        if not isinstance(self.screen, MissionScreen):
            self.push_screen(MissionScreen(self.feed.station, lambda: self.feed.now, self.draft))

    def show_parameters(self) -> None:
        """Open the parameter screen, once."""
        if not isinstance(self.screen, ParametersScreen):
            self.push_screen(ParametersScreen(self.feed.station, lambda: self.feed.now))

    def show_messages(self) -> None:
        """Open the log of messages, once."""
        if not isinstance(self.screen, MessagesScreen):
            self.push_screen(MessagesScreen(self.stamp))

    def stamp(self, when: float) -> str:
        """A time of the feed's clock [s] in words: time of day, or of a recording the playing time."""
        if self.feed.station is None:
            return f"{clock(when):>7}"
        return f"{datetime.fromtimestamp(time.time() - self.feed.now + when).astimezone():%H:%M:%S}"

    def show_help(self) -> None:
        """Open the list of keys."""
        self.push_screen(HelpScreen(self.extra_keys(), _keys_of(self.screen)))

    def extra_keys(self) -> list[tuple[str, str]]:
        """Keys beside those of the table."""
        return []

    def zoom(self, step: int) -> None:
        """Zoom the map in, out, or to fit."""
        for panel in self.screen.query(MapPanel):
            panel.zoom(step)

    def more(self) -> None:
        """Turn the page of the numbers."""
        for panel in self.screen.query(FlightPanel):
            panel.next_page()

    def leave(self) -> None:
        """Quit; an armed vehicle or a plan that is nowhere else is a reason to ask."""
        reasons = []
        if self.feed.snapshot.armed and self.feed.station is not None:
            reasons.append("The vehicle is armed.")
        if self.draft.is_at_risk:
            reasons.append("The plan is neither saved nor on the vehicle.")
        if not reasons:
            self.exit(0)
            return

        def answered(yes: bool | None) -> None:
            if yes:
                self.exit(0)

        self.push_screen(ConfirmScreen(" ".join([*reasons, "Quit all the same?"])), answered)

    def get_system_commands(self, screen: Screen[object]) -> Iterable[SystemCommand]:
        """The palette: the table's actions, then Textual's own."""
        for action in ACTIONS:
            yield SystemCommand(action.label or action.name.replace("_", " "), action.help, self._doing(action))
        yield from super().get_system_commands(screen)

    def _doing(self, action: Action) -> Callable[[], None]:
        return lambda: self.action_act(action.name)


def _keys_of(screen: Screen[object]) -> list[tuple[str, str]]:
    """The keys that a screen other than the flight's has for itself."""
    if isinstance(screen, FlyScreen):
        return []
    bindings = (binding for binding in screen.BINDINGS if isinstance(binding, Binding) and binding.description)
    return [
        (binding.key.split(",")[0].replace("escape", "esc"), binding.tooltip or binding.description)
        for binding in bindings
    ]
