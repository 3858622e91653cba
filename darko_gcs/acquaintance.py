"""What a vehicle is asked for when it appears, returns or starts anew: its mission, and the thresholds that are shown.

Home, mode, mission progress and all the rest it tells by itself.
"""

from __future__ import annotations

from collections.abc import Iterable

from darko_gcs.station import Station
from protocol.events import Event, VehicleFound, VehicleRestarted, VehicleReturned

__all__ = ["Acquaintance"]

APPEARANCES = (VehicleFound, VehicleReturned, VehicleRestarted)


class Acquaintance:
    """Makes a station know its vehicle.

    Args:
        station: It says in its log what came of each request.
    """

    def __init__(self, station: Station) -> None:
        self._station = station
        self._wants_mission = self._wants_parameters = False

    def follow(self, events: Iterable[Event], now: float) -> None:
        """Take what happened, and ask when nothing else waits for an answer.

        Args:
            events: All of the station's since the last call.
            now: On the station's clock [s].
        """
        if any(isinstance(event, APPEARANCES) for event in events):
            self._wants_mission = self._wants_parameters = True
        endpoint = self._station.endpoint
        if not endpoint.is_present or endpoint.is_busy:
            return
        if self._wants_mission:
            self._wants_mission = False
            self._station.download(now)
        elif self._wants_parameters and self._station.snapshot.hybrid is not None:
            self._wants_parameters = False  # no other autopilot is asked for its thousand
            self._station.fetch_parameters(now)
