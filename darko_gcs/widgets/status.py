"""The line at the top: who, in what state, over what link."""

from __future__ import annotations

import math

from darko_gcs.signing import Signing
from darko_gcs.snapshot import VTOL, Snapshot
from darko_gcs.store import command_name
from darko_gcs.widgets.panel import Line, Panel, text_line
from protocol.dialect import mavlink
from protocol.endpoint import GROUND_SYSTEM

__all__ = ["StatusBar"]

LANDED = {1: "on ground", 2: "in air", 3: "taking off", 4: "landing"}
MISSION = {2: "mission ready", 3: "mission", 4: "mission paused", 5: "mission done"}
IN_AIR = mavlink.MAV_LANDED_STATE_IN_AIR
SIGNING = {
    Signing.PRIVATE: ("", ""),
    Signing.OPEN: (" UNSIGNED ", "warn"),
    Signing.SIGNED: (" signed ", "good"),
    Signing.NO_KEY: (" vehicle signs, no key here ", "warn"),
    Signing.UNSIGNED_VEHICLE: (" VEHICLE NOT SIGNED ", "bad"),
}
STALE = 2.0  # [s] without a heartbeat
LOW, EMPTY = 0.25, 0.1  # shares of the battery that are worth a word
ROOMY = 110  # cells
WHOLE = 100  # percent; more says that the vehicle does not know


class StatusBar(Panel):
    """Vehicle, mode, arming, link. Redrawn as ages change."""

    def __init__(self, id: str = "status") -> None:  # noqa: A002 - textual's own name for it
        super().__init__("", id=id)

    def watch_now(self) -> None:
        """Ages move without a snapshot."""
        self.redraw()

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:  # noqa: ARG002 - one line
        """One line."""
        if s.source is None and s.signing is Signing.UNSIGNED_VEHICLE:
            hint = "  a vehicle is there, but not with our key" + (" (--give-key)" if width > 80 else "")
            return [text_line((" DarkO ", ""), SIGNING[s.signing], (hint, "dim"))]
        if s.source is None:
            waiting = "waiting for a vehicle"
            hint = "  (start one with darko-sitl, or use --sitl)" if width > 70 else ""
            return [text_line((f" DarkO  {waiting}", "warn"), (hint, "dim"))]
        age = s.age(self.now) or 0.0
        if s.lost or age > STALE:
            return [text_line((f" LINK LOST  vehicle silent for {age:.0f} s ", "bad"), self._mode(s), self._signing(s))]
        armed = (" ARMED ", "bad") if s.armed else (" disarmed ", "good" if s.prearm_ok is not False else "warn")
        return [
            text_line(
                (f" {s.source[0]}/{s.source[1]} ", "label"), armed, self._mode(s),
                (" NOT RECORDING " if s.unrecorded else "", "bad"), (" FAILSAFE " if s.critical else "", "bad"),
                (f" {self._state(s)} ", ""),
                self._battery(s, width), self._progress(s), self._mission(s), self._control(s), self._link(s),
                self._signing(s),
            )
        ]  # fmt: skip

    def _mode(self, s: Snapshot) -> tuple[str, str]:
        return (f" {s.mode or '?'} ", "accent")

    def _state(self, s: Snapshot) -> str:
        if not s.armed and s.prearm_ok is False:
            return "not ready to arm"
        words = LANDED.get(s.landed_state, "")
        way = VTOL.get(s.vtol_state, "") if s.landed_state == IN_AIR else ""
        return f"{words}, {way}" if way else words

    def _mission(self, s: Snapshot) -> tuple[str, str]:
        if s.transfer is not None:
            direction, done, total = s.transfer
            return (f" {direction} {done}/{total} ", "warn")
        if not s.mission_count or s.mission_state not in MISSION:
            return ("", "")
        at = f" {s.mission_current}/{s.mission_count - 1}" if s.mission_state != mavlink.MISSION_STATE_COMPLETE else ""
        return (f" {MISSION[s.mission_state]}{at} ", "")

    def _battery(self, s: Snapshot, width: int) -> tuple[str, str]:
        """Share left: always when it is low, else where there is room."""
        if s.battery is None or (s.battery > LOW and width < ROOMY):
            return ("", "")
        return (
            f" battery {100 * s.battery:.0f} % ",
            "bad" if s.battery <= EMPTY else "warn" if s.battery <= LOW else "dim",
        )

    def _progress(self, s: Snapshot) -> tuple[str, str]:
        working = s.in_progress
        if working is None:
            return ("", "")
        done = f" {working.progress} %" if working.progress <= WHOLE else ""
        return (f" {command_name(working.command)}{done} ", "warn")

    def _control(self, s: Snapshot) -> tuple[str, str]:
        if s.in_control == GROUND_SYSTEM:
            asks = s.asks_for_control
            return (f" {asks} ASKS FOR CONTROL ", "warn") if asks else (" in control ", "good")
        return (f" {s.in_control} IN CONTROL ", "warn") if s.in_control else ("", "")

    def _signing(self, s: Snapshot) -> tuple[str, str]:
        text, style = SIGNING[s.signing]
        return (f"{text}refused {s.refused} ", "warn") if s.refused and style != "bad" else (text, style)

    def _link(self, s: Snapshot) -> tuple[str, str]:
        rate = "" if math.isnan(s.rate) else f"{s.rate:.0f}/s"
        return (f" {rate} loss {100 * s.loss:.1f} % ", "warn" if s.loss > 0.02 else "dim")
