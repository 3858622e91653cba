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
from protocol.dialect.vocabulary import DecisionReason, LegMode


class DecisionPanel(Panel):
    """The decision on a leg in full."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - cut by the panel
        """Choice and reason, both predictions, the leg, the wind."""
        return decision_lines(s)


class BesideDecision(Panel):
    """A panel that tells the decision itself on screens without room for its own panel."""

    _decision: DecisionPanel | None = None

    def has_decision_panel(self) -> bool:
        """True on a screen with room for it, unless the operator has hidden it."""
        if self._decision is None and self.is_mounted:
            self._decision = next(iter(self.screen.query(DecisionPanel)), None)
        return self._decision is not None and self._decision.display


def decision_lines(s: Snapshot) -> list[StyledLine]:
    """The decision in seven lines."""
    d = s.decision
    if d is None:
        return [styled_line(("no decision yet", "dim"))]
    is_past = _is_past(s, d)
    leg = "leg " if d.seq is None else f"leg to {d.seq}  "
    choice = (
        (f"past leg: {label_of(LegMode, d.leg_mode)}", "dim")
        if is_past
        else (label_of(LegMode, d.leg_mode).upper(), "accent")
    )
    climb = f"{round(d.climb, 0) + 0.0:+.0f} m"
    tail, cross = table_number(d.tail_wind, 1, 1), table_number(d.cross_wind, 1, 1)
    return [
        styled_line(choice, (f"  {label_of(DecisionReason, d.reason)}", "dim" if is_past else "")),
        _prediction(d, LegMode.HOVER, d.hover_time, d.hover_energy, is_past=is_past),
        _prediction(d, LegMode.FORWARD, d.forward_time, d.forward_energy, is_past=is_past),
        _difference(d),
        styled_line((leg, "label"), f"{d.distance:.0f} m", ("  climb ", "label"), climb),
        styled_line(("tail wind ", "label"), tail, ("  cross wind ", "label"), cross),
        styled_line((_age(s, d), "dim")),
    ]


def decision_summary(s: Snapshot, width: int) -> str:
    """The decision in one line of a width: leg, choice, reason, energy saved; and if the leg is over.

    The saving and the reason are left out, in this order, if there is no room.
    """
    d = s.decision
    if d is None:
        return ""
    leg = ("past leg" if _is_past(s, d) else "leg") + ("" if d.seq is None else f" to {d.seq}")
    short = f"{leg}: {label_of(LegMode, d.leg_mode)}"
    saving = f", saves {100.0 * d.saving:.0f} %" if math.isfinite(d.saving) else ""
    reason = f", {label_of(DecisionReason, d.reason)}"
    texts = (short + reason + saving, short + reason, short)
    return next((text for text in texts if len(text) <= width), short)


def _is_past(s: Snapshot, d: Decision) -> bool:
    """True if the vehicle does not fly the leg any more."""
    if d.seq is None:
        return False
    return s.mission_state != mavlink.MISSION_STATE_ACTIVE or (s.mission_current or 0) > d.seq


def _age(s: Snapshot, d: Decision) -> str:
    past = "a past leg, " if _is_past(s, d) else ""
    return f"{past}decided" if s.boot is None else f"{past}decided {max(0.0, s.boot - d.time):.0f} s ago"


def _prediction(d: Decision, leg_mode: LegMode, time: float, energy: float, *, is_past: bool) -> StyledLine:
    name, style = f"{leg_mode.label:<8}", "good" if d.leg_mode == leg_mode and not is_past else "dim"
    if not math.isfinite(time):
        return styled_line((name, style), ("  impossible", "dim"))
    return styled_line((name, style), f"{time:8.1f} s", f"{table_number(energy, 0, 9)} J")


def _difference(d: Decision) -> StyledLine:
    """Time and energy that the choice saves; below zero, what it costs more."""
    if d.chosen_and_other is None or not math.isfinite(d.saving):
        return styled_line(("no alternative to compare", "dim"))
    (chosen, _), (other, _) = d.chosen_and_other
    time = f"{100.0 * (1.0 - chosen / other):8.0f} %" if other > 0.0 else ""
    return styled_line(("saves   ", "label"), time, f" {100.0 * d.saving:8.0f} %")
