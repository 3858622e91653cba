"""The tables of the flight plan screen: waypoints and variables."""

from __future__ import annotations

import math

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanSetting
from darko_gcs.tui.widgets.row_table import RowTable


class PlanPointTable(RowTable):
    """Waypoints in metres of the plan's origin; the one under the cursor is the chosen one."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(("waypoint", "E", "N", "up"), id=id)

    @property
    def chosen(self) -> int:
        """Number of the waypoint under the cursor; 0 without one."""
        numbers = list(self.texts)
        return int(numbers[self.cursor_row]) if 0 <= self.cursor_row < len(numbers) else 0

    def choose(self, number: int) -> None:
        """Put the cursor on a waypoint."""
        if str(number) in self.texts:
            self.choose_row(list(self.texts).index(str(number)))

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the waypoints that the plan shows, where they are now."""
        points = () if plan is None else plan.points.values()
        self.show_rows(
            {
                str(p.number): (p.name, *(f"{round(part, 1) + 0.0:.1f}" for part in p.position))
                for p in points
                if p.is_shown
            }
        )


class PlanSettingTable(RowTable):
    """Variables with their limits."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(("variable", "value", "limits"), id=id)

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the variables as they are now."""
        settings = () if plan is None else plan.settings.values()
        self.show_rows(
            {str(s.number): (s.label, f"{s.value:.6g}", f"{limits_text(s)} {s.unit}".strip()) for s in settings}
        )


def limits_text(setting: PlanSetting) -> str:
    """The limits of a variable, "1..5"; empty without any."""
    low, high = ("" if math.isnan(limit) else f"{limit:g}" for limit in (setting.low, setting.high))
    return f"{low}..{high}" if low or high else ""
