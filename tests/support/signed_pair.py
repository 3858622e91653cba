"""The ground station and the real vehicle with keys: what is said, what is sent."""

import io

from darko_gcs.station import Station
from protocol.keyring import Keyring
from protocol.tlog import TlogWriter
from tests.support.signed_ground import FAR, LOCAL, SignedGround, T


class Pair:
    """A station over a link that says where the vehicle is, and the real vehicle."""

    def __init__(self, folder, *, key=None, vehicle_key=None, give_key=False, private=True, ahead=0):
        given = {} if vehicle_key is None else {None: vehicle_key}
        self.node = SignedGround(folder, given=given).node
        self.log, self.sent = io.BytesIO(), []
        keys = {} if key is None else {None: key}
        keyring = Keyring(keys, timestamp=T + ahead, now=1.0, floor=T + ahead if keys else 0)
        self.station = Station(TlogWriter(self.log), keyring, give_key=give_key)
        self.private, self.now, self.found = private, 1.0, False

    def run(self, seconds):
        peer = LOCAL if self.private else FAR
        for _ in range(round(seconds / 0.02)):
            self.node.advance(10)
            self.now += 0.02
            usec = round(self.now * 1e6)
            for _, data in self.node.datagrams(self.now):
                if self.station.receive(data, self.now, usec):
                    self.station.signing.is_private, self.found = self.private, True
            self.station.tick(self.now)
            for data in self.station.outgoing(self.now, usec) if self.found else ():
                self.sent.append(data)
                self.node.receive(data, peer, self.now)

    @property
    def state(self):
        return self.station.snapshot.signing

    @property
    def said(self):
        return " ".join(line.text for line in self.station.snapshot.messages)

    @property
    def is_armed(self):
        return self.node.craft.autopilot.armed
