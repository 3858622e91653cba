"""Two recordings side by side, with the player's keys and those of their alignment."""

from __future__ import annotations

from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container
from textual.screen import Screen

from darko_gcs.feed.pair_feed import PairFeed
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.replay_app import ReplayApp
from darko_gcs.tui.screens.flight_screen import FlightScreen
from darko_gcs.tui.widgets.pair_panels import HeightPanel, PairMapPanel, PairPanel, PairStatus, PairTable, PairVPanel
from darko_gcs.tui.widgets.time_bar import TimeBar

ONE_FLIGHT_ACTIONS = frozenset({"zoom_in", "zoom_out", "zoom_fit", "follow", "panels", "more"})


class PairApp(ReplayApp):
    """A player of two recordings."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("o", "align", "Align"),
        Binding("less_than_sign", "shift(-0.1)", "B -0.1 s"),
        Binding("greater_than_sign", "shift(0.1)", "B +0.1 s"),
        Binding("left_parenthesis", "shift(-1)", "", show=False),
        Binding("right_parenthesis", "shift(1)", "", show=False),
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
