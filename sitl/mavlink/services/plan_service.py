"""Mission, fence and rally points as peers send them: checked, put in force, saved, and refused with a reason."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from protocol.dialect import mavlink
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived, MissionRefused
from protocol.plans.plan import MissionItem, Refusal, Validate
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.mission.items import validate
from sitl.mavlink.broadcast import Broadcast
from sitl.mavlink.fence_and_rally import PLAN_NAMES, FenceAndRally, recheck_plans
from sitl.mavlink.handlers import on_event
from sitl.mavlink.telemetry.telemetry_service import TelemetryService
from sitl.tools.persistence import StateFolder


class StoredPlans:
    """The plans of the state folder, loaded into the autopilot; ``flaws`` says why some could not be.

    Args:
        autopilot: Flies them.
        state_folder: Stores them.

    Raises:
        SitlError: A file cannot be read.
    """

    def __init__(self, autopilot: Autopilot, state_folder: StateFolder) -> None:
        self._autopilot, self._state_folder = autopilot, state_folder
        self.fence_and_rally = FenceAndRally(autopilot, state_folder)
        stored = state_folder.mission()
        refusal = self.validate(stored)
        self.mission = () if refusal else stored
        autopilot.missions.load(self.mission)
        self.flaws = [f"Stored mission not loaded: {refusal.text}"] if refusal else []
        self.flaws += self.fence_and_rally.flaws

    @property
    def others(self) -> Mapping[int, tuple[Sequence[MissionItem], Validate]]:
        """Fence and rally points in force by MAV_MISSION_TYPE, each with its check."""
        return self.fence_and_rally.plans()

    def validate(self, items: Sequence[MissionItem]) -> Refusal | None:
        """The reason why a mission cannot be flown here; None if it can."""
        return validate(items, self._autopilot.world)


class PlanService:
    """Takes plans from peers.

    Args:
        autopilot: Flies them.
        state_folder: Stores them.
        fence_and_rally: Fence and rally points in force.
        broadcast: Tells everyone a text.
        telemetry: Tells everyone the current item.
    """

    def __init__(
        self,
        *,
        autopilot: Autopilot,
        state_folder: StateFolder,
        fence_and_rally: FenceAndRally,
        broadcast: Broadcast,
        telemetry: TelemetryService,
    ) -> None:
        self._autopilot, self._state_folder, self._fence_and_rally = autopilot, state_folder, fence_and_rally
        self._broadcast, self._telemetry = broadcast, telemetry

    @on_event(MissionReceived)
    def receive(self, event: MissionReceived, _now: float) -> None:
        """A valid plan has arrived."""
        if event.kind:
            self._load_fence_or_rally(event.kind, event.items)
            return
        if event.is_partial:
            self._autopilot.missions.revise(event.items)
            self._broadcast.save(lambda: self._state_folder.save_mission(event.items))
            self._broadcast.info("Mission items replaced")
            return
        self._load_mission(event.items)
        self._broadcast.info(f"Mission of {len(event.items)} item{'s' * (len(event.items) != 1)} received")

    @on_event(MissionRefused)
    def explain_refusal(self, event: MissionRefused, _now: float) -> None:
        """A plan has arrived that cannot be flown."""
        self._broadcast.warn(f"{PLAN_NAMES[event.kind]} refused: {event.reason}")

    @on_event(MissionCleared)
    def clear(self, event: MissionCleared, _now: float) -> None:
        """A peer cleared a plan."""
        if event.kind:
            self._load_fence_or_rally(event.kind, ())
            return
        self._load_mission(())
        self._broadcast.info("Mission cleared")

    @on_event(CurrentItemRequested)
    def choose_item(self, event: CurrentItemRequested, _now: float) -> None:
        """A peer chose the item to go on with."""
        self._autopilot.missions.set_current(event.seq)
        self._telemetry.publish_now(mavlink.MAVLINK_MSG_ID_MISSION_CURRENT)

    def prepare_clearing(self, kinds: set[int]) -> None:
        """Clear several stored plans together: file by file, a crash in between would leave a mixture."""
        if len(kinds) > 1:
            self._broadcast.save(lambda: self._state_folder.clear_plans(kinds))

    def recheck(self) -> None:
        """Home or origin has moved: tell everyone which plans can no longer be flown."""
        for text in recheck_plans(self._autopilot, self._fence_and_rally):
            self._broadcast.warn(text)

    def _load_mission(self, items: Sequence[MissionItem]) -> None:
        self._autopilot.missions.load(items)
        self._broadcast.save(lambda: self._state_folder.save_mission(items))

    def _load_fence_or_rally(self, kind: int, items: Sequence[MissionItem]) -> None:
        self._broadcast.info(self._fence_and_rally.load(kind, items))
        self._broadcast.save(lambda: self._fence_and_rally.save(kind, items))
