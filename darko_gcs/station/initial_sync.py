"""Requests plans and parameters from a vehicle that appears, returns or restarts.

Parameters are requested only if the operator has looked at them before. Plans are requested again when the vehicle
reports other plan ids than after the last transfer: another ground station has changed them. Home, mode, mission
progress and the rest need no request, the vehicle sends them regularly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from darko_gcs.station.family_requests import APPEARANCES
from darko_gcs.station.station import Station
from protocol.events import (
    Event,
    MissionCleared,
    MissionDownloaded,
    MissionUploaded,
)

NOT_A_MISSION = -1  # id of what was downloaded as a mission while a flight plan was flown
TRANSFERS = (MissionUploaded, MissionDownloaded, MissionCleared)


class InitialSync:
    """Keeps a station's plans and parameters those of its vehicle.

    Args:
        station: Sends the requests; its message log shows the results.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._needs_plans = self._needs_parameters = False
        self._shows_parameters = False  # the operator has looked at them
        self._last_transfer = -math.inf  # of a plan over this link [s]
        self._plan_ids: tuple[int, ...] | None = None  # first ones reported after the last transfer

    def follow(self, events: Sequence[Event], now: float) -> None:
        """Take events, and send the next request as soon as no other one waits for an answer.

        Args:
            events: All events of the station since the last call.
            now: On the station's clock [s].
        """
        self._shows_parameters |= bool(self._station.snapshot.parameters)
        if any(isinstance(event, APPEARANCES) for event in events):
            self._needs_plans, self._needs_parameters = True, self._shows_parameters
        if any(isinstance(event, TRANSFERS) for event in events):
            self._last_transfer, self._plan_ids = now, None
        self._needs_plans |= self._plans_changed()
        endpoint = self._station.endpoint
        if not endpoint.is_present or endpoint.is_busy:
            return
        if self._needs_plans:
            self._needs_plans = False
            self._station.plans.download(now)
        elif self._needs_parameters:
            self._needs_parameters = False
            self._station.fetch_parameters(now)

    def _plans_changed(self) -> bool:
        """True once if the vehicle reports other plan ids than the first ones after the last transfer."""
        ids = self._station.snapshot.plan_ids
        if ids is None or ids.time <= self._last_transfer:
            return False
        before, self._plan_ids = self._plan_ids, ids[1:]
        if self._station.snapshot.flies_plan:  # its present leg is shown as a mission, which changes all the time
            self._plan_ids = (NOT_A_MISSION if before is None else before[0], *ids[2:])
        return before not in {None, self._plan_ids}
