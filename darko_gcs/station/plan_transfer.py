"""Moves the three plans that a vehicle holds (mission, fence, rally points) over the link, one after another.

https://mavlink.io/en/services/mission.html
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

from darko_gcs.state.plan_parts import FENCE, MISSION, PLAN_TYPES, RALLY, Items
from protocol.endpoint_ground import GroundEndpoint
from protocol.events import CurrentItemSet, Event, MissionCleared, MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans import MissionItem

__all__ = ["PlanTransfer"]

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
        self.sent: dict[int, Items] = {}  # last plan sent, by MAV_MISSION_TYPE

    # Each request raises LocalProtocolError if no vehicle has been found, or another request is under way.

    def upload(self, plans: Mapping[int, Sequence[MissionItem]], now: float) -> None:
        """Replace plans of the vehicle, by MAV_MISSION_TYPE."""
        self._start([self._uploading(kind, tuple(plans[kind])) for kind in UPLOAD_ORDER if kind in plans], now)

    def clear(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE."""
        self._start([lambda then: self._endpoint.clear_mission(then, kind)], now)

    def set_current(self, seq: int, now: float) -> None:
        """Continue the mission at an item."""
        self._start([lambda then: self._endpoint.set_current_mission_item(seq, then)], now)

    def download(self, now: float) -> None:
        """Fetch all three plans of the vehicle."""
        steps = [self._downloading(kind) for kind in PLAN_TYPES]
        steps[0](now)
        self._steps, self._is_downloading, self._has_waiting_request = deque(steps[1:]), True, False

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint; the end of one transfer starts the next."""
        if not isinstance(event, TRANSFER_ENDS):
            return
        if isinstance(event, MissionFailed) and not self._has_waiting_request and not _is_unsupported(event):
            self._steps.clear()
        self._is_downloading = self._is_downloading and not self._has_waiting_request and bool(self._steps)
        self._has_waiting_request = False
        if self._steps:
            self._steps.popleft()(now)

    def cancel(self) -> None:
        """Drop the transfers still to come: the vehicle restarted."""
        self._steps.clear()

    def _start(self, steps: list[Step], now: float) -> None:
        if self._is_downloading:
            self._steps, self._has_waiting_request = deque(steps), True
            return
        steps[0](now)
        self._steps = deque(steps[1:])

    def _uploading(self, kind: int, items: Items) -> Step:
        def step(now: float) -> None:
            self._endpoint.upload_mission(items, now=now, kind=kind)
            self.sent[kind] = items  # only after the endpoint took it: a refused request uploads nothing

        return step

    def _downloading(self, kind: int) -> Step:
        return lambda now: self._endpoint.download_mission(now, kind)


def _is_unsupported(event: MissionFailed) -> bool:
    """True if the vehicle answered a download with an error: it has no plan of this type."""
    return event.operation == "download" and event.result is not None
