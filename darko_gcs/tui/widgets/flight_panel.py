"""The panel with the numbers of the flight."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import label_of
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.decision_panel import decision_lines
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.table_number import table_number
from protocol.dialect.vocabulary import Law
from protocol.frames import Vector

__all__ = ["FlightPanel"]

BATTERY_BAD, BATTERY_WARN = 0.15, 0.3  # shares left below which the charge is shown in these styles
MIN_ENERGY_SHOWN = 0.5  # used in one law [J]
MIN_WIND_SHOWN = 0.05  # below which its direction is not shown [m/s]


class FlightPanel(Panel):
    """Position, velocity, path, energy, battery and air, as numbers; in pages if there is no room for all."""

    page = 0

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """The lines of the current page, most important first."""
        lines = self._all(s)
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
        pages = _pages(len(self._all(self.snapshot)), height)
        title = "Flight" if pages == 1 else f"Flight {self.page % pages + 1}/{pages}"
        if self.border_title != title:
            self.border_title = title

    def _all(self, s: Snapshot) -> list[StyledLine]:
        p, v = s.from_home or (None,) * 3, s.v or (None,) * 3
        up = None if p[2] is None else -p[2]
        climb = None if v[2] is None else -v[2]
        speed = None if v[0] is None or v[1] is None else math.hypot(v[0], v[1])
        return [
            _pair("alt ", up if up is not None else s.relative_altitude, "   climb ", climb),
            _pair("N   ", p[0], "   speed ", speed),
            _pair("E   ", p[1], "   air   ", s.airspeed),
            self._target(s),
            self._power(s),
            self._battery(s),
            *self._air(s),
            *self._energy_by_law(s),
            *([] if self._has_decision_panel() else decision_lines(s)),
        ]

    def _has_decision_panel(self) -> bool:
        """True on a tall screen, where the decision has a panel of its own."""
        return self.is_mounted and self.screen.has_class("-tall")

    def _target(self, s: Snapshot) -> StyledLine:
        distance = math.dist(s.p, s.goal) if s.goal is not None and s.p is not None else None
        cross_track = None if s.navigation is None else s.navigation.cross_track
        return _pair("to  ", distance, "   track ", cross_track)

    def _power(self, s: Snapshot) -> StyledLine:
        if s.energy is None:
            power = s.battery_power
            return styled_line(("pow ", "label"), ("--", "dim") if power is None else f"{power:7.0f} W")
        e = s.energy
        return styled_line(("pow ", "label"), f"{e.power:7.0f} W", ("   used ", "label"), f"{e.total / 1e3:.2f} kJ")

    def _battery(self, s: Snapshot) -> StyledLine:
        if s.charge_left is None:
            volts = s.battery_voltage
            return styled_line(("bat ", "label"), ("--", "dim") if volts is None else f"{volts:7.1f} V")
        style = "bad" if s.charge_left < BATTERY_BAD else "warn" if s.charge_left < BATTERY_WARN else ""
        voltage = "" if s.battery_voltage is None else f"   {s.battery_voltage:.1f} V"
        return styled_line(("bat ", "label"), (f"{100 * s.charge_left:7.0f} %", style), voltage)

    def _air(self, s: Snapshot) -> list[StyledLine]:
        """The wind; with DARKO_AIR, true and estimated wind and airspeed."""
        if s.air is None:
            return [_wind("wnd ", s.wind, None)]
        return [
            _wind("wnd ", s.air.wind_true, s.air.airspeed_true),
            _wind("est ", s.air.wind_estimate, s.air.airspeed_estimate),
        ]

    def _energy_by_law(self, s: Snapshot) -> list[StyledLine]:
        if s.energy is None:
            return []
        used = [(label_of(Law, law), j) for law, j in enumerate(s.energy.by_law) if j > MIN_ENERGY_SHOWN]
        return [styled_line((f"{law:<21}", "dim"), f"{joules:7.0f} J") for law, joules in used]


def _pair(label: str, length: float | None, second_label: str, second: float | None) -> StyledLine:
    """A length [m] and a second number, each behind its label."""
    return styled_line(
        (label, "label"), table_number(length, 1, 7), " m", (second_label, "label"), table_number(second, 1, 5)
    )


def _wind(label: str, wind: Vector | None, airspeed: float | None) -> StyledLine:
    """Wind speed, the direction that it comes from, and the airspeed."""
    if wind is None or not all(map(math.isfinite, wind)):
        return styled_line((label, "label"), ("--", "dim"))
    speed = math.hypot(wind[0], wind[1])
    source = math.degrees(math.atan2(-wind[1], -wind[0])) % 360.0
    direction = f" {round(source) % 360:03d}°" if speed > MIN_WIND_SHOWN else " " * 5
    air = [] if airspeed is None else [(" air ", "label"), (table_number(airspeed, 1, 4), "")]
    return styled_line((label, "label"), f"{speed:7.1f} m/s", direction, *air)


def _pages(lines: int, height: int) -> int:
    return max(1, math.ceil(lines / height)) if height > 0 else 1
