"""The panels of numbers: the flight, and how the leg at hand was decided."""

from __future__ import annotations

import math

from darko_gcs.snapshot import Decision, Snapshot
from darko_gcs.widgets.panel import Line, Panel, text_line
from darko_gcs.words import label
from protocol.dialect.vocabulary import DecisionReason, Law, Way
from protocol.frames import Vector

__all__ = ["DecisionPanel", "FlightPanel"]


def number(value: float | None, digits: int, width: int) -> str:
    """A number of fixed width; dashes for none."""
    if value is None or not math.isfinite(value):
        return "--".rjust(width)
    return f"{round(value, digits) + 0.0:{width}.{digits}f}"  # + 0.0: never a negative zero


class FlightPanel(Panel):
    """Position, velocity, path, energy, battery and air, as numbers; in pages where there is no room for all."""

    page = 0

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:  # noqa: ARG002 - cut by the panel
        """Most wanted first."""
        lines = self._all(s)
        first = self.page % _pages(len(lines), height) * height
        return lines[first : first + height]

    def next_page(self) -> None:
        """Show the lines that had no room."""
        self.page += 1
        self.redraw()

    def redraw(self) -> None:
        """The title counts the pages."""
        super().redraw()
        height = self.size.height
        pages = _pages(len(self._all(self.snapshot)), height)
        title = "Flight" if pages == 1 else f"Flight {self.page % pages + 1}/{pages}"
        if self.border_title != title:
            self.border_title = title

    def _all(self, s: Snapshot) -> list[Line]:
        p, v = s.from_home or (None,) * 3, s.v or (None,) * 3
        up = None if p[2] is None else -p[2]
        climb = None if v[2] is None else -v[2]
        speed = None if v[0] is None or v[1] is None else math.hypot(v[0], v[1])
        height_above = up if up is not None else s.relative_altitude
        return [
            text_line(("alt ", "label"), number(height_above, 1, 7), " m", ("   climb ", "label"), number(climb, 1, 5)),
            text_line(("N   ", "label"), number(p[0], 1, 7), " m", ("   speed ", "label"), number(speed, 1, 5)),
            text_line(("E   ", "label"), number(p[1], 1, 7), " m", ("   air   ", "label"), number(s.airspeed, 1, 5)),
            self._target(s),
            self._power(s),
            self._battery(s),
            *self._air(s),
            *self._by_law(s),
            *([] if self._has_neighbour() else decision_lines(s)),
        ]

    def _has_neighbour(self) -> bool:
        """Whether the decision has a panel of its own: where the screen is tall."""
        return self.is_mounted and self.screen.has_class("-tall")

    def _target(self, s: Snapshot) -> Line:
        way = math.dist(s.p, s.target) if s.target is not None and s.p is not None else None
        off = None if s.navigation is None else s.navigation.cross_track
        return text_line(("to  ", "label"), number(way, 1, 7), " m", ("   track ", "label"), number(off, 1, 5))

    def _power(self, s: Snapshot) -> Line:
        if s.energy is None:
            return text_line(("pow ", "label"), ("--", "dim"))
        e = s.energy
        return text_line(("pow ", "label"), f"{e.power:7.0f} W", ("   used ", "label"), f"{e.total / 1e3:.2f} kJ")

    def _battery(self, s: Snapshot) -> Line:
        if s.battery is None:
            return text_line(("bat ", "label"), ("--", "dim"))
        style = "bad" if s.battery < 0.15 else "warn" if s.battery < 0.3 else ""
        volts = "" if s.voltage is None else f"   {s.voltage:.1f} V"
        return text_line(("bat ", "label"), (f"{100 * s.battery:7.0f} %", style), volts)

    def _air(self, s: Snapshot) -> list[Line]:
        """The wind; where the vehicle tells, what it thinks of it beside what it is, with the airspeeds."""
        if s.air is None:
            return [_wind("wnd ", s.wind, None)]
        return [
            _wind("wnd ", s.air.wind_true, s.air.airspeed_true),
            _wind("est ", s.air.wind_estimate, s.air.airspeed_estimate),
        ]

    def _by_law(self, s: Snapshot) -> list[Line]:
        if s.energy is None:
            return []
        used = [(label(Law, law), joules) for law, joules in enumerate(s.energy.by_law) if joules > 0.5]
        return [text_line((f"{law:<21}", "dim"), f"{joules:7.0f} J") for law, joules in used]


def _wind(label: str, wind: Vector | None, airspeed: float | None) -> Line:
    """Speed, where it comes from, and the airspeed in it."""
    if wind is None or not all(map(math.isfinite, wind)):
        return text_line((label, "label"), ("--", "dim"))
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    words = f" {round(source) % 360:03d}°" if speed > 0.05 else " " * 5
    air = [] if airspeed is None else [(" air ", "label"), (number(airspeed, 1, 4), "")]
    return text_line((label, "label"), f"{speed:7.1f} m/s", words, *air)


class DecisionPanel(Panel):
    """How the leg at hand is flown, why, and what either way was thought to take."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[Line]:  # noqa: ARG002 - cut by the panel
        """Way and reason, both predictions, the leg."""
        return decision_lines(s)


def decision_lines(s: Snapshot) -> list[Line]:
    """The decision in six lines."""
    d = s.decision
    if d is None:
        return [text_line(("no leg has been decided", "dim"))]
    leg = "leg " if d.seq is None else f"leg to {d.seq}  "
    climb = f"{round(d.climb, 0) + 0.0:+.0f} m"
    return [
        text_line((label(Way, d.way).upper(), "accent"), (f"  {label(DecisionReason, d.reason)}", "")),
        _way(d, Way.HOVER, d.hover_time, d.hover_energy),
        _way(d, Way.FORWARD, d.forward_time, d.forward_energy),
        _difference(d),
        text_line((leg, "label"), f"{d.distance:.0f} m", ("  climb ", "label"), climb),
        text_line(
            ("wind along ", "label"), number(d.tail_wind, 1, 1), ("  across ", "label"), number(d.cross_wind, 1, 1)
        ),
    ]


def _way(d: Decision, way: Way, time: float, energy: float) -> Line:
    name, style = f"{way.label:<8}", "good" if d.way == way else "dim"
    if not math.isfinite(time):
        return text_line((name, style), ("  impossible", "dim"))
    return text_line((name, style), f"{time:8.1f} s", f"{number(energy, 0, 9)} J")


def _difference(d: Decision) -> Line:
    """What the chosen way takes against the other."""
    if d.chosen_and_other is None or not math.isfinite(d.saving):
        return text_line(("no other way to compare", "dim"))
    (chosen, _), (other, _) = d.chosen_and_other
    time = f"{100.0 * (chosen / other - 1.0):+8.0f} %" if other > 0.0 else ""
    return text_line(("vs other", "label"), time, f" {-100.0 * d.saving:+8.0f} %")


def _pages(lines: int, height: int) -> int:
    return max(1, math.ceil(lines / height)) if height > 0 else 1
