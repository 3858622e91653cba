"""The ground station and the real vehicle node, on virtual time and without a socket."""

import io

from darko_gcs.station import Station
from protocol.tlog import TlogWriter
from tests.support.ground import PEER, Ground


class Pair:
    """Both ends, in steps of 20 ms."""

    def __init__(self, folder):
        self.vehicle = Ground(folder).node
        self.log = io.BytesIO()
        self.station = Station(TlogWriter(self.log))
        self.now, self.connected = 1.0, True

    def run(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.vehicle.advance(10)
            self.now += 0.02
            usec = round(self.now * 1e6)
            for _, data in self.vehicle.datagrams(self.now):
                if self.connected:
                    self.station.receive(data, self.now, usec)
            self.station.tick(self.now)
            for data in self.station.outgoing(self.now, usec):
                if self.connected:
                    self.vehicle.receive(data, PEER, self.now)

    @property
    def snapshot(self):
        return self.station.snapshot
