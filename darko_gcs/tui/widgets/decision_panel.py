"""Hover or forward flight on the current leg: the choice, its reason, and the prediction for both."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import label_of
from darko_gcs.state.values import Decision
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.panel import Panel, styled_line
from darko_gcs.tui.widgets.table_number import table_number
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import DecisionReason, Way

__all__ = ["DecisionPanel", "decision_lines", "decision_summary"]


class DecisionPanel(Panel):
    """The decision on a leg in full."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """Choice and reason, both predictions, the leg, the wind."""
        return decision_lines(s)


def decision_lines(s: Snapshot) -> list[StyledLine]:
    """The decision in six lines."""
    d = s.decision
    if d is None:
        return [styled_line(("no decision yet", "dim"))]
    leg = "leg " if d.seq is None else f"leg to {d.seq}  "
    past = "  past leg," if _is_past(s, d) else ""
    climb = f"{round(d.climb, 0) + 0.0:+.0f} m"
    tail, cross = table_number(d.tail_wind, 1, 1), table_number(d.cross_wind, 1, 1)
    return [
        styled_line((label_of(Way, d.way).upper(), "accent"), (f"  {label_of(DecisionReason, d.reason)}", "")),
        _prediction(d, Way.HOVER, d.hover_time, d.hover_energy),
        _prediction(d, Way.FORWARD, d.forward_time, d.forward_energy),
        _difference(d),
        styled_line((leg, "label"), f"{d.distance:.0f} m", ("  climb ", "label"), climb, (past + _age(s, d), "dim")),
        styled_line(("tail wind ", "label"), tail, ("  cross wind ", "label"), cross),
    ]


def decision_summary(s: Snapshot) -> str:
    """The decision in one line: leg, choice, its energy against the alternative, reason; and if the leg is over."""
    d = s.decision
    if d is None:
        return ""
    leg = ("past leg " if _is_past(s, d) else "") + ("leg" if d.seq is None else f"to {d.seq}")
    saving = f" {-100.0 * d.saving:+.0f} %" if math.isfinite(d.saving) else ""
    return f"{leg}: {label_of(Way, d.way)}{saving}, {label_of(DecisionReason, d.reason)}"


def _is_past(s: Snapshot, d: Decision) -> bool:
    """True if the vehicle does not fly the leg any more."""
    if d.seq is None:
        return False
    return s.mission_state != mavlink.MISSION_STATE_ACTIVE or (s.mission_current or 0) > d.seq


def _age(s: Snapshot, d: Decision) -> str:
    return "" if s.boot is None else f"  {max(0.0, s.boot - d.time):.0f} s ago"


def _prediction(d: Decision, way: Way, time: float, energy: float) -> StyledLine:
    name, style = f"{way.label:<8}", "good" if d.way == way else "dim"
    if not math.isfinite(time):
        return styled_line((name, style), ("  impossible", "dim"))
    return styled_line((name, style), f"{time:8.1f} s", f"{table_number(energy, 0, 9)} J")


def _difference(d: Decision) -> StyledLine:
    """Time and energy of the choice compared with the alternative."""
    if d.chosen_and_other is None or not math.isfinite(d.saving):
        return styled_line(("no alternative to compare", "dim"))
    (chosen, _), (other, _) = d.chosen_and_other
    time = f"{100.0 * (chosen / other - 1.0):+8.0f} %" if other > 0.0 else ""
    return styled_line(("vs other", "label"), time, f" {-100.0 * d.saving:+8.0f} %")
