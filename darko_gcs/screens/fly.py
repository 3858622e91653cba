"""The flight screen: all of a flight at a glance, from 80x24 upwards."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Container, Vertical
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer

from darko_gcs.snapshot import EMPTY, Snapshot
from darko_gcs.widgets.map import MapPanel
from darko_gcs.widgets.numbers import DecisionPanel, FlightPanel
from darko_gcs.widgets.panels import ActuatorPanel, AttitudePanel, HybridPanel, MessagePanel
from darko_gcs.widgets.status import StatusBar

__all__ = ["FlyScreen"]


class FlyScreen(Screen[None]):
    """Panels that follow one snapshot."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    snapshot: reactive[Snapshot] = reactive(EMPTY, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def watch_snapshot(self, s: Snapshot) -> None:
        """What a silent vehicle showed last is marked as old."""
        self.set_class(s.lost, "-stale")

    def compose(self) -> ComposeResult:
        """Status bar, panels, messages, footer."""
        yield StatusBar().data_bind(FlyScreen.snapshot, FlyScreen.now)
        with Container(id="panels"):
            with Vertical(id="left"):
                yield HybridPanel("Hybrid controller", id="hybrid").data_bind(FlyScreen.snapshot)
                yield ActuatorPanel("Actuators", id="actuators").data_bind(FlyScreen.snapshot)
                yield MessagePanel("Messages", id="messages").data_bind(FlyScreen.snapshot)
            with Container(id="right"):
                yield AttitudePanel("Attitude", id="attitude").data_bind(FlyScreen.snapshot)
                yield MapPanel("Map", id="map").data_bind(FlyScreen.snapshot)
                yield FlightPanel("Flight", id="flight").data_bind(FlyScreen.snapshot)
                yield DecisionPanel("Decision", id="decision").data_bind(FlyScreen.snapshot)
        yield Footer(compact=True, show_command_palette=False)
