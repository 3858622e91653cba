"""The panel with the numbers of the flight."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.decision_panel import BesideDecision, decision_lines
from darko_gcs.tui.widgets.panel import styled_line
from darko_gcs.tui.widgets.status_bar import charge_style
from darko_gcs.tui.widgets.table_number import table_number
from protocol.frames import Vector
from protocol.names import law_label

PAIR_WIDTH = 24  # of the panel that has room for two numbers in a line [cells]
WORDS_WIDTH = 36  # of the panel that has room for words instead of abbreviations [cells]
WORDS = {
    "alt": "altitude", "N": "north", "E": "east", "to": "target", "pow": "power", "bat": "battery", "wnd": "wind",
    "est": "estimate", "air": "airspeed", "track": "off track",
}  # fmt: skip
POSITION = ("LOCAL_POSITION_NED", "GLOBAL_POSITION_INT")
MIN_ENERGY_SHOWN = 0.5  # used in one law [J]
MIN_WIND_SHOWN = 0.05  # below which its direction is not shown [m/s]


class FlightPanel(BesideDecision):
    """Position, velocity, path, energy, battery and air, as numbers; in pages if there is no room for all."""

    SOURCES = (*POSITION, "VFR_HUD")
    page = 0
    _count = 0  # of lines in all pages

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """The lines of the current page, most important first."""
        lines = self._all(s, width)
        self._count = len(lines)
        first = self.page % _pages(len(lines), height) * height
        return lines[first : first + height]

    def next_page(self) -> None:
        """Show the next page."""
        self.page += 1
        self.redraw()

    def redraw(self) -> None:
        """Draw again, with the pages counted in the title."""
        super().redraw()
        height = self.size.height
        pages = _pages(self._count, height)
        title = "Flight" if pages == 1 else f"Flight {self.page % pages + 1}/{pages}"
        if self.border_title != title:
            self.border_title = title

    def _all(self, s: Snapshot, width: int) -> list[StyledLine]:
        p, v = s.from_home or (None,) * 3, s.v or (None,) * 3
        up = s.relative_altitude if p[2] is None else -p[2]
        climb = None if v[2] is None else -v[2]
        speed = None if v[0] is None or v[1] is None else math.hypot(v[0], v[1])
        if width < PAIR_WIDTH:
            goal = None if s.goal is None or s.p is None else math.dist(s.p, s.goal)
            numbers = {"alt": up, "clb": climb, "spd": speed, "air": s.airspeed, "N": p[0], "E": p[1], "to": goal}
            return [styled_line((f"{label:<3}", "label"), table_number(n, 1, 5)) for label, n in numbers.items()]
        words = width >= WORDS_WIDTH
        place, air = self._short_age(s, *POSITION), self._short_age(s, "VFR_HUD")
        return [
            _pair(("alt", up, place), ("climb", climb, place), words=words),
            _pair(("N", p[0], place), ("speed", speed, place), words=words),
            _pair(("E", p[1], place), ("air", s.airspeed, air), words=words),
            self._target(s, words=words),
            self._power(s, words=words),
            self._battery(s, words=words),
            *self._air(s, words=words),
            *self._energy_by_law(s),
            *([] if self.has_decision_panel() else decision_lines(s)),
        ]

    def _short_age(self, s: Snapshot, *kinds: str) -> str:
        """Age of a value in brackets; empty while it is fresh, and for a lost link, of which the status bar tells."""
        if s.lost:
            return ""
        old = self.age_text(s, *kinds)
        return f" ({old.removesuffix(' old')})" if old else ""

    def _target(self, s: Snapshot, *, words: bool) -> StyledLine:
        distance = math.dist(s.p, s.goal) if s.goal is not None and s.p is not None else None
        cross_track = None if s.navigation is None else s.navigation.cross_track
        ages = (
            self._short_age(s, "POSITION_TARGET_LOCAL_NED", "POSITION_TARGET_GLOBAL_INT"),
            self._short_age(s, "NAV_CONTROLLER_OUTPUT"),
        )
        return _pair(("to", distance, ages[0]), ("track", cross_track, ages[1]), words=words)

    def _power(self, s: Snapshot, *, words: bool) -> StyledLine:
        label = _label("pow", words=words)
        if s.energy is None:
            power, age = s.battery_power, self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
            return styled_line(label, ("--", "dim") if power is None else f"{power:7.0f} W", (age, "warn"))
        e, age = s.energy, self._short_age(s, "DARKO_ENERGY")
        return styled_line(label, f"{e.power:7.0f} W", (age, "warn"), ("   used ", "label"), f"{e.total / 1e3:.2f} kJ")

    def _battery(self, s: Snapshot, *, words: bool) -> StyledLine:
        label = _label("bat", words=words)
        if s.charge_left is None:
            volts, age = s.battery_voltage, self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
            return styled_line(label, ("--", "dim") if volts is None else f"{volts:7.1f} V", (age, "warn"))
        style = charge_style(s.charge_left, "")
        voltage = "" if s.battery_voltage is None else f"   {s.battery_voltage:.1f} V"
        age = self._short_age(s, "BATTERY_STATUS", "SYS_STATUS")
        return styled_line(label, (f"{100 * s.charge_left:7.0f} %", style), (age, "warn"), voltage)

    def _air(self, s: Snapshot, *, words: bool) -> list[StyledLine]:
        """The wind; with DARKO_AIR, true and estimated wind and airspeed."""
        wind, estimate = (_label(text, words=words) for text in ("wnd", "est"))
        if s.air is None:
            return [[*_wind(wind, s.wind, None), (self._short_age(s, "WIND_COV", "WIND"), "warn")]]
        age = (self._short_age(s, "DARKO_AIR"), "warn")
        return [
            [*_wind(wind, s.air.wind_true, s.air.airspeed_true), age],
            [*_wind(estimate, s.air.wind_estimate, s.air.airspeed_estimate), age],
        ]

    def _energy_by_law(self, s: Snapshot) -> list[StyledLine]:
        if s.energy is None:
            return []
        used = [(law_label(law), j) for law, j in enumerate(s.energy.by_law) if j > MIN_ENERGY_SHOWN]
        lines = [styled_line((f"  {law:<21}", "dim"), f"{joules:7.0f} J") for law, joules in used]
        return [styled_line(("used in each law", "label")), *lines] if lines else []


_Value = tuple[str, float | None, str]  # label, number, age in brackets


def _pair(first: _Value, second: _Value, *, words: bool) -> StyledLine:
    """A length [m] and a second number, each behind its label and, if it is old, before its age."""
    (label, length, age), (second_label, number, second_age) = first, second
    if age == second_age:  # once for both
        age = ""
    gap, space, room = (" ", "", 6) if age or second_age else ("   ", " ", 7)  # else the age has none
    return styled_line(
        _label(label, words=words), table_number(length, 1, room), " m", (age, "warn"),
        (f"{gap}{WORDS.get(second_label, second_label) if words else second_label:<5}{space}", "label"),
        table_number(number, 1, 5), (second_age, "warn"),
    )  # fmt: skip


def _label(text: str, *, words: bool) -> tuple[str, str]:
    return f"{WORDS[text]:<9}" if words else f"{text:<4}", "label"


def _wind(label: tuple[str, str], wind: Vector | None, airspeed: float | None) -> StyledLine:
    """Wind speed, the direction that it comes from, and the airspeed."""
    if wind is None or not all(map(math.isfinite, wind)):
        return styled_line(label, ("--", "dim"))
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    direction = f" {round(source) % 360:03d}°" if speed > MIN_WIND_SHOWN else " " * 5
    air = [] if airspeed is None else [(" air ", "label"), (table_number(airspeed, 1, 4), "")]
    return styled_line(label, f"{speed:7.1f} m/s", direction, *air)


def _pages(lines: int, height: int) -> int:
    return max(1, math.ceil(lines / height)) if height > 0 else 1
