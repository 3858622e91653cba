"""All vehicles on one link, each with a station of its own; one of them is active: shown in full, and commanded.

Plans and parameters are requested from a vehicle that appears, returns or restarts: parameters only if the operator has
looked at them before, plans again when the vehicle reports other plan ids than after the last transfer, since another
ground station has changed them. Home, mode, mission progress and the rest need no request, the vehicle sends them
regularly.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import chain

from darko_gcs.station.family_requests import APPEARANCES
from darko_gcs.station.station import Station, is_vehicle_heartbeat
from protocol.dialect import mavlink
from protocol.events import Event, MissionCleared, MissionDownloaded, MissionUploaded
from protocol.wire.message import Message, source_of

NOT_A_MISSION = -1  # id of what was downloaded as a mission while a flight plan was flown
TRANSFERS = (MissionUploaded, MissionDownloaded, MissionCleared)
MAX_VEHICLES = 50  # with stations; a flood of invented ones must not take all memory


class Fleet:
    """The stations by system id: that of the first vehicle has the link, and the others beside it share it.

    What is sent goes to the addresses of all of them; each takes what is for it.

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
            self._count()
            if len(self._beside) == 1:
                text = f"Vehicle {system} is on the link, too: o shows the next one, f commands all"
                self.lead.add_line(now, text, mavlink.MAV_SEVERITY_NOTICE)
        station = self._beside[system]
        station.endpoint.take([message], now)
        station.take([message], now)

    def _count(self) -> None:
        """Have all say which vehicle they show, now that there are several."""
        for station in self.every:
            session = station.snapshot.session._replace(vehicles=1 + len(self._beside))
            station.snapshot = station.snapshot._replace(session=session)

    def tick(self, now: float) -> None:
        """Let time pass for the stations beside the lead's."""
        for station in self._beside.values():
            station.signing.is_private = self.lead.signing.is_private
            station.tick(now)

    def commands(self, system: int) -> bool:
        """Whether a vehicle is one beside the lead's."""
        return system in self._beside

    def outgoing(self) -> list[bytes]:
        """Datagrams of the stations beside the lead's; the lead records and sends them."""
        return list(chain.from_iterable(station.endpoint.datagrams_to_send() for station in self._beside.values()))


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
        self._shows_parameters |= bool(self._station.snapshot.parameters.values)
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
        ids = self._station.snapshot.mission.plan_ids
        if ids is None or ids.time <= self._last_transfer:
            return False
        before, self._plan_ids = self._plan_ids, ids[1:]
        if self._station.snapshot.flies_plan:  # its present leg is shown as a mission, which changes all the time
            self._plan_ids = (NOT_A_MISSION if before is None else before[0], *ids[2:])
        return before not in {None, self._plan_ids}
