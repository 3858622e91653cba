"""Mission, fence and rally points as peers send them: checked, put in force, kept, and told in words."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal, Validate
from protocol.events import MissionCleared, MissionReceived, MissionRefused
from protocol.plans.mission import MissionItem
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.bounds import PLAN_NAMES, Bounds
from sitl.autopilot.home import recheck
from sitl.autopilot.mission import validate
from sitl.memory import Keep, Memory

INFO, WARNING = mavlink.MAV_SEVERITY_INFO, mavlink.MAV_SEVERITY_WARNING


class Plans:
    """Loads what was kept; ``flaws`` says what of it could not be.

    Args:
        autopilot: Flies them.
        memory: Keeps them.
        say: Tells everyone a line, with its MAV_SEVERITY.
        keep: Calls what writes, and says what could not be written.

    Raises:
        SitlError: A kept file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, memory: Memory, say: Callable[[int, str], None], keep: Keep) -> None:
        self._autopilot, self._memory, self._say, self._keep = autopilot, memory, say, keep
        self._bounds = Bounds(autopilot, memory)
        kept = memory.mission()
        refusal = self.validate(kept)
        self.mission = () if refusal else kept
        autopilot.load_mission(self.mission)
        self.flaws = [f"Kept mission not loaded: {refusal.text}"] if refusal else []
        self.flaws += self._bounds.flaws

    @property
    def others(self) -> Mapping[int, tuple[Sequence[MissionItem], Validate]]:
        """Fence and rally points in force by MAV_MISSION_TYPE, each with its check."""
        return self._bounds.plans()

    def validate(self, items: Sequence[MissionItem]) -> Refusal | None:
        """Why a mission cannot be flown here, or None."""
        return validate(items, self._autopilot.world)

    def received(self, event: MissionReceived) -> None:
        """A valid plan came."""
        if event.kind:
            self._bind(event.kind, event.items)
            return
        self._load(event.items)
        self._say(INFO, f"Mission of {len(event.items)} item{'s' * (len(event.items) != 1)} received")

    def refused(self, event: MissionRefused) -> None:
        """A plan came that cannot be taken."""
        self._say(WARNING, f"{PLAN_NAMES[event.kind]} refused: {event.reason}")

    def cleared(self, event: MissionCleared) -> None:
        """A plan is to be forgotten."""
        if event.kind:
            self._bind(event.kind, ())
            return
        self._load(())
        self._say(INFO, "Mission cleared")

    def prepare_clearing(self, kinds: set[int]) -> None:
        """Several plans are to be forgotten together: file by file, a crash between them would leave a mixture."""
        if len(kinds) > 1:
            self._keep(lambda: self._memory.clear_plans(kinds))

    def recheck(self) -> None:
        """Say what home or origin, which have moved, mean for what is held."""
        for text in recheck(self._autopilot, self._bounds):
            self._say(WARNING, text)

    def _load(self, items: Sequence[MissionItem]) -> None:
        self._autopilot.load_mission(items)
        self._keep(lambda: self._memory.keep_mission(items))

    def _bind(self, kind: int, items: Sequence[MissionItem]) -> None:
        self._say(INFO, self._bounds.load(kind, items))
        self._keep(lambda: self._bounds.keep(kind, items))
