"""A line for each vehicle on the link; a click on one makes it the active vehicle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from textual import events
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import LogLine
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.status_bar import MAX_HEARTBEAT_AGE, charge_style
from protocol.dialect import mavlink

NEWS_TIME = 15.0  # in which a vehicle's newest message is shown; later, its last warning [s]
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
    return s.source[0] if s.source is not None else 0


def _head(width: int) -> StyledLine:
    c = _columns(width)
    names = f"  id {'mode':<{c.mode}}{'':<{ARMED}}{'law':<{c.law}}"
    return styled_line(
        (f"{names}{'height':>{c.height}}{'speed':>{c.speed}}{'batt':>{c.charge}}{'age':>{c.age}}", "dim"),
        ("  o next, f to all, w lines", "dim"),
    )


def _vehicle(s: Snapshot, is_active: bool, now: float, width: int) -> StyledLine:
    c, age = _columns(width), s.age(now) or 0.0
    is_old = s.lost or age > MAX_HEARTBEAT_AGE
    plain = "dim" if is_old else "accent" if is_active else ""
    armed, style = ("ARMED", "bad") if s.armed else ("disarmed", "good" if s.prearm_ok else "warn")
    height = None if s.from_home is None else -s.from_home[2] + 0.0
    news = _news(s, now)
    return styled_line(
        (f"{'>' if is_active else ' '}{_system(s):>3} ", "accent" if is_active else "label"),
        (f"{(s.mode or '?')[: c.mode - 1]:<{c.mode}}", plain),
        (f"{armed:<{ARMED}}", "dim" if is_old else style),
        (f"{(s.law or '')[: c.law - 1]:<{c.law}}", plain),
        (_number(height, f"{c.gap}m", c.height), plain),
        (_number(s.ground_speed, f"{c.gap}m/s", c.speed), plain),
        (f"{'--' if s.charge_left is None else f'{100.0 * s.charge_left:.0f}{c.gap}%':>{c.charge}}", _charge_style(s)),
        (_number(min(age, MAX_SHOWN_AGE), f"{c.gap}s", c.age), "bad" if is_old else "dim"),
        (f"  {news.text}", _news_style(news)) if news is not None else "",
    )


def _columns(width: int) -> _Columns:
    return next(columns for least, columns in STRIP_COLUMNS if width >= least)


def _number(value: float | None, unit: str, width: int) -> str:
    return f"{'--' if value is None else f'{value:.1f}{unit}':>{width}}"


def _charge_style(s: Snapshot) -> str:
    if s.charge_left is None:
        return "dim"
    return charge_style(s.charge_left, "dim")


def _news(s: Snapshot, now: float) -> LogLine | None:
    """The newest message if it is recent, else the last warning."""
    if s.messages and now - s.messages[-1].time < NEWS_TIME:
        return s.messages[-1]
    warnings = (line for line in reversed(s.messages) if line.severity <= mavlink.MAV_SEVERITY_WARNING)
    return next(warnings, None)


def _news_style(line: LogLine) -> str:
    if line.severity <= mavlink.MAV_SEVERITY_ERROR:
        return "bad"
    return "warn" if line.severity <= mavlink.MAV_SEVERITY_WARNING else "dim"


def _rest(hidden: Sequence[Snapshot], now: float) -> StyledLine:
    """Line about the vehicles that are not shown, with the numbers of those armed, lost, and in failsafe."""
    count = len(hidden)
    lost = sum(s.lost or (s.age(now) or 0.0) > MAX_HEARTBEAT_AGE for s in hidden)
    failed, armed = sum(s.critical or s.crashed for s in hidden), sum(bool(s.armed) for s in hidden)
    return styled_line(
        (f"     {count} more: {armed} armed", "dim"),
        (f", {lost} lost" if lost else "", "bad"),
        (f", {failed} in failsafe or crashed" if failed else "", "bad"),
        ("   w shows all, o the next, f commands all", "dim"),
    )
