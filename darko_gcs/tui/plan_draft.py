"""The plan that the operator edits, and how it compares with the vehicle's."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from darko_gcs.state.plan_parts import Items
from darko_gcs.state.snapshot import Snapshot
from protocol.plans import Plan
from protocol.plans.fence_rally import fence_items, rally_items, with_fence, with_rally

__all__ = ["PlanDraft"]


@dataclass(kw_only=True)
class PlanDraft:
    """The plan being edited. The app owns it, so leaving the mission screen loses nothing."""

    plan: Plan = field(default_factory=Plan)
    path: str = ""
    changed: bool = False  # differs from the vehicle's plan
    saved: bool = True  # in a file, as it is
    fence: Items = ()  # of the plan
    rally: Items = ()  # of the plan
    vehicle_plans: tuple[Items, ...] = ()  # the vehicle's mission, fence and rally points, as last seen

    def take(self, plan: Plan, path: str) -> None:
        """Begin with the plan of a file.

        Raises:
            FileError: Its fence or its rally points cannot be read; the draft stays as it was.
        """
        fence, rally = fence_items(plan), rally_items(plan)
        self.plan, self.path, self.fence, self.rally = plan, path, fence, rally
        self.changed = self.saved = True

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
        old, self.fence, self.rally = (self.fence, self.rally), s.fence, s.rally
        self.plan = plan
        if old != (s.fence, s.rally):
            self.plan = with_rally(with_fence(plan, s.fence), s.rally)

    @property
    def is_at_risk(self) -> bool:
        """True if quitting would lose the plan: neither saved nor on the vehicle."""
        return bool(self.plan.items) and self.changed and not self.saved
