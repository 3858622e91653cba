"""All vehicles on one link, each with a station of its own; one of them is active: shown in full, and commanded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import chain

from darko_gcs.station.other_vehicles import is_vehicle_heartbeat
from darko_gcs.station.station import Station
from protocol.dialect import mavlink
from protocol.wire.message import Message, source_of

MAX_VEHICLES = 50  # with stations; a flood of invented ones must not take all memory


class Fleet:
    """The stations by system id: that of the first vehicle has the link, and the others beside it share it.

    Every vehicle is expected at the address of the first: answers and requests go there.

    Args:
        lead: The station that has the link.
    """

    def __init__(self, lead: Station) -> None:
        self.lead = self.active = lead
        self._beside: dict[int, Station] = {}
        lead.others = self

    @property
    def stations(self) -> Mapping[int, Station]:
        """The stations of all vehicles heard so far, by ascending system id."""
        lead = self.lead.endpoint.vehicle
        own = {} if lead is None else {lead[0]: self.lead}
        return dict(sorted((own | self._beside).items()))

    @property
    def every(self) -> Sequence[Station]:
        """All stations, also while no vehicle has been heard."""
        return (self.lead, *self._beside.values())

    def choose(self, system: int) -> None:
        """Make a vehicle the active one; one that was never heard changes nothing."""
        self.active = self.stations.get(system, self.active)

    def choose_next(self, step: int) -> None:
        """Make the next vehicle by system id the active one, or with -1 the one before; after the last, the first."""
        stations = list(self.stations.values())
        if self.active in stations:
            self.active = stations[(stations.index(self.active) + step) % len(stations)]

    # As the lead's ``OtherVehicles``

    def take(self, message: Message, now: float) -> None:
        """Take a message of a vehicle beside the lead's; its first HEARTBEAT makes it known."""
        system = source_of(message)[0]
        if system not in self._beside:
            if not is_vehicle_heartbeat(message) or len(self._beside) >= MAX_VEHICLES - 1:
                return
            self._beside[system] = Station(vehicle=system, beside=self.lead.endpoint)
            if len(self._beside) == 1:
                text = f"Vehicle {system} is on the link, too: o shows the next one, f commands all"
                self.lead.add_line(now, text, mavlink.MAV_SEVERITY_NOTICE)
        station = self._beside[system]
        station.endpoint.take([message], now)
        station.take([message], now)

    def tick(self, now: float) -> None:
        """Let time pass for the stations beside the lead's."""
        for station in self._beside.values():
            station.signing.is_private = self.lead.signing.is_private
            station.tick(now)

    def outgoing(self) -> list[bytes]:
        """Datagrams of the stations beside the lead's; the lead records and sends them."""
        return list(chain.from_iterable(station.endpoint.datagrams_to_send() for station in self._beside.values()))
