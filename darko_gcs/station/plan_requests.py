"""The operator's requests about mission, fence, rally points and flight plan, and the transfers of the first three.

https://mavlink.io/en/services/mission.html
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from darko_gcs.state.plan_difference import read_back_fault
from darko_gcs.state.text import counted
from darko_gcs.state.values import FENCE, MISSION, PLAN_TITLES, PLAN_TYPES, RALLY, Items
from protocol import units
from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.engines.table_values import plan_key
from protocol.events import CurrentItemSet, Event, MissionCleared, MissionDownloaded, MissionFailed, MissionUploaded
from protocol.frames import Vector
from protocol.names import Mode
from protocol.plans import MissionItem

if TYPE_CHECKING:
    from darko_gcs.station.station import Station

UPLOAD_ORDER = (FENCE, RALLY, MISSION)  # no mission without the fence and rally points that belong to it
TRANSFER_ENDS = (MissionUploaded, MissionDownloaded, MissionCleared, CurrentItemSet, MissionFailed)

Step = Callable[[float], object]  # starts one transfer at a time [s]


class PlanTransfer:
    """Transfers several plans through one endpoint, which carries one plan at a time.

    An upload ends at the first plan that the vehicle refuses. A download skips the plans that the vehicle does not
    support. A request that comes during a download waits for the plan under way and replaces the rest of the download.

    Args:
        endpoint: The ground station's; hand its events to ``follow``.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._steps: deque[Step] = deque()  # still to come
        self._is_downloading = False
        self._has_waiting_request = False  # the steps belong to a request that came during the download
        self._verified: set[int] = set()  # plans that are read back, and compared with what was sent
        self._instead: list[Step] = []  # steps of an upload that takes the place of the one under way if it fails
        self.sent: dict[int, Items] = {}  # last plan sent, by MAV_MISSION_TYPE

    # Each request raises LocalProtocolError if no vehicle has been found, or another request is under way.

    def upload(
        self,
        plans: Mapping[int, Sequence[MissionItem]],
        now: float,
        *,
        verify: bool = False,
        current: int | None = None,
    ) -> None:
        """Replace plans of the vehicle, by MAV_MISSION_TYPE.

        Args:
            plans: The new ones.
            now: Now [s].
            verify: Read them back and compare; see ``judge``.
            current: Item at which the mission goes on; None: as the vehicle has it after an upload.
        """
        self._begin(self._whole({kind: tuple(items) for kind, items in plans.items()}, verify, current), now)

    def write_items(self, items: Sequence[MissionItem], changed: range, current: int | None, now: float) -> None:
        """Replace some items of the mission and read it back; all of it, if the vehicle takes no single items.

        Args:
            items: All items as they are to be.
            changed: Numbers of those that differ from the vehicle's.
            current: Item at which the mission goes on if all of it was sent.
            now: Now [s].
        """
        new = tuple(items)

        def step(then: float) -> None:
            self._endpoint.write_mission_items(new, changed, then)
            self.sent[MISSION] = new
            self._verified = {MISSION}

        self._begin([step, self._downloading(MISSION)], now)
        self._instead = self._whole({MISSION: new}, True, current)

    def _whole(self, plans: Mapping[int, Items], verify: bool, current: int | None) -> list[Step]:
        kinds = [kind for kind in UPLOAD_ORDER if kind in plans]
        steps = [self._uploading(kind, plans[kind], verify=verify) for kind in kinds]
        steps += [self._downloading(kind) for kind in kinds if verify]
        if current is not None and current < len(plans.get(MISSION, ())):
            steps.append(lambda then: self._endpoint.set_current_mission_item(current, then))
        return steps

    def judge(self, event: Event) -> tuple[int, Items, Items] | None:
        """The MAV_MISSION_TYPE, what was sent and what the vehicle has, if an event ends the reading back of a plan."""
        if not isinstance(event, MissionDownloaded) or event.kind not in self._verified:
            return None
        self._verified.discard(event.kind)
        return event.kind, self.sent.get(event.kind, ()), event.items

    def is_read_back(self, kind: int) -> bool:
        """True while a plan that was sent is still to be compared."""
        return kind in self._verified

    def clear(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE."""
        self._begin([lambda then: self._endpoint.clear_mission(then, kind)], now)

    def set_current(self, seq: int, now: float) -> None:
        """Continue the mission at an item."""
        self._begin([lambda then: self._endpoint.set_current_mission_item(seq, then)], now)

    def download(self, now: float) -> None:
        """Fetch all three plans of the vehicle."""
        steps = [self._downloading(kind) for kind in PLAN_TYPES]
        steps[0](now)
        self._verified, self._instead = set(), []
        self._steps, self._is_downloading, self._has_waiting_request = deque(steps[1:]), True, False

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint; the end of one transfer starts the next."""
        if not isinstance(event, TRANSFER_ENDS):
            return
        if not self._has_waiting_request:
            if isinstance(event, MissionFailed) and not _is_unsupported(event):
                self._steps = deque(self._instead if event.operation == "upload" else ())
                self._verified = set()
            self._instead = []
        self._is_downloading = self._is_downloading and not self._has_waiting_request and bool(self._steps)
        self._has_waiting_request = False
        if self._steps:
            self._steps.popleft()(now)

    def cancel(self) -> None:
        """Drop the transfers still to come: the vehicle restarted."""
        self._steps.clear()
        self._verified, self._instead = set(), []

    def _begin(self, steps: list[Step], now: float) -> None:
        if self._is_downloading:
            self._steps, self._has_waiting_request = deque(steps), True
            return
        steps[0](now)
        self._steps, self._instead = deque(steps[1:]), []

    def _uploading(self, kind: int, items: Items, *, verify: bool) -> Step:
        def step(now: float) -> None:
            self._endpoint.upload_mission(items, now=now, kind=kind)
            self.sent[kind] = items  # only after the endpoint took it: a refused request uploads nothing
            self._verified = self._verified | {kind} if verify else self._verified - {kind}

        return step

    def _downloading(self, kind: int) -> Step:
        return lambda now: self._endpoint.download_mission(now, kind)


def _is_unsupported(event: MissionFailed) -> bool:
    """True if the vehicle answered a download with an error: it has no plan of this type."""
    return event.operation == "download" and event.result is not None


class PlanRequests:
    """Requests about the plans that a vehicle holds; the message log shows the result of each.

    Args:
        context: The station; it hands the endpoint's events to ``follow``.
    """

    def __init__(self, context: Station) -> None:
        self._context = context
        self._transfer = PlanTransfer(context.endpoint)

    def upload(
        self,
        items: Sequence[MissionItem] | None,
        now: float,
        *,
        fence: Sequence[MissionItem] = (),
        rally: Sequence[MissionItem] = (),
        verify: bool = False,
        current: int | None = None,
    ) -> None:
        """Replace the vehicle's mission, its fence and rally points, as far as new ones are given.

        Args:
            items: The mission; None: it stays as it is.
            now: Now [s].
            fence: Of the plan.
            rally: Rally points of the plan.
            verify: Read the plans back and compare them with what was sent.
            current: Item at which the mission goes on; None: as the vehicle has it after an upload.
        """
        plans = {kind: part for kind, part in ((FENCE, fence), (RALLY, rally)) if part}
        plans |= {} if items is None else {MISSION: items}
        self._context.attempt(now, lambda: self._transfer.upload(plans, now, verify=verify, current=current))

    def replace_items(self, items: Sequence[MissionItem], changed: range, now: float) -> None:
        """Replace some items of a mission that is being flown; it goes on.

        Args:
            items: All items as they are to be.
            changed: Numbers of those that differ from the vehicle's.
            now: Now [s].
        """
        current = self._context.snapshot.mission.current
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

    def start_mission(self, now: float, *, first: int | None = None, arm: bool = False) -> None:
        """Fly the mission from an item; None: from its current one. With ``arm`` start the motors first."""
        seq = math.nan if first is None else float(first)

        def send() -> None:
            self._context.attempt(
                now, lambda: self._context.endpoint.command(mavlink.MAV_CMD_MISSION_START, seq, math.nan, now=now)
            )

        self._context.arm_for(mavlink.MAV_CMD_MISSION_START, send, now) if arm else send()

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
            s = self._context.snapshot
            self._context.snapshot = s._replace(plans=s.plans.with_plan(event.kind, sent))

    def _show_comparison(self, event: Event, now: float) -> None:
        """Say how a plan that was read back differs from what was sent."""
        verdict = self._transfer.judge(event)
        if verdict is None:
            return
        kind, sent, held = verdict
        fault = read_back_fault(kind, sent, held)
        text = fault or f"{PLAN_TITLES[kind]} of {counted(len(sent), 'item')} is on the vehicle, read back as sent"
        self._context.add_line(now, text, mavlink.MAV_SEVERITY_ERROR if fault else mavlink.MAV_SEVERITY_INFO)


_NAN = math.nan


class FlightPlanRequests:
    """Requests about blocks, waypoints and variables; the message log shows the result of each.

    A request names the plan that the operator sees, so that it cannot reach another one by its numbers.

    Args:
        context: The station.
    """

    def __init__(self, context: Station) -> None:
        self._context = context

    def start(self, now: float) -> None:
        """Fly the flight plan, from where it is."""
        self._context.set_mode(Mode.FLIGHT_PLAN, now)

    def jump_to_block(self, number: int, now: float) -> None:
        """Enter a block."""
        command = mavlink.MAV_CMD_DARKO_JUMP_TO_BLOCK
        self._context.attempt(
            now, lambda: self._context.endpoint.command(command, float(number), self._plan_key, now=now)
        )

    def set_variable(self, number: int, value: float, now: float) -> None:
        """Set a variable."""
        command = mavlink.MAV_CMD_DARKO_SET_VARIABLE
        self._context.attempt(
            now, lambda: self._context.endpoint.command(command, float(number), self._plan_key, value, now=now)
        )

    def move_waypoint(self, number: int, place: Vector, now: float) -> None:
        """Put a waypoint to a place: east, north and up of the plan's origin [m]."""
        frame, command = mavlink.MAV_FRAME_LOCAL_ENU, mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT
        params = (float(number), self._plan_key, _NAN, _NAN)

        def request() -> None:
            x, y = units.local_e4(place[0]), units.local_e4(place[1])
            self._context.endpoint.command_int(command, frame, *params, x, y, place[2], now=now)

        self._context.attempt(now, request)

    def load(self, data: bytes, now: float) -> None:
        """Have the vehicle load a plan from the content of its file, which includes nothing."""
        self._context.attempt(now, lambda: self._context.endpoint.send_flight_plan(data, now))

    def fetch(self) -> None:
        """Download the flight plan anew."""
        self._context.endpoint.request_flight_plan()

    @property
    def _plan_key(self) -> float:
        plan = self._context.snapshot.flight_plan
        return _NAN if plan is None else plan_key(plan.plan_id)
