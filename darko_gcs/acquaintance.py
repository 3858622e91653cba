"""What a vehicle is asked for when it appears, returns or starts anew: its plans, and parameters if they were shown.

Its plans again when it tells of others than those that were moved last: another ground station was there.

Home, mode, mission progress and all the rest it tells by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from darko_gcs.station import Station
from protocol.events import (
    Event,
    MissionCleared,
    MissionDownloaded,
    MissionUploaded,
    VehicleFound,
    VehicleRestarted,
    VehicleReturned,
)

__all__ = ["Acquaintance"]

MOVES = (MissionUploaded, MissionDownloaded, MissionCleared)
APPEARANCES = (VehicleFound, VehicleReturned, VehicleRestarted)


class Acquaintance:
    """Makes a station know its vehicle.

    Args:
        station: It says in its log what came of each request.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._wants_mission = self._wants_parameters = False
        self._shows_parameters = False  # somebody looked at them
        self._moved_at = -math.inf  # when plans were last moved over this link [s]
        self._known: tuple[int, ...] | None = None  # the ids that the vehicle told of since

    def follow(self, events: Sequence[Event], now: float) -> None:
        """Take what happened, and ask when nothing else waits for an answer.

        Args:
            events: All of the station's since the last call.
            now: On the station's clock [s].
        """
        self._shows_parameters |= bool(self._station.snapshot.parameters)
        if any(isinstance(event, APPEARANCES) for event in events):
            self._wants_mission, self._wants_parameters = True, self._shows_parameters
        if any(isinstance(event, MOVES) for event in events):
            self._moved_at, self._known = now, None
        self._wants_mission |= self._has_others()
        endpoint = self._station.endpoint
        if not endpoint.is_present or endpoint.is_busy:
            return
        if self._wants_mission:
            self._wants_mission = False
            self._station.download(now)
        elif self._wants_parameters:
            self._wants_parameters = False
            self._station.fetch_parameters(now)

    def _has_others(self) -> bool:
        """Whether the vehicle tells of other plans than at first after the last move; true once."""
        told = self._station.snapshot.plan_ids
        if told is None or told.time <= self._moved_at:
            return False
        before, self._known = self._known, told[1:]
        return before not in {None, self._known}
