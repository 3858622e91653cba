"""The tables of the flight plan screen: waypoints and variables."""

from __future__ import annotations

import math

from textual.widgets import DataTable

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanSetting

__all__ = ["PlanPointTable", "PlanSettingTable", "limits_text"]


class PlanPointTable(DataTable[str]):
    """Waypoints in metres of the plan's origin; the one under the cursor is the chosen one."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id, cursor_type="row", zebra_stripes=True)
        self._shown: dict[int, tuple[str, ...]] = {}

    @property
    def chosen(self) -> int:
        """Number of the waypoint under the cursor; 0 without one."""
        numbers = list(self._shown)
        return numbers[self.cursor_row] if 0 <= self.cursor_row < len(numbers) else 0

    def choose(self, number: int) -> None:
        """Put the cursor on a waypoint."""
        if number in self._shown:
            self.move_cursor(row=list(self._shown).index(number))

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the waypoints that the plan shows, where they are now."""
        points = () if plan is None else plan.points.values()
        rows = {
            p.number: (p.name, *(f"{round(part, 1) + 0.0:.1f}" for part in p.position)) for p in points if p.is_shown
        }
        _update(self, ("waypoint", "E", "N", "up"), self._shown, rows)
        self._shown = rows


class PlanSettingTable(DataTable[str]):
    """Variables with their limits."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id, cursor_type="row", zebra_stripes=True)
        self._shown: dict[int, tuple[str, ...]] = {}

    def show(self, plan: FlightPlanState | None) -> None:
        """Show the variables as they are now."""
        settings = () if plan is None else plan.settings.values()
        rows: dict[int, tuple[str, ...]] = {
            s.number: (s.label, f"{s.value:.6g}", f"{limits_text(s)} {s.unit}".strip()) for s in settings
        }
        _update(self, ("variable", "value", "limits"), self._shown, rows)
        self._shown = rows


def limits_text(setting: PlanSetting) -> str:
    """The limits of a variable, "1..5"; empty without any."""
    low, high = ("" if math.isnan(limit) else f"{limit:g}" for limit in (setting.low, setting.high))
    return f"{low}..{high}" if low or high else ""


def _update(
    table: DataTable[str], names: tuple[str, ...], old: dict[int, tuple[str, ...]], new: dict[int, tuple[str, ...]]
) -> None:
    """Bring a table's rows up to date, and keep the cursor where it is if they are the same rows."""
    if not table.columns:
        for name in names:
            table.add_column(name, key=name)
    if old.keys() != new.keys():
        table.clear()
        for number, cells in new.items():
            table.add_row(*cells, key=str(number))
        return
    for number, cells in new.items():
        for name, before, cell in zip(names, old[number], cells, strict=True):
            if before != cell:
                table.update_cell(str(number), name, cell, update_width=True)
