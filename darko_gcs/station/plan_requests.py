"""The operator's requests about the vehicle's mission, fence and rally points."""

from __future__ import annotations

import math
from collections.abc import Sequence

from darko_gcs.state.missions.plan_difference import read_back_fault
from darko_gcs.state.missions.plan_parts import FENCE, MISSION, PLAN_TITLES, RALLY, with_plan
from darko_gcs.state.text import counted
from darko_gcs.station.family_requests import RequestContext
from darko_gcs.station.plan_transfer import PlanTransfer
from protocol.dialect import mavlink
from protocol.events import Event, MissionDownloaded, MissionUploaded
from protocol.plans import MissionItem


class PlanRequests:
    """Requests about the plans that a vehicle holds; the message log shows the result of each.

    Args:
        context: The station; it hands the endpoint's events to ``follow``.
    """

    def __init__(self, context: RequestContext) -> None:
        self._context = context
        self._transfer = PlanTransfer(context.endpoint)

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
        self._context.attempt(
            now, lambda: self._transfer.upload({MISSION: items, **limits}, now, verify=verify, current=current)
        )

    def replace_items(self, items: Sequence[MissionItem], changed: range, now: float) -> None:
        """Replace some items of a mission that is being flown; it goes on.

        Args:
            items: All items as they are to be.
            changed: Numbers of those that differ from the vehicle's.
            now: Now [s].
        """
        current = self._context.snapshot.mission_current
        self._context.attempt(now, lambda: self._transfer.write_items(items, changed, current, now))

    def download(self, now: float) -> None:
        """Fetch the vehicle's mission, fence and rally points."""
        self._context.attempt(now, lambda: self._transfer.download(now))

    def clear(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE; 255: mission, fence and rally points."""
        self._context.attempt(now, lambda: self._transfer.clear(kind, now))

    def set_current(self, seq: int, now: float) -> None:
        """Continue or begin the mission at one of its items."""
        self._context.attempt(now, lambda: self._transfer.set_current(seq, now))

    def start_mission(self, now: float, *, first: int | None = None) -> None:
        """Fly the mission from an item; None: from its current one."""
        seq = math.nan if first is None else float(first)
        self._context.attempt(
            now, lambda: self._context.endpoint.command(mavlink.MAV_CMD_MISSION_START, seq, math.nan, now=now)
        )

    def cancel(self) -> None:
        """Give up what is under way, as after a restart of the vehicle."""
        self._transfer.cancel()

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint: show what the vehicle holds, and go on with the transfer."""
        self._show_upload(event)
        self._show_comparison(event, now)
        self._transfer.follow(event, now)

    def is_told_later(self, event: Event) -> bool:
        """True if an event is a step of an upload that is read back: one line tells of it at its end."""
        if isinstance(event, MissionUploaded) and event.is_partial:
            return False
        return isinstance(event, MissionUploaded | MissionDownloaded) and self._transfer.is_read_back(event.kind)

    def _show_upload(self, event: Event) -> None:
        """Show an uploaded plan; one that is read back is shown once it has arrived."""
        if isinstance(event, MissionUploaded) and not self._transfer.is_read_back(event.kind):
            sent = self._transfer.sent.get(event.kind, ())
            self._context.snapshot = with_plan(self._context.snapshot, event.kind, sent)

    def _show_comparison(self, event: Event, now: float) -> None:
        """Say how a plan that was read back differs from what was sent."""
        verdict = self._transfer.judge(event)
        if verdict is None:
            return
        kind, sent, held = verdict
        fault = read_back_fault(kind, sent, held)
        text = fault or f"{PLAN_TITLES[kind]} of {counted(len(sent), 'item')} is on the vehicle, read back as sent"
        self._context.add_line(now, text, mavlink.MAV_SEVERITY_ERROR if fault else mavlink.MAV_SEVERITY_INFO)
