"""The top line: which vehicle, its state, and the link."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import command_name
from darko_gcs.state.values import VTOL_LABELS, SigningState
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect import mavlink
from protocol.endpoint_ground import GROUND_SYSTEM

__all__ = ["StatusBar"]

LANDED_LABELS = {
    mavlink.MAV_LANDED_STATE_ON_GROUND: "on ground",
    mavlink.MAV_LANDED_STATE_IN_AIR: "in air",
    mavlink.MAV_LANDED_STATE_TAKEOFF: "taking off",
    mavlink.MAV_LANDED_STATE_LANDING: "landing",
}
MISSION_LABELS = {
    mavlink.MISSION_STATE_NOT_STARTED: "mission ready",
    mavlink.MISSION_STATE_ACTIVE: "mission",
    mavlink.MISSION_STATE_PAUSED: "mission paused",
    mavlink.MISSION_STATE_COMPLETE: "mission done",
}
SIGNING_SEGMENTS = {
    SigningState.PRIVATE: ("", ""),
    SigningState.OPEN: (" UNSIGNED ", "warn"),
    SigningState.SIGNED: (" signed ", "good"),
    SigningState.NO_KEY: (" vehicle signs, no key here ", "warn"),
    SigningState.UNSIGNED_VEHICLE: (" VEHICLE NOT SIGNED ", "bad"),
}
MAX_HEARTBEAT_AGE = 2.0  # before the link counts as lost [s]
LOW_BATTERY, EMPTY_BATTERY = 0.25, 0.1  # shares left
MAX_NORMAL_LOSS = 0.02  # share of frames
HINT_WIDTH, KEY_HINT_WIDTH, BATTERY_WIDTH = 71, 81, 110  # of the screen that leaves room for these [cells]
MAX_PERCENT = 100  # a larger progress is unknown


class StatusBar(Panel):
    """Vehicle, mode, arming, link. Redrawn as ages change."""

    def __init__(self, id: str = "status") -> None:  # noqa: A002 - textual's own name for it
        super().__init__("", id=id)

    def watch_now(self) -> None:
        """Redraw: ages change without a new snapshot."""
        self.redraw()

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - one line
        """One line."""
        if s.source is None:
            return [_no_vehicle(s, width)]
        age = s.age(self.now) or 0.0
        if s.lost or age > MAX_HEARTBEAT_AGE:
            lost = (f" LINK LOST  vehicle silent for {age:.0f} s ", "bad")
            return [styled_line(lost, _mode(s), _signing(s))]
        armed = (" ARMED ", "bad") if s.armed else (" disarmed ", "good" if s.prearm_ok is not False else "warn")
        return [
            styled_line(
                (f" {s.source[0]}/{s.source[1]} ", "label"), armed, _mode(s),
                (" NOT RECORDING " if s.unrecorded else "", "bad"), (_alarm(s), "bad"),
                (f" {_flight_state(s)} ", ""),
                _battery(s, width), _progress(s), _mission(s), _control(s), _link(s), _signing(s),
            )
        ]  # fmt: skip


def _no_vehicle(s: Snapshot, width: int) -> StyledLine:
    if s.signing is SigningState.UNSIGNED_VEHICLE:
        hint = "  the vehicle does not use our key" + (" (--give-key)" if width >= KEY_HINT_WIDTH else "")
        return styled_line((" DarkO ", ""), SIGNING_SEGMENTS[s.signing], (hint, "dim"))
    hint = "  (start one with darko-sitl, or use --sitl)" if width >= HINT_WIDTH else ""
    return styled_line((" DarkO  waiting for a vehicle", "warn"), (hint, "dim"))


def _mode(s: Snapshot) -> tuple[str, str]:
    return (f" {s.mode or '?'} ", "accent")


def _alarm(s: Snapshot) -> str:
    if s.crashed:
        return " CRASHED "
    return " FAILSAFE " if s.critical else ""


def _flight_state(s: Snapshot) -> str:
    if s.crashed:
        return "a reboot stands it up"
    if not s.armed and s.prearm_ok is False:
        return "not ready to arm"
    landed = LANDED_LABELS.get(s.landed_state, "")
    vtol = VTOL_LABELS.get(s.vtol_state, "") if s.landed_state == mavlink.MAV_LANDED_STATE_IN_AIR else ""
    return f"{landed}, {vtol}" if vtol else landed


def _mission(s: Snapshot) -> tuple[str, str]:
    if s.transfer is not None:
        direction, done, total = s.transfer
        return (f" {direction} {done}/{total} ", "warn")
    if not s.mission_count or s.mission_state not in MISSION_LABELS:
        return ("", "")
    at = f" {s.mission_current}/{s.mission_count - 1}" if s.mission_state != mavlink.MISSION_STATE_COMPLETE else ""
    return (f" {MISSION_LABELS[s.mission_state]}{at} ", "")


def _battery(s: Snapshot, width: int) -> tuple[str, str]:
    """Charge left: always if it is low, else if there is room."""
    if s.battery is None or (s.battery > LOW_BATTERY and width < BATTERY_WIDTH):
        return ("", "")
    style = "bad" if s.battery <= EMPTY_BATTERY else "warn" if s.battery <= LOW_BATTERY else "dim"
    return (f" battery {100 * s.battery:.0f} % ", style)


def _progress(s: Snapshot) -> tuple[str, str]:
    command = s.in_progress
    if command is None:
        return ("", "")
    done = f" {command.progress} %" if command.progress <= MAX_PERCENT else ""
    return (f" {command_name(command.command)}{done} ", "warn")


def _control(s: Snapshot) -> tuple[str, str]:
    if s.in_control == GROUND_SYSTEM:
        asked_by = s.control_asked_by
        return (f" {asked_by} ASKS FOR CONTROL ", "warn") if asked_by else (" in control ", "good")
    return (f" {s.in_control} IN CONTROL ", "warn") if s.in_control else ("", "")


def _signing(s: Snapshot) -> tuple[str, str]:
    text, style = SIGNING_SEGMENTS[s.signing]
    return (f"{text}{s.refused} refused ", "warn") if s.refused and style != "bad" else (text, style)


def _link(s: Snapshot) -> tuple[str, str]:
    rate = "" if math.isnan(s.rate) else f"{s.rate:.0f}/s"
    return (f" {rate} loss {100 * s.loss:.1f} % ", "warn" if s.loss > MAX_NORMAL_LOSS else "dim")
