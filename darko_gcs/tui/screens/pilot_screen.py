"""Flight by hand: keys or a gamepad as MANUAL_CONTROL in POSCTL, over the flight screen."""

from __future__ import annotations

import gc
import time
from collections.abc import Callable
from typing import ClassVar

from textual import events
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.widgets import Static

from darko_gcs.feed.gamepad import StickDevice
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.sticks import STICK_KEYS, STICK_PERIOD, KeySticks, Sticks
from darko_gcs.station.station import Station
from darko_gcs.tui.containment import Dialog
from protocol.names import Mode

SETTLING_TIME = 0.2  # of sticks before the mode is asked for: the vehicle refuses it without them [s]
ENTRY_TIME = 3.0  # within which the vehicle must have entered the mode [s]
MAX_KEY_AGE = 0.25  # of a press that still counts [s]
KEYS_HINT = (
    "arrows: forward, back, sideways   w s: climb, sink   a d: turn\n+ -: deflection   Space: centre   Esc: hold"
)
PAD_HINT = "left stick: climb, turn   right stick: forward, sideways\nEsc: hold"
AXES = (("forward", "back"), ("right", "left"), ("up", "down"), ("turn right", "turn left"))


class PilotScreen(Dialog[str]):
    """Sends the sticks while it is open, and never after: the vehicle then holds within COM_RC_LOSS_T (0.5 s).

    It closes with a text for the pilot; empty: the pilot closed it.

    Args:
        station: Of the vehicle.
        clock: The link's [s].
        read: What is known of the vehicle now.
        on_end: Called as it ends, before another screen is seen, with the last press of each key of the sticks [s].
        device: A gamepad; None: the keyboard.
    """

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape,q", "leave", "Hold", key_display="esc"),
        Binding("space", "centre", "Centre"),
        Binding("plus", "deflect(1)", "More"),
        Binding("minus", "deflect(-1)", "Less"),
    ]

    def __init__(
        self,
        station: Station,
        clock: Callable[[], float],
        read: Callable[[], Snapshot],
        *,
        on_end: Callable[[dict[str, float]], None],
        device: StickDevice | None = None,
    ) -> None:
        super().__init__()
        self._station, self._clock, self._read, self._device, self._on_end = station, clock, read, device, on_end
        self._began = clock()
        self._keys = KeySticks(self._began)
        self._pressed: dict[str, float] = {}  # last press of each key of the sticks, by the events' clock [s]
        self._has_asked = self._was_in = False  # for the mode; in the mode

    def compose(self) -> ComposeResult:
        """Mode, sticks, keys."""
        with Vertical(classes="dialog pilot"):
            yield Static("", id="pilot-mode", markup=False)
            yield Static("", id="pilot-sticks", markup=False)
            yield Static(KEYS_HINT if self._device is None else PAD_HINT, classes="hint")

    def on_mount(self) -> None:
        """Begin to send, after the one long search for garbage: what is there now is not searched while it flies."""
        gc.collect()
        gc.freeze()
        self._began = self._clock()
        self._keys.touch(self._began)
        self.send()
        self.set_interval(STICK_PERIOD, self.send)

    def on_unmount(self) -> None:
        """Let the gamepad go."""
        if self._device is not None:
            self._device.close()

    def send(self) -> None:
        """Send the sticks once, ask for the mode when the vehicle has them, end with the mode."""
        if not self.is_current:  # dismissed, or a question is above it: silence is the safe side
            return
        now, s = self._clock(), self._read()
        sticks = self._keys.sticks(now) if self._device is None else self._device.read()
        if sticks is None:
            self._end("The gamepad is gone: the vehicle holds")
            return
        if self._device is None and self._keys.time_left(now) <= 0.0:
            self._end("No key for 10 s: the vehicle holds")
            return
        self._station.steer(sticks, now)
        if not self._has_asked and now - self._began >= SETTLING_TIME:
            self._has_asked = True
            self._station.set_mode(Mode.POSCTL, now)
        self._follow_mode(s, now)
        self._show(s, sticks, now)

    def _follow_mode(self, s: Snapshot, now: float) -> None:
        is_in = s.status.mode == Mode.POSCTL.name
        if self._was_in and not is_in:
            self._end(f"The vehicle left POSCTL for {s.status.mode}: flight by hand has ended")
        elif not self._was_in and not is_in and now - self._began > ENTRY_TIME:
            last = f": {s.log.lines[-1].text}" if s.log.lines else ""
            self._end(f"The vehicle did not enter POSCTL{last}")
        self._was_in = self._was_in or is_in

    def _show(self, s: Snapshot, sticks: Sticks, now: float) -> None:
        is_in = s.status.mode == Mode.POSCTL.name
        mode = "POSCTL: you fly" if is_in else f"{s.status.mode}: waiting for POSCTL"
        by = f"keyboard, {self._keys.deflection:.0%}, holds in {self._keys.time_left(now):.0f} s without a key"
        by = by if self._device is None else self._device.name
        self.query_one("#pilot-mode", Static).update(f"BY HAND  {mode}  ({by})")
        told = [f"{names[value < 0.0]} {abs(value):.0%}" for names, value in zip(AXES, sticks, strict=True) if value]
        self.query_one("#pilot-sticks", Static).update("  ".join(told) or "sticks centred: it stops and holds")

    def _end(self, text: str) -> None:
        self._on_end(self._pressed)
        self.dismiss(text)

    # Keys

    def on_key(self, event: events.Key) -> None:
        """Deflect a stick, or show that the pilot is there; a key that waited was let go long ago."""
        if event.key in STICK_KEYS:
            self._pressed[event.key] = event.time
        if time.monotonic() - event.time > MAX_KEY_AGE:
            return
        self._keys.touch(self._clock())
        if event.key in STICK_KEYS:
            event.stop()
            self._keys.press(event.key, self._clock())
            self.send()

    def action_centre(self) -> None:
        """Let all sticks go."""
        self._keys.touch(self._clock())
        self._keys.centre()
        self.send()

    def action_deflect(self, step: int) -> None:
        """Deflect the sticks more or less."""
        self._keys.touch(self._clock())
        self._keys.change_deflection(step)

    def action_leave(self) -> None:
        """Have the vehicle hold, at once."""
        if self._read().status.mode == Mode.POSCTL.name:
            self._station.hold(self._clock())
        self._end("")
