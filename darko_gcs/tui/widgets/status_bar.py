"""The top line: which vehicle, its state, and the link."""

from __future__ import annotations

import math

from darko_gcs.state.command_words import pilot_words
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted
from darko_gcs.state.values import VTOL_LABELS, SigningState, Simulator
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GROUND_SYSTEM
from protocol.names import Mode
from protocol.wire.message import Source

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
MIN_TO_GO = 2.0  # to a target, from which on the vehicle is on its way there [m]
MIN_CLOSING = 0.5  # share of its speed at which it comes nearer then
HINT_WIDTH, KEY_HINT_WIDTH = 71, 81  # of the screen that leaves room for these [cells]
STAGE_WIDTH = 100  # of the screen that leaves room for the word [cells]
MAX_BLOCK_NAME = 14  # of a flight plan that fits [cells]
TURNS, TURNS_PER_SECOND = "⠋⠙⠹⠸⠼⠴⠦⠧⠇⠏", 10
MAX_PERCENT = 100  # a larger progress is unknown


class StatusBar(Panel):
    """Vehicle, mode, arming, link. Redrawn as ages change."""

    def __init__(self, id: str = "status") -> None:  # noqa: A002 - textual's own name for it
        super().__init__("", id=id)
        self._starting_at: float | None = None  # since when the simulator has been starting [s]

    def watch_now(self) -> None:
        """Redraw: ages change without a new snapshot."""
        self.redraw()

    def _starting(self, width: int) -> StyledLine:
        """A sign that moves, and for how long it has: the first start compiles."""
        self._starting_at = self.now if self._starting_at is None else self._starting_at
        waited = max(0.0, self.now - self._starting_at)
        turn = TURNS[int(waited * TURNS_PER_SECOND) % len(TURNS)]
        hint = "  (the first start compiles for a minute)" if width >= HINT_WIDTH else ""
        return styled_line((f" {turn} starting darko-sitl, {waited:.0f} s", "accent"), (hint, "dim"))

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - one line
        """One line."""
        if s.source is None:
            return [self._starting(width) if s.simulator is Simulator.STARTING else _no_vehicle(s, width)]
        age = s.age(self.now) or 0.0
        if s.lost or age > MAX_HEARTBEAT_AGE:
            lost = (f" LINK LOST  vehicle silent for {age:.0f} s ", "bad")
            ended = " Ctrl+R restarts darko-sitl " if s.simulator is Simulator.ENDED else ""
            segments = [(0, lost), (2, _mode(s)), (1, (ended, "warn")), (0, _recording(s)), (3, _signing(s))]
            return [_fitting(segments, width)]
        armed = (" ARMED ", "bad") if s.armed else (" disarmed ", "good" if s.prearm_ok is not False else "warn")
        segments = [
            (8, (f" {_name(s.source)} ", "label")), (0, armed), (0, _mode(s)), (0, (_alarm(s), "bad")),
            (1, (_flight_state(s), "")), (0, _battery(s)), (3, _progress(s)), (2, _mission(s, width)),
            (4, _control(s)), (0, _link(s)), (7, _loss(s)), (5, _signing(s)), (0, _recording(s)),
        ]  # fmt: skip
        return [_fitting(segments, width)]


def _name(source: Source) -> str:
    """A vehicle by its system id; the component only if it is none that autopilots have."""
    system, component = source
    return f"vehicle {system}" if component == mavlink.MAV_COMP_ID_AUTOPILOT1 else f"vehicle {system}/{component}"


def _fitting(segments: list[tuple[int, tuple[str, str]]], width: int) -> StyledLine:
    """The segments, each behind its rank, without those of the highest rank if there is no room; 0 always stays."""
    kept = list(segments)
    while sum(len(text) for _, (text, _) in kept) > width:
        rank = max((rank for rank, (text, _) in kept if text), default=0)
        if not rank:
            break
        kept = [(other, segment) for other, segment in kept if other != rank]
    return styled_line(*(segment for _, segment in kept))


def _recording(s: Snapshot) -> tuple[str, str]:
    if s.sends_to:
        return (f" REPLAY, SENT TO {s.sends_to} ", "warn")
    if s.is_replay:
        return (" REPLAY ", "accent")
    return (" NOT RECORDING ", "bad") if s.unrecorded else (" REC ", "dim")


def _no_vehicle(s: Snapshot, width: int) -> StyledLine:
    if s.is_replay:
        return styled_line((" DarkO  no vehicle in the recording so far", "dim"), _recording(s))
    if s.simulator is Simulator.ENDED:
        return styled_line((" DarkO  darko-sitl has ended", "bad"), ("  Ctrl+R restarts it", "accent"))
    if s.signing is SigningState.UNSIGNED_VEHICLE:
        hint = "  the vehicle does not use our key" + (" (--give-key)" if width >= KEY_HINT_WIDTH else "")
        return styled_line((" DarkO ", ""), SIGNING_SEGMENTS[s.signing], (hint, "dim"))
    hint = "  (start one with darko-sitl, or use --sitl)" if width >= HINT_WIDTH else ""
    return styled_line((" DarkO  waiting for a vehicle", "accent"), (hint, "dim"))


def _mode(s: Snapshot) -> tuple[str, str]:
    to_go = f", {_to_go(s):.0f} m to go" if _is_going(s) else ""
    return (f" {s.mode or '?'}{to_go} ", "accent")


def _to_go(s: Snapshot) -> float:
    """Distance to the target [m]; 0 if it is not known."""
    return 0.0 if s.p is None or s.goal is None else math.dist(s.p, s.goal)


def _is_going(s: Snapshot) -> bool:
    """True on the way to a point in HOLD: a vehicle that circles has a target, too, but does not come nearer."""
    is_transition = s.in_progress is not None and s.in_progress.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION
    if s.mode != Mode.HOLD.name or is_transition or not s.is_airborne or s.p is None or s.goal is None or s.v is None:
        return False
    distance = _to_go(s)
    if distance < MIN_TO_GO or not math.isfinite(distance):
        return False
    closing = sum(v * (goal - p) for v, goal, p in zip(s.v, s.goal, s.p, strict=True)) / distance
    return s.vtol_state == mavlink.MAV_VTOL_STATE_MC or closing > MIN_CLOSING * math.hypot(*s.v)


def _alarm(s: Snapshot) -> str:
    if s.crashed:
        return " CRASHED "
    return " FAILSAFE " if s.critical else ""


def _flight_state(s: Snapshot) -> str:
    if s.crashed:
        return " reboot to reset "
    if not s.armed and s.prearm_ok is False:
        return " not ready to arm "
    landed = LANDED_LABELS.get(s.landed_state, "")
    vtol = VTOL_LABELS.get(s.vtol_state, "") if s.landed_state == mavlink.MAV_LANDED_STATE_IN_AIR else ""
    state = f"{landed}, {vtol}" if vtol else landed
    return f" {state} " if state else ""


def _mission(s: Snapshot, width: int) -> tuple[str, str]:
    if s.transfer is not None:
        direction, done, total = s.transfer
        return (f" {direction} {done}/{total} ", "accent")
    if s.mode == Mode.FLIGHT_PLAN.name:  # the mission is then its present leg
        plan = s.flight_plan
        if plan is None:
            return ("", "")
        between = ", stage " if width >= STAGE_WIDTH else "/"
        return (f" {plan.block_name(plan.block)[:MAX_BLOCK_NAME]}{between}{plan.stage} ", "")
    if not s.mission_count or s.mission_state not in MISSION_LABELS:
        return ("", "")
    at = f" {s.mission_current}/{s.mission_count - 1}"
    if s.mission_state == mavlink.MISSION_STATE_COMPLETE:
        at = ""
    elif s.mission_state == mavlink.MISSION_STATE_NOT_STARTED:
        at = f" from item {s.mission_current}" if s.mission_current else f", {counted(s.mission_count, 'item')}"
    return (f" {MISSION_LABELS[s.mission_state]}{at} ", "")


def _battery(s: Snapshot) -> tuple[str, str]:
    if s.charge_left is None:
        return (" battery -- " if s.battery_voltage is None else f" battery {s.battery_voltage:.1f} V ", "dim")
    return (f" battery {100 * s.charge_left:.0f} % ", charge_style(s.charge_left, "dim"))


def charge_style(left: float, usual: str) -> str:
    """Style of a share of charge: a warning when it is low, bad when the battery is nearly empty."""
    return "bad" if left <= EMPTY_BATTERY else "warn" if left <= LOW_BATTERY else usual


def _progress(s: Snapshot) -> tuple[str, str]:
    command = s.in_progress
    if command is None:
        return ("", "")
    done = f" {command.progress} %" if command.progress <= MAX_PERCENT else ""
    return (f" {pilot_words(command.command)}{done} ", "accent")


def _control(s: Snapshot) -> tuple[str, str]:
    if s.in_control == GROUND_SYSTEM:
        asked_by = s.control_asked_by
        return (f" {asked_by} ASKS FOR CONTROL ", "warn") if asked_by else (" in control ", "good")
    return (f" {s.in_control} IN CONTROL ", "warn") if s.in_control else ("", "")


def _signing(s: Snapshot) -> tuple[str, str]:
    text, style = SIGNING_SEGMENTS[s.signing]
    return (f"{text}{s.refused} refused ", "warn") if s.refused and style != "bad" else (text, style)


def _link(s: Snapshot) -> tuple[str, str]:
    """Messages per second, and the loss instead if it is not normal."""
    if s.is_replay:
        return ("", "")
    if s.loss > MAX_NORMAL_LOSS:
        return (f" loss {100 * s.loss:.1f} % ", "warn")
    return (" link --/s " if math.isnan(s.rate) else f" link {s.rate:.0f}/s ", "dim")


def _loss(s: Snapshot) -> tuple[str, str]:
    is_shown = not s.is_replay and s.loss <= MAX_NORMAL_LOSS
    return (f" loss {100 * s.loss:.1f} % ", "dim") if is_shown else ("", "")
