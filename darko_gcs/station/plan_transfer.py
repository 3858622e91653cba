"""Moves the three plans that a vehicle holds (mission, fence, rally points) over the link, one after another.

https://mavlink.io/en/services/mission.html
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping, Sequence

from darko_gcs.state.missions.plan_parts import FENCE, MISSION, PLAN_TYPES, RALLY, Items
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.events import CurrentItemSet, Event, MissionCleared, MissionDownloaded, MissionFailed, MissionUploaded
from protocol.plans import MissionItem

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
