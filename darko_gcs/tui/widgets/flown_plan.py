"""The flight plan beside the flight: block, stage and the list of blocks."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.widgets.plan_blocks import PlanBlockList
from darko_gcs.tui.widgets.plan_head import PlanHeadPanel

__all__ = ["FlownPlan"]


class FlownPlan(Vertical):
    """Shows where the plan is; nothing here has the focus, so no key is taken from the flight."""

    def compose(self) -> ComposeResult:
        """Block and stage, then the blocks."""
        yield PlanHeadPanel("Flight plan", id="flown-plan-head")
        blocks = PlanBlockList(id="flown-plan-blocks")
        blocks.can_focus = False
        yield blocks

    def show(self, s: Snapshot, now: float) -> None:
        """Show a snapshot, if there is a plan and room for it."""
        if s.flight_plan is None or not self.display:
            return
        head = self.query_one(PlanHeadPanel)
        head.now, head.snapshot = now, s
        self.query_one(PlanBlockList).show(s.flight_plan)
