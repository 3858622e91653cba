"""The plan that the operator edits, and how it compares with the vehicle's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from darko_gcs.state.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot
from protocol.plans import Plan
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally

__all__ = ["PlanDraft"]


MAX_UNDONE = 100  # edits that can be taken back


@dataclass(kw_only=True)
class PlanDraft:
    """The plan being edited. The app owns it, so leaving the mission screen loses nothing."""

    plan: Plan = field(default_factory=Plan)
    path: str = ""
    changed: bool = False  # differs from the vehicle's plan
    saved: bool = True  # in a file, as it is
    fence: Items = ()  # of the plan
    rally: Items = ()  # of the plan
    undone: list[Plan] = field(default_factory=list)  # plans before each edit, newest last
    vehicle_plans: tuple[Items, ...] = ()  # the vehicle's mission, fence and rally points, as last seen

    def take(self, plan: Plan, path: str) -> None:
        """Begin with the plan of a file.

        Raises:
            FileError: Its fence or its rally points cannot be read; the draft stays as it was.
        """
        fence, rally = fence_items(plan), rally_items(plan)
        self.plan, self.path, self.fence, self.rally = plan, path, fence, rally
        self.undone.clear()
        self.changed = self.saved = True

    def edit(self, items: Items) -> None:
        """Replace the mission's items; ``undo`` takes it back."""
        self.undone = [*self.undone[-MAX_UNDONE + 1 :], self.plan]
        # ``item_keys`` are a file's extra fields of the old items: they do not fit the new ones.
        self._become(replace(self.plan, items=items, item_keys=()))

    def undo(self) -> bool:
        """Take the last edit back; False if there is none."""
        if not self.undone:
            return False
        self._become(self.undone.pop())
        return True

    def _become(self, plan: Plan) -> None:
        self.plan, self.changed, self.saved = plan, True, False

    def is_on_vehicle(self, s: Snapshot) -> bool:
        """True if the vehicle has all of the plan. A fence or rally points that only the vehicle has do not count."""
        limits = ((self.fence, s.fence), (self.rally, s.rally))
        return self.plan.items == s.mission and all(not own or own == held for own, held in limits)

    def follow_vehicle(self, s: Snapshot) -> None:
        """Become the vehicle's plan.

        Raises:
            LocalProtocolError: The vehicle's fence cannot be written to a file; the draft follows it nevertheless.
        """
        plan = replace(self.plan, items=s.mission, item_keys=())
        self.undone.clear()
        old, self.fence, self.rally = (self.fence, self.rally), s.fence, s.rally
        self.plan = plan
        if old != (s.fence, s.rally):
            self.plan = with_rally(with_fence(plan, s.fence), s.rally)

    @property
    def is_at_risk(self) -> bool:
        """True if quitting would lose the plan: neither saved nor on the vehicle."""
        return bool(self.plan.items) and self.changed and not self.saved
