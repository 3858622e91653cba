"""The top line: which vehicle, its state, and the link; below it a line for each vehicle on the link."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from textual import events
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.state.lasting_faults import lasting_faults
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import counted, pilot_words, vehicle_name
from darko_gcs.state.values import VTOL_LABELS, LogLine, SigningState, Simulator
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.tools.option_values import STATION_PORT

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

    def watch_now(self) -> None:
        """Redraw: ages change without a new snapshot."""
        self.redraw()

    def _starting(self, s: Snapshot, width: int) -> StyledLine:
        """A sign that moves, and for how long it has: the first start compiles."""
        waited = max(0.0, self.now - s.session.simulator_since)
        turn = TURNS[int(waited * TURNS_PER_SECOND) % len(TURNS)]
        hint = "  (the first start compiles for some minutes)" if width >= HINT_WIDTH else ""
        return styled_line((f" {turn} starting darko-sitl, {waited:.0f} s", "accent"), (hint, "dim"))

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - one line
        """One line."""
        if s.identity.source is None:
            return [self._starting(s, width) if s.session.simulator is Simulator.STARTING else _no_vehicle(s, width)]
        age = s.link.age(self.now) or 0.0
        if s.link.lost or age > MAX_HEARTBEAT_AGE:
            lost = (f" LINK LOST  vehicle silent for {age:.0f} s ", "bad")
            ended = " Ctrl+R restarts darko-sitl " if s.session.simulator is Simulator.ENDED else ""
            name = f" {vehicle_name(s.identity.source)} " if s.session.vehicles > 1 else ""
            segments = [
                (0, (name, "label")),
                (0, (_alerts(s), "bad")),
                (0, lost),
                (2, _mode(s)),
                (1, (ended, "warn")),
                (0, _recording(s)),
                (3, _signing(s)),
            ]
            return [_fitting(segments, width)]
        armed = (
            (" ARMED ", "bad")
            if s.status.armed
            else (" disarmed ", "good" if s.status.prearm_ok is not False else "warn")
        )
        segments = [
            (0 if s.session.vehicles > 1 else 8, (f" {vehicle_name(s.identity.source)} ", "label")),
            (0, (_alerts(s), "bad")), (0, armed), (0, _mode(s)),
            (0, (_alarm(s), "bad")),
            (1, (_faults(s, width), "warn")),
            (1, (_flight_state(s), "")), (0, _battery(s)), (3, _progress(s)), (2, _mission(s, width)),
            (4, _control(s)), (6, _speed(s)), (3 if s.link.loss <= MAX_NORMAL_LOSS else 0, _link(s)), (7, _loss(s)),
            (5, _signing(s)), (0, _recording(s)),
        ]  # fmt: skip
        return [_fitting(segments, width)]


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
    if s.session.sends_to:
        return (f" REPLAY, SENT TO {s.session.sends_to} ", "warn")
    if s.session.is_replay:
        return (" REPLAY ", "accent")
    return (" NOT RECORDING ", "bad") if s.session.unrecorded else (" REC ", "dim")


def _no_vehicle(s: Snapshot, width: int) -> StyledLine:
    if s.session.is_replay:
        return styled_line((" DarkO  no vehicle in the recording so far", "dim"), _recording(s))
    if s.session.simulator is Simulator.ENDED:
        return styled_line((" DarkO  darko-sitl has ended", "bad"), ("  Ctrl+R restarts it", "accent"))
    if s.link.signing is SigningState.UNSIGNED_VEHICLE:
        hint = "  the vehicle does not use our key" + (" (--give-key)" if width >= KEY_HINT_WIDTH else "")
        return styled_line((" DarkO ", ""), SIGNING_SEGMENTS[s.link.signing], (hint, "dim"))
    hint = _start_hint(s.session.port) if width >= HINT_WIDTH else ""
    return styled_line((" DarkO  waiting for a vehicle", "accent"), (hint, "dim"))


def _start_hint(port: int) -> str:
    """The command that starts a vehicle for a station that listens on a port; 0: it connects out."""
    if not port:
        return "  (nothing has answered yet)"
    return (
        f"  (start one: darko-sitl --gcs-port {port})"
        if port != STATION_PORT
        else "  (start one: darko-sitl, or use --sitl)"
    )


def _mode(s: Snapshot) -> tuple[str, str]:
    to_go = f", {_to_go(s):.0f} m to go" if is_going(s) else ""
    return (f" {s.status.mode or '?'}{to_go} ", "accent")


def _to_go(s: Snapshot) -> float:
    """Distance to the target [m]; 0 if it is not known."""
    return 0.0 if s.position.p is None or s.goal is None else math.dist(s.position.p, s.goal)


def is_going(s: Snapshot) -> bool:
    """True on the way to a point in HOLD: a vehicle that circles has a target, too, but does not come nearer."""
    is_transition = (
        s.operator.in_progress is not None and s.operator.in_progress.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION
    )
    if (
        s.status.mode != Mode.HOLD.name
        or is_transition
        or not s.status.is_airborne
        or s.position.p is None
        or s.goal is None
        or s.position.v is None
    ):
        return False
    distance = _to_go(s)
    if distance < MIN_TO_GO or not math.isfinite(distance):
        return False
    closing = sum(v * (goal - p) for v, goal, p in zip(s.position.v, s.goal, s.position.p, strict=True)) / distance
    return s.status.vtol_state == mavlink.MAV_VTOL_STATE_MC or closing > MIN_CLOSING * math.hypot(*s.position.v)


def _alarm(s: Snapshot) -> str:
    if s.hybrid.crashed:
        return " CRASHED "
    return " FAILSAFE " if s.status.critical else ""


def _alerts(s: Snapshot) -> str:
    """Kinds of the alerts that the pilot has not said to have seen (A); of one that is past it is said."""
    present = dict.fromkeys(alert.kind for alert in s.session.alerts if alert.over is None)
    past = dict.fromkeys(alert.kind for alert in s.session.alerts if alert.kind not in present)
    kinds = [*present, *(f"{kind} (over)" for kind in past)]
    return f" !{','.join(kinds)} " if kinds else ""


def _faults(s: Snapshot, width: int) -> str:
    """Faults, quietly: an alert called for it, and was seen; those without room are in the pre-flight list."""
    faults = lasting_faults(s)
    if width >= STAGE_WIDTH or len(faults) < 2:
        return f" {', '.join(faults)} " if faults else ""
    return f" {faults[0]} +{len(faults) - 1} (i) "


def _flight_state(s: Snapshot) -> str:
    if s.hybrid.crashed:
        return "" if s.session.is_replay else " Ctrl+R to reset "
    if not s.status.armed and s.status.prearm_ok is False:
        return " not ready to arm "
    landed = LANDED_LABELS.get(s.status.landed_state, "")
    vtol = VTOL_LABELS.get(s.status.vtol_state, "") if s.status.landed_state == mavlink.MAV_LANDED_STATE_IN_AIR else ""
    state = f"{landed}, {vtol}" if vtol else landed
    return f" {state} " if state else ""


def _mission(s: Snapshot, width: int) -> tuple[str, str]:
    if s.plans.transfer is not None:
        direction, done, total = s.plans.transfer
        return (f" {direction} {done}/{total} ", "accent")
    if s.status.mode == Mode.FLIGHT_PLAN.name:  # the mission is then its present leg
        plan = s.flight_plan
        if plan is None:
            return ("", "")
        between = ", stage " if width >= STAGE_WIDTH else "/"
        return (f" {plan.block_name(plan.block)[:MAX_BLOCK_NAME]}{between}{plan.stage} ", "")
    if not s.mission.total or s.mission.state not in MISSION_LABELS:
        return ("", "")
    current, last = s.mission.current, s.mission.total - 1  # counted from 0: "4/4" is not four items
    at = f" at item {current}, last {last}" if width >= STAGE_WIDTH else f" {current}/{last}"
    if s.mission.state == mavlink.MISSION_STATE_COMPLETE:
        at = ""
    elif s.mission.state == mavlink.MISSION_STATE_NOT_STARTED:
        at = f" from item {s.mission.current}" if s.mission.current else f", {counted(s.mission.total, 'item')}"
    return (f" {MISSION_LABELS[s.mission.state]}{at} ", "")


def _battery(s: Snapshot) -> tuple[str, str]:
    if s.battery.charge_left is None:
        return (" battery -- " if s.battery.voltage is None else f" battery {s.battery.voltage:.1f} V ", "dim")
    return (f" battery {100 * s.battery.charge_left:.0f} % ", charge_style(s.battery.charge_left, "dim"))


def charge_style(left: float, usual: str) -> str:
    """Style of a share of charge: a warning when it is low, bad when the battery is nearly empty."""
    return "bad" if left <= EMPTY_BATTERY else "warn" if left <= LOW_BATTERY else usual


def _progress(s: Snapshot) -> tuple[str, str]:
    command = s.operator.in_progress
    if command is None:
        return ("", "")
    done = f" {command.progress} %" if command.progress <= MAX_PERCENT else ""
    return (f" {pilot_words(command.command)}{done} ", "accent")


def _control(s: Snapshot) -> tuple[str, str]:
    if s.operator.in_control == s.session.own_system:
        asked_by = s.operator.control_asked_by
        return (f" {asked_by} ASKS FOR CONTROL ", "warn") if asked_by else (" in control ", "good")
    return (f" {s.operator.in_control} IN CONTROL ", "warn") if s.operator.in_control else ("", "")


def _speed(s: Snapshot) -> tuple[str, str]:
    """The speed of the simulator, if not real time."""
    speed = s.session.simulation_speed
    return ("", "") if speed == 1.0 else (f" simulated {speed:g}x ", "dim")


def _signing(s: Snapshot) -> tuple[str, str]:
    text, style = SIGNING_SEGMENTS[s.link.signing]
    return (f"{text}{s.link.refused} refused ", "warn") if s.link.refused and style != "bad" else (text, style)


def _link(s: Snapshot) -> tuple[str, str]:
    """Messages per second, and the loss instead if it is not normal."""
    if s.session.is_replay:
        return ("", "")
    if s.link.loss > MAX_NORMAL_LOSS:
        return (f" loss {100 * s.link.loss:.1f} % ", "warn")
    return (" link --/s " if math.isnan(s.link.rate) else f" link {s.link.rate:.0f}/s ", "dim")


def _loss(s: Snapshot) -> tuple[str, str]:
    is_shown = not s.session.is_replay and s.link.loss <= MAX_NORMAL_LOSS
    return (f" loss {100 * s.link.loss:.1f} % ", "dim") if is_shown else ("", "")


CAME_BACK = ("Vehicle is back", "The vehicle restarted")  # begins a line after which earlier warnings are over
NEWS_TIME = 15.0  # in which a vehicle's newest message is shown; later, its last warning [s]
OLD_WARNING_TIME = 60.0  # for which a warning stands in the list of vehicles, if it is no failsafe [s]
MAX_SHOWN_AGE = 999.0  # that is told [s]
ARMED = 9  # width of the word [cells]


class _Columns(NamedTuple):
    """Widths of the columns [cells], and what separates a number from its unit."""

    mode: int
    law: int
    height: int
    speed: int
    charge: int
    age: int
    gap: str


STRIP_COLUMNS = (  # by the least width of the screen [cells]
    (130, _Columns(mode=13, law=24, height=9, speed=10, charge=7, age=9, gap=" ")),
    (100, _Columns(mode=13, law=14, height=9, speed=10, charge=7, age=9, gap=" ")),
    (0, _Columns(mode=9, law=13, height=7, speed=9, charge=5, age=7, gap="")),
)


class FleetStrip(Panel):
    """Id, mode, arming, law, height, speed, battery, link and last warning of each vehicle."""

    fleet: reactive[tuple[Snapshot, ...]] = reactive((), repaint=False)

    class Chosen(Message):
        """The operator clicked on a vehicle."""

        def __init__(self, system: int) -> None:
            super().__init__()
            self.system = system

    def __init__(self) -> None:
        super().__init__("", id="fleet")

    def watch_fleet(self) -> None:
        """Show new values."""
        self.redraw()

    def watch_now(self) -> None:
        """Redraw: ages change without a new message."""
        self.redraw()

    def subtitle(self, s: Snapshot) -> str:  # noqa: ARG002 - it has no border
        """Nothing."""
        return ""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """A head if there is room, then the vehicles."""
        return [line for line, _ in fleet_lines(self.fleet, _system(s), self.now, width, height)]

    def on_click(self, event: events.Click) -> None:
        """Choose the vehicle of the line."""
        lines = fleet_lines(self.fleet, _system(self.snapshot), self.now, *self.size)
        if 0 <= event.y < len(lines) and (system := lines[event.y][1]):
            self.post_message(self.Chosen(system))


def fleet_lines(
    fleet: Sequence[Snapshot], active: int, now: float, width: int, height: int
) -> list[tuple[StyledLine, int]]:
    """The lines, each with the system id that a click on it chooses; 0: none.

    Where there is no room for all vehicles, those around the active one are shown, and the last line counts the rest.

    Args:
        fleet: Newest snapshots, by ascending system id.
        active: System id of the active vehicle.
        now: On the snapshots' clock [s].
        width: [cells].
        height: [lines].
    """
    lines: list[tuple[StyledLine, int]] = []
    if height > len(fleet):
        lines.append((_head(width), 0))
    room = height - len(lines)
    shown, hidden = list(fleet), []
    if room < len(fleet):
        place = next((k for k, s in enumerate(fleet) if _system(s) == active), 0)
        begin = min(max(place - (room - 1) // 2, 0), max(len(fleet) - room + 1, 0))
        shown = list(fleet[begin : begin + room - 1])
        hidden = [s for s in fleet if s not in shown]
    lines += [(_vehicle(s, _system(s) == active, now, width), _system(s)) for s in shown]
    return [*lines, (_rest(hidden, now), 0)] if hidden else lines


def _system(s: Snapshot) -> int:
    return s.identity.source[0] if s.identity.source is not None else 0


def _head(width: int) -> StyledLine:
    c = _columns(width)
    names = f"  id {'mode':<{c.mode}}{'':<{ARMED}}{'law':<{c.law}}"
    heads = f"{names}{'height':>{c.height}}{'speed':>{c.speed}}{'batt':>{c.charge}}{'age':>{c.age}}"
    keys = "  o next, f to all, w lines"
    return styled_line((heads, "dim"), (keys if len(heads) + len(keys) <= width else "", "dim"))


def _vehicle(s: Snapshot, is_active: bool, now: float, width: int) -> StyledLine:
    c, age = _columns(width), s.link.age(now) or 0.0
    is_old = s.link.lost or age > MAX_HEARTBEAT_AGE
    plain = "dim" if is_old else "accent" if is_active else ""
    armed, style = ("ARMED", "bad") if s.status.armed else ("disarmed", "good" if s.status.prearm_ok else "warn")
    height = None if s.position.from_home is None else -s.position.from_home[2]
    news = _news(s, now)
    return styled_line(
        (f"{'>' if is_active else ' '}{_system(s):>3} ", "accent" if is_active else "label"),
        (f"{(s.status.mode or '?')[: c.mode - 1]:<{c.mode}}", plain),
        (f"{armed:<{ARMED}}", "dim" if is_old else style),
        (f"{(s.hybrid.law or '')[: c.law - 1]:<{c.law}}", plain),
        (_number(height, f"{c.gap}m", c.height), plain),
        (_number(s.position.ground_speed, f"{c.gap}m/s", c.speed), plain),
        (
            f"{'--' if s.battery.charge_left is None else f'{100.0 * s.battery.charge_left:.0f}{c.gap}%':>{c.charge}}",
            _charge_style(s),
        ),
        (_number(min(age, MAX_SHOWN_AGE), f"{c.gap}s", c.age), "bad" if is_old else "dim"),
        (f"  {news.text}", _news_style(news)) if news is not None else "",
    )


def _columns(width: int) -> _Columns:
    return next(columns for least, columns in STRIP_COLUMNS if width >= least)


def _number(value: float | None, unit: str, width: int) -> str:
    return f"{'--' if value is None else f'{round(value, 1) + 0.0:.1f}{unit}':>{width}}"


def _charge_style(s: Snapshot) -> str:
    if s.battery.charge_left is None:
        return "dim"
    return charge_style(s.battery.charge_left, "dim")


def _news(s: Snapshot, now: float) -> LogLine | None:
    """The newest message if it is recent, else the last warning, while it is not old or the vehicle in a failsafe."""
    if s.log.lines and now - s.log.lines[-1].time < NEWS_TIME:
        return s.log.lines[-1]
    for line in reversed(s.log.lines):
        if line.severity <= mavlink.MAV_SEVERITY_WARNING:
            return line if now - line.time < OLD_WARNING_TIME or s.status.critical or s.hybrid.crashed else None
        if line.text.startswith(CAME_BACK):
            return None
    return None


def _news_style(line: LogLine) -> str:
    if line.severity <= mavlink.MAV_SEVERITY_ERROR:
        return "bad"
    return "warn" if line.severity <= mavlink.MAV_SEVERITY_WARNING else "dim"


def _rest(hidden: Sequence[Snapshot], now: float) -> StyledLine:
    """Line about the vehicles that are not shown, with the numbers of those armed, lost, and in failsafe."""
    count = len(hidden)
    lost = sum(s.link.lost or (s.link.age(now) or 0.0) > MAX_HEARTBEAT_AGE for s in hidden)
    failed, armed = (
        sum(s.status.critical or s.hybrid.crashed for s in hidden),
        sum(bool(s.status.armed) for s in hidden),
    )
    return styled_line(
        (f"     {count} more: {armed} armed", "dim"),
        (f", {lost} lost" if lost else "", "bad"),
        (f", {failed} in failsafe or crashed" if failed else "", "bad"),
        ("   w shows all, o the next, f commands all", "dim"),
    )
