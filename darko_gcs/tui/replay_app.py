"""The same screens on a recording, or on two side by side: a time bar, and the keys of a player."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.screen import Screen
from textual.widgets import Input

from darko_gcs.errors import GroundError
from darko_gcs.feed.pair_feed import PairFeed
from darko_gcs.feed.player import MarkKind, Player
from darko_gcs.feed.replay_feed import ReplayFeed
from darko_gcs.preferences import PreferencesFile
from darko_gcs.state.text import format_time
from darko_gcs.tui.app import GroundStationApp
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.screens.charts_screen import ChartsScreen
from darko_gcs.tui.screens.dialogs import confirm
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.widgets.pair_panels import (
    HeightPanel,
    PairMapPanel,
    PairPanel,
    PairStatus,
    PairTable,
    PairVPanel,
    TimeBar,
)

MARK_KEYS = {
    "j": MarkKind.JUMP,
    "f": MarkKind.MODE,
    "w": MarkKind.WARNING,
    "i": MarkKind.WAYPOINT,
    "g": MarkKind.GAP,
}
CLOCK_RULE = (
    "the bar, the keys, --at, 'log info' and 'log export' count one clock: from the log's first message on, as the "
    "vehicle counts. Its time since boot is below the bar. Two recordings aligned by "
    "take-off are played on the vehicles' clocks"
)
FOOTER_MARKS = frozenset("jw")  # the help has the other keys, too


class ReplayApp(GroundStationApp):
    """A ground station whose vehicle is a log."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("space", "pause", "Pause", priority=True, tooltip="Pause, play"),
        Binding("left", "seek(-5)", "-5 s", tooltip="5 s back"),
        Binding("right", "seek(5)", "+5 s", tooltip="5 s on"),
        Binding("shift+left", "seek(-30)", "", show=False, tooltip="30 s back"),
        Binding("shift+right", "seek(30)", "", show=False, tooltip="30 s on"),
        Binding("home", "go(0)", "", show=False, tooltip="To the beginning"),
        Binding("end", "go(1)", "", show=False, tooltip="To the end"),
        Binding("left_square_bracket", "speed(-1)", "Slow", tooltip="Play slower", key_display="["),
        Binding("right_square_bracket", "speed(1)", "Fast", tooltip="Play faster", key_display="]"),
        Binding("full_stop", "step(1)", "", show=False, tooltip="A step on", key_display="."),
        Binding("comma", "step(-1)", "", show=False, tooltip="A step back", key_display=","),
        Binding("b", "backwards", "", show=False, tooltip="Play backwards"),
        Binding("l", "loop", "", show=False, tooltip="Play again and again"),
        Binding("u", "send", "", show=False, tooltip="Send the frames to another ground station"),
        Binding("tab", "mark('', 1)", "Mark", priority=True, tooltip="To the next mark"),
        Binding("shift+tab", "mark('', -1)", "", show=False, priority=True, tooltip="To the mark before"),
        *(
            Binding(
                key,
                f"mark('{kind.value}', 1)",
                kind.value.title(),
                show=key in FOOTER_MARKS,
                tooltip=f"To the next mark: {kind.value}",
            )
            for key, kind in MARK_KEYS.items()
        ),
        *(
            Binding(
                key.upper(), f"mark('{kind.value}', -1)", "", show=False, tooltip=f"To the mark before: {kind.value}"
            )
            for key, kind in MARK_KEYS.items()
        ),
        *(
            Binding(str(n), f"go({n / 10})", "", show=False, tooltip=f"To {10 * n} % of the recording")
            for n in range(1, 10)
        ),
    ]

    def __init__(self, feed: Player, preferences: PreferencesFile | None = None) -> None:
        super().__init__(feed, preferences)
        self.replay = feed

    def first_screen(self) -> FlightScreen:
        """The flight screen with a time bar."""
        return ReplayScreen(self.replay)

    def extra_keys(self) -> list[tuple[str, str]]:
        """The player's keys."""
        return [
            ("space", "Pause or play"),
            ("left right", "Seek 5 s; a click on the time bar seeks there"),
            ("shift+← →", "Seek 30 s"),
            ("home end 1-9", "Go to the beginning, the end, tenths of the recording"),
            ("[ ]", "Slower, faster"),
            (". ,", "One message on, one message back"),
            ("b", "Play backwards, or forwards again"),
            ("l", "Begin anew at the end, or stop there"),
            ("u", "Send what is played to another station (--to), or stop that"),
            ("times", CLOCK_RULE),
            ("tab", "Next mark of any kind; shift+tab: the one before"),
            *((f"{key} {key.upper()}", f"Next {kind.value}, the one before") for key, kind in MARK_KEYS.items()),
        ]

    def pull(self) -> None:
        """Show the newest snapshot, and where it is."""
        super().pull()
        for screen in self.screen_stack:
            for bar in screen.query(TimeBar):
                bar.redraw()

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        """The player's keys work wherever no dialog or text field waits for them."""
        if action in {"pause", "mark"} and (self.screen.is_modal or isinstance(self.focused, Input)):
            return False
        if action == "pause" and isinstance(self.screen, ChartsScreen) and self.screen.charts.end is not None:
            return False  # the charts stand still of their own, and go on first
        if action == "mark" and parameters[0] == "" and not isinstance(self.screen, FlightScreen):
            return False  # Tab goes from part to part there
        return super().check_action(action, parameters)

    def time_text(self, when: float) -> str:
        """A playing time [s] as the time in the log."""
        return f"{format_time(self.replay.log_time(when)):>7}"

    def action_pause(self) -> None:
        """Pause or play."""
        self.replay.toggle()
        self.pull()

    def action_seek(self, step: float) -> None:
        """Move by some seconds."""
        self.replay.seek(self.replay.playing_at(self.replay.log_time(self.replay.now) + step))
        self.pull()

    def action_go(self, share: float) -> None:
        """Go to a share (0..1) of the recording."""
        self.replay.seek(share * self.replay.duration)
        self.pull()

    def action_step(self, messages: int) -> None:
        """Go on or back by some messages."""
        self.replay.step(messages)
        self.pull()

    def action_mark(self, kind: str, direction: int) -> None:
        """Go to the next or previous mark of a kind, or of any kind."""
        if self.replay.seek_mark(MarkKind(kind) if kind else None, direction) is None:
            order = "later" if direction > 0 else "earlier"
            self.notify(f"No {order} {kind or 'mark'} in this recording")
        self.pull()

    def action_backwards(self) -> None:
        """Play in the other direction."""
        self.replay.backwards = not self.replay.backwards
        self.pull()

    def action_loop(self) -> None:
        """Begin anew at the end, or stop there."""
        self.replay.looping = not self.replay.looping
        self.pull()

    async def action_send(self) -> None:
        """Send what is played to another station, or send it no more."""
        if not isinstance(self.replay, ReplayFeed):
            self.notify("One of two recordings cannot be sent: open it alone", severity="warning")
            return
        output = self.replay.output
        if output is None or output.words:
            await self._toggle_output()
        else:
            question = f"Send this recording to {output.address_words}? A station there shows it as a live vehicle."
            confirm(self, question, lambda: self.run_worker(self._toggle_output()))

    async def _toggle_output(self) -> None:
        if not isinstance(self.replay, ReplayFeed):
            return
        try:
            await self.replay.toggle_output()
        except GroundError as error:
            self.notify(str(error), severity="warning")
        self.pull()

    def action_speed(self, steps: int) -> None:
        """Play slower or faster."""
        self.replay.change_speed(steps)
        self.pull()


class ReplayScreen(FlightScreen, inherit_bindings=False):
    """The flight screen with a time bar above the footer; shift and an arrow seek here, and do not move the map."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "ctrl+up", "pan(0, 1)", "Map: move the view", show=False, key_display="ctrl+arrows", tooltip="Move the map"
        ),
        Binding("ctrl+down", "pan(0, -1)", show=False),
        Binding("ctrl+right", "pan(1, 0)", show=False),
        Binding("ctrl+left", "pan(-1, 0)", show=False),
    ]

    EXTRA_ROWS = 2

    def __init__(self, feed: Player) -> None:
        super().__init__()
        self._feed = feed

    def compose(self) -> ComposeResult:
        """The flight screen's widgets, then the bar."""
        yield from super().compose()
        yield TimeBar(self._feed).data_bind(ReplayScreen.snapshot, ReplayScreen.now)


ONE_FLIGHT_ACTIONS = frozenset({"zoom_in", "zoom_out", "zoom_fit", "follow", "panels", "more"})


class PairApp(ReplayApp):
    """A player of two recordings."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("o", "align", "Align", tooltip="Align by the next rule: take-off, beginnings, date"),
        Binding("less_than_sign", "shift(-0.1)", "B -0.1 s", tooltip="The second flight 0.1 s earlier"),
        Binding("greater_than_sign", "shift(0.1)", "B +0.1 s", tooltip="The second flight 0.1 s later"),
        Binding("left_parenthesis", "shift(-1)", "", show=False, tooltip="The second flight 1 s earlier"),
        Binding("right_parenthesis", "shift(1)", "", show=False, tooltip="The second flight 1 s later"),
    ]

    def __init__(self, feed: PairFeed) -> None:
        super().__init__(feed)
        self.pair = feed

    def first_screen(self) -> FlightScreen:
        """Both flights."""
        return PairScreen(self.pair)

    def _offers(self, name: str, screen: Screen[object]) -> bool:
        """Whether an action is offered; those that change the map and panels of one flight do nothing here."""
        return not (name in ONE_FLIGHT_ACTIONS and isinstance(screen, PairScreen)) and super()._offers(name, screen)

    def extra_keys(self) -> list[tuple[str, str]]:
        """The player's keys, and those of the alignment."""
        return [
            *super().extra_keys(),
            ("o", "Align by take-off, by the recordings' beginnings, by the date"),
            ("< >", "The second flight 0.1 s earlier, later"),
            ("( )", "The second flight 1 s earlier, later"),
        ]

    def action_align(self) -> None:
        """Align by the next rule."""
        self.pair.next_alignment()
        self._show_again()

    def action_shift(self, step: float) -> None:
        """Shift the second flight."""
        self.pair.move_second(step)
        self._show_again()

    def _show_again(self) -> None:
        """Draw also what does not depend on the time alone."""
        self.pull()
        for panel in self.screen.query(PairPanel):
            panel.watch_now()


class PairScreen(FlightScreen, inherit_bindings=False):
    """Values, map and charts of two flights, and one time bar; its map shows all of both, and is not moved."""

    EXTRA_ROWS = 3

    def __init__(self, feed: PairFeed) -> None:
        super().__init__()
        self._feed = feed

    def compose(self) -> ComposeResult:
        """Both vehicles in one line, four panels, the bar."""
        yield PairStatus(self._feed).data_bind(FlightScreen.snapshot, FlightScreen.now)
        with Container(id="pair"):
            for panel in (
                PairTable("Values", self._feed, id="pair-values"),
                PairMapPanel("Map", self._feed, id="pair-map"),
                PairVPanel("V of the law in force", self._feed, id="pair-v"),
                HeightPanel("Height, m", self._feed, id="pair-height"),
            ):
                yield panel.data_bind(FlightScreen.snapshot, FlightScreen.now)
        yield TimeBar(self._feed).data_bind(FlightScreen.snapshot, FlightScreen.now)
        yield KeyFooter()
