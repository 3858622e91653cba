"""Our ground station and a real vehicle with signing keys."""

import io
from collections.abc import Hashable
from typing import Any

from darko_gcs.station.station import Station
from protocol.tlog import TlogWriter
from protocol.wire.signing import Keyring
from tests.support.gcs.linked_station import LinkedStation
from tests.support.vehicle.signed_station import FAR, LOCAL, SignedStation, T


class SignedLink(LinkedStation):
    """A link on which either side may have a key.

    Args:
        folder: State folder of the vehicle.
        key: Of the station.
        vehicle_key: Of the vehicle.
        give_key: The station gives its key to a vehicle without one.
        private: The vehicle is reached over loopback.
        clock: Wall clock of the station when it starts [10 us since 2015].
        time_file: Where the station saves its signing time.
    """

    def __init__(self, folder, *, key=None, vehicle_key=None, give_key=False, private=True, clock=T, time_file=None):
        self._keys: dict[Hashable, bytes] = {} if key is None else {None: key}
        self._vehicle_keys = {} if vehicle_key is None else {None: vehicle_key}
        self._give_key, self._private, self._clock, self._time_file = give_key, private, clock, time_file
        self._is_heard = False
        self.peer = LOCAL if private else FAR
        super().__init__(folder)

    def start_vehicle(self, *, clock=T, **options):
        self.vehicle = SignedStation(self.folder, given=self._vehicle_keys, clock=clock, **options).node

    def start_station(self, recorder=None, *, clock=None):
        started = self._clock if clock is None else clock
        options: dict[str, Any] = {}
        if self._time_file is not None:
            started = max(started, self._time_file.load())
            options["keep"] = lambda record: self._time_file.save(record.timestamp)
        floor = started if self._keys else 0
        keyring = Keyring(self._keys, timestamp=started, now=self.now, floor=floor, **options)
        self.log = io.BytesIO()
        self.station = Station(recorder or TlogWriter(self.log), keyring, give_key=self._give_key)

    def receive(self, data):
        if super().receive(data):
            self.station.signing.is_private, self._is_heard = self._private, True

    def send(self, data):
        if self._is_heard:  # before, the station has no address to send to
            super().send(data)

    @property
    def state(self):
        return self.snapshot.link.signing

    @property
    def is_armed(self):
        assert self.vehicle is not None
        return self.vehicle.aircraft.autopilot.armed
