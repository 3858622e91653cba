"""What an operator asks of the vehicle's mission, fence and rally points, as a part of the station."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence

from darko_gcs.state.missions.leg_predictions import LegChain
from darko_gcs.state.missions.plan_difference import change_text, plan_changes
from darko_gcs.state.missions.plan_parts import FENCE, MISSION, PLAN_TITLES, RALLY, with_plan
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.station.leg_prediction_client import LegPredictionClient
from darko_gcs.station.plan_transfer import PlanTransfer
from protocol.dialect import mavlink
from protocol.endpoint_ground import GroundEndpoint
from protocol.events import Event, MissionUploaded
from protocol.plans import MissionItem

__all__ = ["PlanRequests"]

MAX_CHANGES_TOLD = 3  # differences of a plan that was read back, in the message log


class PlanRequests(ABC):
    """Requests about the plans that a vehicle holds; the message log shows the result of each."""

    snapshot: Snapshot
    endpoint: GroundEndpoint
    plans: PlanTransfer
    leg_predictions: LegPredictionClient

    @abstractmethod
    def add_line(self, now: float, text: str, severity: int = mavlink.MAV_SEVERITY_WARNING) -> None:
        """Add a line to the operator's message log."""

    @abstractmethod
    def _try(self, now: float, request: Callable[[], object]) -> None:
        """Send a request, and log why it cannot be sent."""

    def upload(
        self,
        items: Sequence[MissionItem],
        now: float,
        *,
        fence: Sequence[MissionItem] = (),
        rally: Sequence[MissionItem] = (),
        verify: bool = False,
        current: int | None = None,
    ) -> None:
        """Replace the vehicle's mission, and its fence and rally points if new ones are given.

        Args:
            items: The mission.
            now: Now [s].
            fence: Of the plan.
            rally: Rally points of the plan.
            verify: Read the plans back and compare them with what was sent.
            current: Item at which the mission goes on; None: as the vehicle has it after an upload.
        """
        limits = {kind: part for kind, part in ((FENCE, fence), (RALLY, rally)) if part}
        self._try(now, lambda: self.plans.upload({MISSION: items, **limits}, now, verify=verify, current=current))

    def replace_items(self, items: Sequence[MissionItem], changed: range, now: float) -> None:
        """Replace some items of a mission that is being flown; it goes on.

        Args:
            items: All items as they are to be.
            changed: Numbers of those that differ from the vehicle's.
            now: Now [s].
        """
        current = self.snapshot.mission_current
        self._try(now, lambda: self.plans.write_items(items, changed, current, now))

    def download(self, now: float) -> None:
        """Fetch the vehicle's mission, fence and rally points."""
        self._try(now, lambda: self.plans.download(now))

    def clear_plan(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE; 255: mission, fence and rally points."""
        self._try(now, lambda: self.plans.clear(kind, now))

    def set_current(self, seq: int, now: float) -> None:
        """Continue or begin the mission at one of its items."""
        self._try(now, lambda: self.plans.set_current(seq, now))

    def start_mission(self, now: float, *, first: int | None = None) -> None:
        """Fly the mission from an item; None: from its current one."""
        seq = math.nan if first is None else float(first)
        self._try(now, lambda: self.endpoint.command(mavlink.MAV_CMD_MISSION_START, seq, math.nan, now=now))

    def predict_legs(self, chains: Sequence[LegChain], now: float) -> None:
        """Have the vehicle say what these legs would take; ``leg_predictions`` of the snapshot has the answers."""
        self._try(now, lambda: self.leg_predictions.want(chains, now))

    def _follow_plans(self, event: Event, now: float) -> None:
        """Show what the vehicle holds after an upload; what is read back is shown once it has arrived."""
        if isinstance(event, MissionUploaded) and not self.plans.is_read_back(event.kind):
            self.snapshot = with_plan(self.snapshot, event.kind, self.plans.sent.get(event.kind, ()))
        verdict = self.plans.judge(event)
        if verdict is None:
            return
        kind, sent, held = verdict
        changes = plan_changes(sent, held)
        if not changes:
            self.add_line(now, f"{PLAN_TITLES[kind]} read back: as it was sent", mavlink.MAV_SEVERITY_INFO)
            return
        told = [change_text(change) for change in changes[:MAX_CHANGES_TOLD]]
        more = f"; {len(changes) - len(told)} more" if len(changes) > len(told) else ""
        text = f"{PLAN_TITLES[kind]} read back: NOT as it was sent: {'; '.join(told)}{more}"
        self.add_line(now, text, mavlink.MAV_SEVERITY_ERROR)
