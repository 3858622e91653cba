"""Before the flight: what the vehicle itself says that hinders arming."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import ClassVar

from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.reactive import reactive
from textual.widgets import Label, Static

from darko_gcs.state.arena import net_words
from darko_gcs.state.snapshot import EMPTY_SNAPSHOT, Snapshot
from darko_gcs.state.text import sensor_names
from darko_gcs.tui.containment import Dialog

TELLING_TIME = 2.0  # within which the vehicle says what it found [s]
HINDRANCE_TEXT = re.compile(r"(pre-?arm(?: checks)?|preflight fail|arming (?:refused|denied))[:\s]+", re.IGNORECASE)
MISSION_TEXT = "Mission would be denied: "
READY = "ready"


def hindrances(s: Snapshot, since: float) -> list[str]:
    """Reasons against arming, as the vehicle said since a time [s]."""
    lines = [line.text for line in s.log.lines if line.time >= since and HINDRANCE_TEXT.match(line.text)]
    told = [part for text in lines for part in HINDRANCE_TEXT.sub("", text, count=1).split("; ")]
    return list(dict.fromkeys(part for part in told if part != READY))


def mission_faults(s: Snapshot, since: float) -> list[str]:
    """Reasons why the vehicle would not fly its mission, as it said since a time [s]; it may be armed all the same."""
    told = [line.text for line in s.log.lines if line.time >= since and line.text.startswith(MISSION_TEXT)]
    return list(dict.fromkeys(told))


class PreflightScreen(Dialog[None]):
    """A list that follows the vehicle; ``r`` asks it again.

    Args:
        ask: Has the vehicle check itself.
        clock: The link's [s].
        snapshot: What is known of the vehicle.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,i,q", "dismiss", "Close", key_display="esc"),
        Binding("r", "ask", "Ask again"),
    ]
    snapshot: reactive[Snapshot] = reactive(EMPTY_SNAPSHOT, repaint=False)
    now: reactive[float] = reactive(0.0, repaint=False)

    def __init__(self, ask: Callable[[], None], clock: Callable[[], float], snapshot: Snapshot) -> None:
        super().__init__()
        self._ask, self._clock, self._asked_at = ask, clock, clock()
        self.set_reactive(PreflightScreen.snapshot, snapshot)

    def compose(self) -> ComposeResult:
        """Verdict and list."""
        with Vertical(classes="dialog"):
            yield Label("Before the flight", id="question", markup=False)
            yield Static("", id="preflight", markup=False)
            yield Static("r: ask again    Esc: close", classes="hint")

    def on_mount(self) -> None:
        """Ask the vehicle."""
        self.action_ask()

    def action_ask(self) -> None:
        """Have the vehicle check itself, unless it is armed: it refuses then."""
        self._asked_at = self._clock()
        if not self.snapshot.status.armed:
            self._ask()
        self._show()

    def watch_snapshot(self) -> None:
        """Show what the vehicle said."""
        self.watch_now()

    def watch_now(self) -> None:
        """Show what came since."""
        if self.is_mounted:
            self._show()

    def _show(self) -> None:
        s = self.snapshot
        found = hindrances(s, self._asked_at)
        if s.status.armed:
            verdict = "ARMED already: the vehicle checks itself before it is armed"
        elif found or s.status.prearm_ok is False:
            verdict = "NOT READY to arm"
        elif s.status.prearm_ok:
            verdict = "Ready to arm"
        else:
            verdict = "The vehicle does not say whether it is ready"
        waits = not found and s.status.prearm_ok is False
        late = "it does not say why" if self._clock() - self._asked_at > TELLING_TIME else "asking why ..."
        rows = [f"✗ {text}" for text in found] or ([late] if waits else [])
        rows += [f"! {text}" for text in mission_faults(s, self._asked_at)]
        rows += [f"! {name}: not healthy" for name in sensor_names(s.status.unhealthy)]
        rows += [f"  {words}"] if (words := net_words(s)) else []
        self.query_one("#preflight", Static).update("\n".join([verdict, *rows]))
