"""The flight plan beside the flight: block, stage and the list of blocks."""

from __future__ import annotations

from textual.app import ComposeResult
from textual.containers import Vertical

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.widgets.plan_blocks import PlanBlockList
from darko_gcs.tui.widgets.plan_head import PlanHeadPanel


class FlownPlan(Vertical):
    """Shows where the plan is; nothing here has the focus, so no key is taken from the flight."""

    def __init__(self, *, id: str) -> None:  # noqa: A002 - textual's own name for it
        super().__init__(id=id)
        self._head, self._blocks = (
            PlanHeadPanel("Flight plan", id="flown-plan-head"),
            PlanBlockList(id="flown-plan-blocks"),
        )
        self._blocks.can_focus = False

    def compose(self) -> ComposeResult:
        """Block and stage, then the blocks."""
        yield self._head
        yield self._blocks

    def show(self, s: Snapshot, now: float) -> None:
        """Show a snapshot, if there is a plan and room for it."""
        if s.flight_plan is None or not self.is_mounted or not self.display:
            return
        self._head.now, self._head.snapshot = now, s
        self._blocks.show(s.flight_plan)
