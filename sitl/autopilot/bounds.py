"""Fence and rally points between wire, memory and autopilot: what is kept, checked and in force."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal, Validate
from protocol.plans.mission import MissionItem
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.fence import Fence, make_fence
from sitl.autopilot.rally import make_rally
from sitl.memory import Memory

PLAN, FENCE, RALLY = (
    mavlink.MAV_MISSION_TYPE_MISSION,
    mavlink.MAV_MISSION_TYPE_FENCE,
    mavlink.MAV_MISSION_TYPE_RALLY,
)
PLAN_NAMES = {PLAN: "Mission", FENCE: "Fence", RALLY: "Rally points"}


class Bounds:
    """Loads the kept fence and rally points into the autopilot; ``flaws`` says what could not be.

    Raises:
        SitlError: A kept file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, memory: Memory) -> None:
        self._autopilot, self._memory = autopilot, memory
        self._checks: dict[int, Validate] = {FENCE: self._check_fence, RALLY: self._check_rally}
        self._kept: dict[int, tuple[MissionItem, ...]] = {FENCE: memory.fence(), RALLY: memory.rally()}
        self.flaws: list[str] = []
        for kind, items in self._kept.items():
            refusal = self._checks[kind](items)
            if refusal is None:
                self.load(kind, items)
            else:
                self._kept[kind] = ()
                self.flaws.append(f"Kept {PLAN_NAMES[kind].lower()} not loaded: {refusal.text}")

    def plans(self) -> dict[int, tuple[Sequence[MissionItem], Validate]]:
        """What the mission service begins with, by MAV_MISSION_TYPE."""
        return {kind: (items, self._checks[kind]) for kind, items in self._kept.items()}

    def load(self, kind: int, items: Sequence[MissionItem]) -> str:
        """Put valid items in force; a sentence about it for the pilot."""
        self._kept[kind] = tuple(items)
        self._put(kind, items)
        counted = f"{len(items)} item{'s' * (len(items) != 1)} received"
        return f"{PLAN_NAMES[kind]}: {counted}" if items else f"{PLAN_NAMES[kind]} cleared"

    def reload(self) -> list[str]:
        """Put in force anew what is held, after home or the origin moved; why some of it no longer can be."""
        reasons = []
        for kind, items in self._kept.items():
            refusal = self._checks[kind](items)
            self._put(kind, () if refusal else items)
            if refusal is not None:
                reasons.append(f"{PLAN_NAMES[kind]} no longer in force: {refusal.text}")
        return reasons

    def _put(self, kind: int, items: Sequence[MissionItem]) -> None:
        autopilot, world = self._autopilot, self._autopilot.world
        if kind == FENCE:
            fence = make_fence(items, world.frame)
            if isinstance(fence, Fence):
                autopilot.load_fence(fence)
        else:
            points = make_rally(items, world)
            if not isinstance(points, Refusal):
                autopilot.load_rally(points)

    def keep(self, kind: int, items: Sequence[MissionItem]) -> None:
        """Replace the kept ones.

        Raises:
            MemoryFaultError: They cannot be written.
        """
        writers: dict[int, Callable[[Sequence[MissionItem]], None]] = {
            FENCE: self._memory.keep_fence,
            RALLY: self._memory.keep_rally,
        }
        writers[kind](items)

    def _check_fence(self, items: Sequence[MissionItem]) -> Refusal | None:
        made = make_fence(items, self._autopilot.world.frame)
        return made if isinstance(made, Refusal) else None

    def _check_rally(self, items: Sequence[MissionItem]) -> Refusal | None:
        made = make_rally(items, self._autopilot.world)
        return made if isinstance(made, Refusal) else None
