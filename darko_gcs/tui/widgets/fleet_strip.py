"""A line for each vehicle on the link; a click on one makes it the active vehicle."""

from __future__ import annotations

from collections.abc import Sequence

from textual import events
from textual.message import Message
from textual.reactive import reactive

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import LogLine
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.status_bar import EMPTY_BATTERY, LOW_BATTERY, MAX_HEARTBEAT_AGE
from protocol.dialect import mavlink

__all__ = ["FleetStrip", "fleet_lines"]

NEWS_TIME = 15.0  # in which a vehicle's newest message is shown; later, its last warning [s]
WIDE = 120  # screens with room for the names of all laws [cells]
LAW_WIDTHS = {False: 14, True: 24}  # by whether the screen is wide [cells]
HEAD = ("  id ", f"{'mode':<13}", f"{'':<10}", "law", "  height", "     speed", " battery", "   age")
KEYS = "  o next, f to all, w lines"


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

    Where there is no room for all vehicles, those around the active one are shown, and the last line tells of the rest.

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
    texts = [f"{text:<{LAW_WIDTHS[width >= WIDE]}}" if text == "law" else text for text in HEAD]
    return styled_line(("".join(texts) + KEYS, "dim"))


def _vehicle(s: Snapshot, is_active: bool, now: float, width: int) -> StyledLine:
    age, law_width = s.age(now) or 0.0, LAW_WIDTHS[width >= WIDE]
    is_old = s.lost or age > MAX_HEARTBEAT_AGE
    plain = "dim" if is_old else "accent" if is_active else ""
    armed = (f"{'ARMED':<10}", "bad") if s.armed else (f"{'disarmed':<10}", "good" if s.prearm_ok else "warn")
    news = _news(s, now)
    return styled_line(
        (f"{'>' if is_active else ' '}{_system(s):>3} ", "accent" if is_active else "label"),
        (f"{(s.mode or '?')[:12]:<13}", plain),
        (armed[0], "dim" if is_old else armed[1]),
        (f"{(s.law or '')[: law_width - 1]:<{law_width}}", plain),
        (f"{'--' if s.from_home is None else f'{-s.from_home[2] + 0.0:.1f} m':>8}", plain),
        (f"{'--' if s.ground_speed is None else f'{s.ground_speed:.1f} m/s':>10}", plain),
        _charge(s),
        (f"{age:6.1f} s"[-8:] if age < 1e3 else " > 999 s", "bad" if is_old else "dim"),
        (f"  {news.text}", _news_style(news)) if news is not None else "",
    )


def _charge(s: Snapshot) -> tuple[str, str]:
    if s.charge_left is None:
        return ("      --", "dim")
    style = "bad" if s.charge_left <= EMPTY_BATTERY else "warn" if s.charge_left <= LOW_BATTERY else "dim"
    return (f"{100.0 * s.charge_left:6.0f} %", style)


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
    """How many vehicles are not shown, and how many of them need a look."""
    count = len(hidden)
    lost = sum(s.lost or (s.age(now) or 0.0) > MAX_HEARTBEAT_AGE for s in hidden)
    failed, armed = sum(s.critical or s.crashed for s in hidden), sum(bool(s.armed) for s in hidden)
    return styled_line(
        (f"     {count} more: {armed} armed", "dim"),
        (f", {lost} lost" if lost else "", "bad"),
        (f", {failed} in failsafe or crashed" if failed else "", "bad"),
        ("   w shows all, o the next, f commands all", "dim"),
    )
