"""State of the flight plan: block, stage and times, and its events."""

from __future__ import annotations

from textwrap import wrap

from darko_gcs.state.flight_plan_state import FlightPlanState, PlanHappening
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.text import format_time
from darko_gcs.tui.render.canvas import StyledLine
from darko_gcs.tui.widgets.message_panel import MIN_WRAP_WIDTH
from darko_gcs.tui.widgets.panel import Panel, styled_line
from protocol.dialect.vocabulary import PlanEventKind

NO_PLAN = (
    "The vehicle has no flight plan, or has not sent it yet (F5 asks again)",
    "Ctrl+O loads one from a file (.xml) onto a vehicle that stands on the ground",
)
NO_RECORDED_PLAN = ("No flight plan in the recording so far",)
HAPPENING_STYLES = {PlanEventKind.EXCEPTION: "warn", PlanEventKind.REMARK: "accent"}


class PlanHeadPanel(Panel):
    """Two lines: the plan with its block, and the stage."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:  # noqa: ARG002 - two lines
        """The block with its time, then the stage with its own."""
        plan = s.flight_plan
        if plan is None:
            return [styled_line((line, "dim")) for line in (NO_RECORDED_PLAN if s.is_replay else NO_PLAN)]
        flown = ("flown", "good") if s.flies_plan else (f"not flown: {s.mode or 'mode unknown'}", "warn")
        block = styled_line(
            (f"{plan.block} {plan.block_name(plan.block)}", "accent"),
            f"  {format_time(plan.block_time)}   ",
            flown,
            ("" if plan.is_complete else f"   {plan.received} of {plan.entries} entries", "dim"),
            (f"   {plan.name}   in flight {format_time(plan.flight_time)}", "dim"),
        )
        line = f"   line {plan.line}" if plan.line else ""
        stage = styled_line(
            f"{plan.stage} {plan.stage_text or 'no stage'}", f"  {format_time(plan.stage_time)}", (line, "dim")
        )
        return [block, stage]


class PlanEventPanel(Panel):
    """Events of the flight plan, newest last: blocks entered, exceptions that fired, remarks."""

    def draw(self, s: Snapshot, width: int, height: int) -> list[StyledLine]:
        """As many lines as fit; long ones take several rows."""
        plan = s.flight_plan
        if plan is None:
            return []
        rows: list[StyledLine] = []
        for happening in plan.happenings[-height:]:
            style = HAPPENING_STYLES.get(PlanEventKind(happening.kind), "") if _is_known(happening) else ""
            parts = wrap(happening_text(plan, happening), max(width, MIN_WRAP_WIDTH), subsequent_indent="  ")
            rows += [styled_line((part, style)) for part in parts]
        return rows[-height:]


def happening_text(plan: FlightPlanState, h: PlanHappening) -> str:
    """One line about what happened: "1:23.4 Route -> Standby: datalink_time > 10 (line 37)"."""
    if h.kind == PlanEventKind.EXCEPTION:
        line = f" (line {h.line})" if h.line else ""
        what = f"{plan.block_name(h.from_block)} -> {plan.block_name(h.to_block)}: {h.text}{line}"
    elif h.kind == PlanEventKind.BLOCK:
        what = f"block {h.text}"
    else:
        what = h.text
    return f"{format_time(h.time)} {what}"


def _is_known(happening: PlanHappening) -> bool:
    return happening.kind in set(PlanEventKind)
