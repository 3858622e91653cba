"""Fence and rally points between MAVLink, the state folder and the autopilot: stored, checked, put in force."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from protocol.dialect import mavlink
from protocol.plans.mission_item import MissionItem
from protocol.plans.plan import Refusal, Validate
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.failsafes import FENCE_ACTIONS
from sitl.autopilot.mission.items import refuse_items
from sitl.autopilot.world import RETURN_POINT, Fence, make_fence, make_rally
from sitl.tools.persistence import StateFolder

PLAN, FENCE, RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
PLAN_NAMES = {PLAN: "Mission", FENCE: "Fence", RALLY: "Rally points"}


class FenceAndRally:
    """Fence and rally points of one autopilot; the stored ones are put in force from the start.

    Attributes:
        flaws: Why stored ones could not be put in force, for the pilot.

    Raises:
        SitlError: A stored file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, state_folder: StateFolder) -> None:
        self._autopilot, self._state_folder = autopilot, state_folder
        self._checks: dict[int, Validate] = {FENCE: self._check_fence, RALLY: self._check_rally}
        self._items: dict[int, tuple[MissionItem, ...]] = {FENCE: state_folder.fence(), RALLY: state_folder.rally()}
        self.flaws: list[str] = []
        for kind, items in self._items.items():
            refusal = self._checks[kind](items)
            if refusal is None:
                self.load(kind, items)
            else:
                self._items[kind] = ()
                self.flaws.append(f"Stored {PLAN_NAMES[kind].lower()} not loaded: {refusal.text}")

    def plans(self) -> dict[int, tuple[Sequence[MissionItem], Validate]]:
        """Plans in force by MAV_MISSION_TYPE, each with its check."""
        return {kind: (items, self._checks[kind]) for kind, items in self._items.items()}

    def load(self, kind: int, items: Sequence[MissionItem]) -> str:
        """Put valid items in force; a sentence about it for the pilot."""
        self._items[kind] = tuple(items)
        self._put_in_force(kind, items)
        count = f"{len(items)} item{'s' * (len(items) != 1)} received"
        unused = kind == FENCE and self._leaves_return_point_unused
        unused_text = "; its return point is flown to by GF_ACTION 3 alone" if unused else ""
        return f"{PLAN_NAMES[kind]}: {count}{unused_text}" if items else f"{PLAN_NAMES[kind]} cleared"

    @property
    def _leaves_return_point_unused(self) -> bool:
        """Whether the fence has a return point, and what is done at a breach does not lead there."""
        action = FENCE_ACTIONS.get(self._autopilot.settings.fence_action)
        has_return_point = any(item.command == RETURN_POINT for item in self._items[FENCE])
        return has_return_point and action is not SafetyAction.RETURN

    def reload(self) -> list[str]:
        """Put the items in force anew after home or the origin has moved; why some no longer can be."""
        reasons = []
        for kind, items in self._items.items():
            refusal = self._checks[kind](items)
            self._put_in_force(kind, () if refusal else items)
            if refusal is not None:
                reasons.append(f"{PLAN_NAMES[kind]} no longer in force: {refusal.text}")
        return reasons

    def save(self, kind: int, items: Sequence[MissionItem]) -> None:
        """Replace the stored items.

        Raises:
            StateFolderError: They cannot be written.
        """
        writers: dict[int, Callable[[Sequence[MissionItem]], None]] = {
            FENCE: self._state_folder.save_fence,
            RALLY: self._state_folder.save_rally,
        }
        writers[kind](items)

    def _put_in_force(self, kind: int, items: Sequence[MissionItem]) -> None:
        autopilot, world = self._autopilot, self._autopilot.world
        if kind == FENCE:
            fence = make_fence(items, world)
            if isinstance(fence, Fence):
                autopilot.load_fence(fence)
        else:
            points = make_rally(items, world)
            if not isinstance(points, Refusal):
                autopilot.load_rally(points)

    def _check_fence(self, items: Sequence[MissionItem]) -> Refusal | None:
        fence = make_fence(items, self._autopilot.world)
        return fence if isinstance(fence, Refusal) else None

    def _check_rally(self, items: Sequence[MissionItem]) -> Refusal | None:
        points = make_rally(items, self._autopilot.world)
        return points if isinstance(points, Refusal) else None


def recheck_plans(autopilot: Autopilot, fence_and_rally: FenceAndRally) -> list[str]:
    """Put in force anew what is relative to home or origin; what can no longer be flown, in words."""
    reasons = fence_and_rally.reload()
    if autopilot.mission is not None and (reason := refuse_items(autopilot.mission.items, autopilot.world)):
        reasons.append(f"Mission can no longer be flown: {reason}")
    return reasons
