"""Our ground station and a real vehicle on one link, on a virtual clock and without a socket."""

import io
from collections.abc import Hashable

from darko_gcs.station.fleet import InitialSync
from darko_gcs.station.station import Station
from protocol.tlog import TlogWriter
from sitl.mavlink.node import Node
from tests.support.vehicle.fake_station import PEER, Bench

STEP = 0.02  # [s]
TICKS_PER_STEP = 10  # of the vehicle


class LinkedStation:
    """Both ends of a link. Either can stop or be started again at any time.

    Args:
        folder: State folder of the vehicle.
        recorder: Of the station; without it, ``log`` is the recording.
        vehicle_options: Of ``Bench``: ``up=3.0`` begins in hover.
    """

    peer: Hashable = PEER  # address of the station, as the vehicle sees it

    def __init__(self, folder, *, recorder=None, **vehicle_options):
        self.folder, self.now, self.connected = folder, 1.0, True
        self.events = []  # of the station, all of them
        self.sent = []  # datagrams of the station that reached the vehicle
        self.sync = None
        self.start_vehicle(**vehicle_options)
        self.start_station(recorder)

    def start_vehicle(self, **options):
        """Start the vehicle, or replace it by one that has only its folder."""
        self.vehicle: Node | None = Bench(self.folder, **options).node

    def stop_vehicle(self):
        self.vehicle = None

    def start_station(self, recorder=None):
        """Start the station, or replace it by one that knows nothing."""
        self.log = io.BytesIO()
        self.station = Station(recorder or TlogWriter(self.log))

    def start_sync(self):
        """Request plans and parameters from a new vehicle, as the live feed does."""
        self.sync = InitialSync(self.station)

    def run(self, seconds, until=lambda: False):
        """Let time pass; true if it ended early because ``until`` became true."""
        for _ in range(round(seconds / STEP)):
            self.now += STEP
            if self.vehicle is not None:
                self.vehicle.advance(TICKS_PER_STEP)
            for data in self.arriving():
                self.receive(data)
            self.station.tick(self.now)
            events = self.station.events()
            self.events += events
            if self.sync is not None:
                self.sync.follow(events, self.now)
            for data in self.station.outgoing(self.now, self.time_usec):
                self.send(data)
            if until():
                return True
        return False

    def arriving(self):
        """Datagrams that reach the station in this step."""
        frames = [] if self.vehicle is None else [data for _, data in self.vehicle.datagrams(self.now)]
        return frames if self.connected else []

    def receive(self, data):
        return self.station.receive(data, self.now, self.time_usec)

    def send(self, data):
        if self.connected and self.vehicle is not None:
            self.sent.append(data)
            self.vehicle.receive(data, self.peer, self.now)

    @property
    def time_usec(self):
        return round(self.now * 1e6)

    @property
    def snapshot(self):
        return self.station.snapshot

    @property
    def lines(self):
        """Texts of the message log."""
        return [line.text for line in self.snapshot.log.lines]

    @property
    def text(self):
        """The whole message log."""
        return " ".join(self.lines)

    def events_of(self, kind):
        return [event for event in self.events if isinstance(event, kind)]

    def recording(self):
        """The log as a file would hold it."""
        recorder = self.station._recorder
        assert recorder is not None
        recorder.flush()
        return self.log.getvalue()
