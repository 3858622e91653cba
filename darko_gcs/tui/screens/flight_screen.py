"""The flight screen: the whole flight on one screen, from 80x24 upwards."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Container, Vertical
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.tui.widgets.actuator_panel import ActuatorPanel
from darko_gcs.tui.widgets.attitude_panel import AttitudePanel
from darko_gcs.tui.widgets.decision_panel import DecisionPanel
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from darko_gcs.tui.widgets.hybrid_panel import HybridPanel
from darko_gcs.tui.widgets.map_panel import MapPanel
from darko_gcs.tui.widgets.message_panel import MessagePanel
from darko_gcs.tui.widgets.status_bar import StatusBar

__all__ = ["FlightScreen"]


class FlightScreen(Screen[None]):
    """Panels that show one snapshot."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)

    def watch_snapshot(self, s: Snapshot) -> None:
        """Mark the values of a lost vehicle as old; leave no room for what another autopilot does not send."""
        self.set_class(s.lost, "-stale")
        self.set_class(s.source is not None and s.hybrid is None and bool(s.servos), "-foreign")

    def compose(self) -> ComposeResult:
        """Status bar, panels, messages, footer."""
        yield StatusBar().data_bind(FlightScreen.snapshot, FlightScreen.now)
        with Container(id="panels"):
            with Vertical(id="left"):
                yield HybridPanel("Hybrid controller", id="hybrid").data_bind(FlightScreen.snapshot)
                yield ActuatorPanel("Actuators", id="actuators").data_bind(FlightScreen.snapshot)
                yield MessagePanel("Messages", id="messages").data_bind(FlightScreen.snapshot)
            with Container(id="right"):
                yield AttitudePanel("Attitude", id="attitude").data_bind(FlightScreen.snapshot)
                yield MapPanel("Map", id="map").data_bind(FlightScreen.snapshot)
                yield FlightPanel("Flight", id="flight").data_bind(FlightScreen.snapshot)
                yield DecisionPanel("Decision", id="decision").data_bind(FlightScreen.snapshot)
        yield Footer(compact=True, show_command_palette=False)
