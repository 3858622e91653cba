"""The three plans that a vehicle holds (mission, fence, rally points), moved over the link one after another.

https://mavlink.io/en/services/mission.html
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

from darko_gcs.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.endpoint import GroundEndpoint
from protocol.events import CurrentItemSet, Event, MissionCleared, MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans.mission import MissionItem

__all__ = ["ALL", "FENCE", "MISSION", "PARTS", "RALLY", "PlanDesk", "with_part"]

MISSION = mavlink.MAV_MISSION_TYPE_MISSION
FENCE = mavlink.MAV_MISSION_TYPE_FENCE
RALLY = mavlink.MAV_MISSION_TYPE_RALLY
ALL = mavlink.MAV_MISSION_TYPE_ALL
PARTS = {MISSION: "mission", FENCE: "fence", RALLY: "rally"}  # MAV_MISSION_TYPE: the snapshot's field
ORDER = (FENCE, RALLY, MISSION)  # of an upload: no mission without the limits that belong to it
ENDS = (MissionUploaded, MissionDownloaded, MissionCleared, CurrentItemSet, MissionFailed)

Items = tuple[MissionItem, ...]
Request = Callable[[float], object]


def with_part(s: Snapshot, kind: int, items: Items) -> Snapshot:
    """The snapshot with another plan of a MAV_MISSION_TYPE; ALL: of each."""
    fields = PARTS.values() if kind == ALL else (PARTS[kind],) if kind in PARTS else ()
    return replace(s, **dict.fromkeys(fields, items))  # type: ignore[arg-type]  # the fields all hold items


class PlanDesk:
    """Has one endpoint move several plans, of which the link carries one at a time.

    An upload ends at the first plan that the vehicle does not accept; a download leaves out what the vehicle does not
    keep. An order that comes during a download ends that after the plan under way, and follows it.

    Args:
        endpoint: The ground station's; its events are to be handed to ``follow``.
    """

    def __init__(self, endpoint: GroundEndpoint) -> None:
        self._endpoint = endpoint
        self._left: deque[Request] = deque()
        self._reads = False  # a plan is being downloaded,
        self._waits = False  # and what is left are orders that came meanwhile
        self.sent: dict[int, Items] = {}  # what was last sent, by MAV_MISSION_TYPE

    # Each raises LocalProtocolError if no vehicle has been found, or another order is under way.

    def upload(self, plans: Mapping[int, Sequence[MissionItem]], now: float) -> None:
        """Replace plans of the vehicle, by MAV_MISSION_TYPE."""
        self._order([self._uploading(kind, tuple(plans[kind])) for kind in ORDER if kind in plans], now)

    def clear(self, kind: int, now: float) -> None:
        """Delete the vehicle's plan of a MAV_MISSION_TYPE."""
        self._order([lambda then: self._endpoint.clear_mission(then, kind)], now)

    def set_current(self, seq: int, now: float) -> None:
        """Let the mission go on at an item."""
        self._order([lambda then: self._endpoint.set_current_mission_item(seq, then)], now)

    def download(self, now: float) -> None:
        """Fetch all three plans of the vehicle."""
        requests = [self._downloading(kind) for kind in PARTS]
        requests[0](now)
        self._left, self._reads, self._waits = deque(requests[1:]), True, False

    def follow(self, event: Event, now: float) -> None:
        """Take an event of the endpoint; the end of one plan begins the next."""
        if not isinstance(event, ENDS):
            return
        if isinstance(event, MissionFailed) and not self._waits and not _is_not_kept(event):
            self._left.clear()
        self._reads = self._reads and not self._waits and bool(self._left)
        self._waits = False
        if self._left:
            self._left.popleft()(now)

    def forget(self) -> None:
        """Ask for nothing more: the vehicle that was asked is not there any more."""
        self._left.clear()

    def _order(self, requests: list[Request], now: float) -> None:
        if self._reads:
            self._left, self._waits = deque(requests), True
            return
        requests[0](now)
        self._left = deque(requests[1:])

    def _uploading(self, kind: int, items: Items) -> Request:
        def request(now: float) -> None:
            self._endpoint.upload_mission(items, now=now, kind=kind)
            self.sent[kind] = items  # one that is refused is not what will have been uploaded

        return request

    def _downloading(self, kind: int) -> Request:
        return lambda now: self._endpoint.download_mission(now, kind)


def _is_not_kept(event: MissionFailed) -> bool:
    """True where the vehicle answered that it has no plan of this type to tell."""
    return event.operation == "download" and event.result is not None
