"""The flight screen: the whole flight on one screen, from 80x24 upwards."""

from __future__ import annotations

from enum import Enum
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Container, Vertical
from textual.geometry import Size
from textual.reactive import reactive

from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.tui.containment import StationScreen, on
from darko_gcs.tui.key_footer import KeyFooter
from darko_gcs.tui.map_panel import MapPanel
from darko_gcs.tui.widgets.flight_panel import DecisionPanel, FlightPanel, TruthPanel
from darko_gcs.tui.widgets.hybrid_panel import ActuatorPanel, AttitudePanel, HybridPanel
from darko_gcs.tui.widgets.panel import MessagePanel, Panel
from darko_gcs.tui.widgets.plan_panels import FlownPlan, PlanBlockList
from darko_gcs.tui.widgets.status_bar import FleetStrip, StatusBar

VAST = Size(180, 52)  # [cells]
OPTIONAL_PANELS = {  # that the operator may hide, and what they are called
    "actuators": "actuators",
    "decision": "decision on the leg",
    "truth": "estimate against truth",
    "flight-plan": "flight plan",
}
TALL = 36  # screens with room for more lines of vehicles
FEW_LINES = {False: 4, True: 9}  # of the strip, by whether the screen is tall
MIN_PANELS = 14  # lines below which the panels give way to the strip


class StripSize(Enum):
    """Shown part of the vehicles' strip, in the order of its key."""

    FEW = "few lines"
    ALL = "all vehicles"
    NONE = "none"


class FlightScreen(StationScreen[None]):
    """Panels that show one snapshot; ``hidden`` has the optional ones that the operator does not want."""

    HORIZONTAL_BREAKPOINTS = [(0, "-narrow"), (120, "-wide")]  # noqa: RUF012 - declared so by Textual
    VERTICAL_BREAKPOINTS = [(0, "-short"), (36, "-tall")]  # noqa: RUF012
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding(
            "shift+up",
            "pan(0, 1)",
            "Map: move the view",
            show=False,
            key_display="shift+arrows",
            tooltip="Move the map",
        ),
        Binding("shift+down", "pan(0, -1)", show=False),
        Binding("shift+right", "pan(1, 0)", show=False),
        Binding("shift+left", "pan(-1, 0)", show=False),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)  # else every panel is painted again
    now: reactive[float] = reactive(0.0, repaint=False)
    fleet: reactive[tuple[Snapshot, ...]] = reactive((), repaint=False)  # all vehicles on the link
    strip: StripSize | None = None  # as the operator chose it

    def __init__(self) -> None:
        super().__init__()
        self.hidden: frozenset[str] = frozenset()
        self._panels: list[Panel] = []
        self._frame = 0  # counted
        self._map = MapPanel("Map", id="map")
        self._truth, self._plan = TruthPanel("Estimate against truth", id="truth"), FlownPlan(id="flight-plan")

    def show_snapshot(self, s: Snapshot, now: float, fleet: tuple[Snapshot, ...]) -> None:
        """Show a snapshot at a time [s], and all vehicles on the link."""
        self.now, self.snapshot, self.fleet = now, s, fleet
        self._map.fleet = fleet
        self._frame += 1
        for turn, panel in enumerate(self._panels):  # those that skip frames take turns
            panel.show_snapshot(s, now, is_due=(self._frame + turn) % panel.FRAMES == 0)

    def watch_snapshot(self, s: Snapshot) -> None:
        """Mark the values of a lost vehicle as old; leave no room for what this vehicle does not send."""
        is_darko = s.is_darko
        wanted = {
            "-stale": s.link.lost,
            "-foreign": s.identity.source is not None and not is_darko and bool(s.actuation.servos),
            "-truthful": s.estimates.truth is not None or (is_darko and not s.session.is_replay),
            "-planned": s.flight_plan is not None,
        }
        for name, is_on in wanted.items():
            if is_on is not self.has_class(name):
                self.set_class(is_on, name)
        self._plan.show(s, self.now)

    @on(events.Resize)
    def _use_room(self) -> None:
        """A vast screen has panels that no other has room for."""
        self.set_class(self.size.width >= VAST.width and self.size.height >= VAST.height, "-vast")
        self._size_strip()

    @property
    def shows_truth(self) -> bool:
        """Whether the truth is compared on the screen, and has to be asked for."""
        return self._truth.is_mounted and self._truth.display

    def show_panels(self, hidden: frozenset[str]) -> None:
        """Hide these optional panels, show the others where there is room."""
        self.hidden = hidden
        for name in OPTIONAL_PANELS:
            self.set_class(name in hidden, f"-no-{name}")

    def action_pan(self, east: int, north: int) -> None:
        """Move the map."""
        self._map.pan(east, north)

    @on(PlanBlockList.Chosen)
    def _open_plan(self) -> None:
        """A click on the flight plan opens its screen, where its blocks are entered."""
        self.app.call_later(self.app.run_action, "act('flight_plan')")

    def watch_fleet(self, before: tuple[Snapshot, ...], now: tuple[Snapshot, ...]) -> None:
        """Make room for a line per vehicle."""
        if len(before) != len(now):
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
        if not self.query(FleetStrip):  # recordings have none
            return
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
        yield self._shown(StatusBar())
        yield self._shown(FleetStrip().data_bind(FlightScreen.fleet))
        with Container(id="panels"):
            with Vertical(id="left"):
                yield self._shown(HybridPanel("Hybrid controller", id="hybrid"))
                yield self._shown(ActuatorPanel("Actuators", id="actuators"))
                yield self._shown(MessagePanel("Messages", id="messages"))
            with Container(id="right"):
                with Vertical(id="numbers"):
                    yield self._shown(AttitudePanel("Attitude", id="attitude"))
                    yield self._shown(FlightPanel("Flight", id="flight"))
                    yield self._shown(DecisionPanel("Decision", id="decision"))
                    yield self._shown(self._truth)
                with Vertical(id="places"):
                    yield self._shown(self._map)
                    yield self._plan
        yield KeyFooter()

    def _shown(self, panel: Panel) -> Panel:
        self._panels.append(panel)
        return panel
