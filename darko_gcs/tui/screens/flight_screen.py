"""The flight screen: the whole flight on one screen, from 80x24 upwards."""

from __future__ import annotations

from enum import Enum

from textual.app import ComposeResult
from textual.containers import Container, Vertical
from textual.reactive import reactive
from textual.screen import Screen
from textual.widgets import Footer

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.tui.widgets.actuator_panel import ActuatorPanel
from darko_gcs.tui.widgets.attitude_panel import AttitudePanel
from darko_gcs.tui.widgets.decision_panel import DecisionPanel
from darko_gcs.tui.widgets.fleet_strip import FleetStrip
from darko_gcs.tui.widgets.flight_panel import FlightPanel
from darko_gcs.tui.widgets.hybrid_panel import HybridPanel
from darko_gcs.tui.widgets.map_panel import MapPanel
from darko_gcs.tui.widgets.message_panel import MessagePanel
from darko_gcs.tui.widgets.status_bar import StatusBar

__all__ = ["FlightScreen", "StripSize"]

TALL = 36  # screens with room for more lines of vehicles
FEW_LINES = {False: 4, True: 9}  # of the strip, by whether the screen is tall
MIN_PANELS = 14  # lines below which the panels give way to the strip


class StripSize(Enum):
    """How much of the vehicles' strip is shown, in the order of its key."""

    FEW = "few lines"
    ALL = "all vehicles"
    NONE = "none"


class FlightScreen(Screen[None]):
    """Panels that show one snapshot."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)
    fleet: reactive[tuple[Snapshot, ...]] = reactive((), repaint=False)  # all vehicles on the link
    strip: StripSize | None = None  # as the operator chose it

    def watch_snapshot(self, s: Snapshot) -> None:
        """Mark the values of a lost vehicle as old; leave no room for what another autopilot does not send."""
        self.set_class(s.lost, "-stale")
        self.set_class(s.source is not None and s.hybrid is None and bool(s.servos), "-foreign")

    def watch_fleet(self, before: tuple[Snapshot, ...], now: tuple[Snapshot, ...]) -> None:
        """Make room for a line per vehicle."""
        if len(before) != len(now):
            self._size_strip()

    def on_resize(self) -> None:
        """Make room anew."""
        self._size_strip()

    def change_strip(self) -> None:
        """Show a few lines of the strip, then all, then none."""
        sizes = list(StripSize)
        self.strip = sizes[(sizes.index(self._strip_size()) + 1) % len(sizes)]
        self._size_strip()

    def _strip_size(self) -> StripSize:
        """As chosen, or a few lines once there are several vehicles."""
        if self.strip is not None:
            return self.strip
        return StripSize.FEW if len(self.fleet) > 1 else StripSize.NONE

    def _size_strip(self) -> None:
        rows, few = self.size.height - 2, FEW_LINES[self.size.height >= TALL]  # without status bar and footer
        lines = {StripSize.FEW: min(few, len(self.fleet) + 1), StripSize.ALL: min(len(self.fleet) + 1, rows)}
        height = max(1, lines.get(self._strip_size(), 0))
        strip, panels = self.query_one(FleetStrip), self.query_one("#panels")
        strip.display = self._strip_size() is not StripSize.NONE
        strip.styles.height = height
        self.set_class(strip.display, "-fleet")
        panels.display = not strip.display or rows - height >= MIN_PANELS

    def compose(self) -> ComposeResult:
        """Status bar, panels, messages, footer."""
        yield StatusBar().data_bind(FlightScreen.snapshot, FlightScreen.now)
        yield FleetStrip().data_bind(FlightScreen.snapshot, FlightScreen.now, FlightScreen.fleet)
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
