"""A ground station that can sign."""

from protocol.dialect import mavlink
from protocol.signing import Signature, sign_frame
from sitl.wire.keys import KeyFile, open_keyring
from sitl.wire.node import Node
from tests.support.ground import Ground

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
T = 36_000_000_000_000  # [10 us since 2015]
LOCAL, FAR = ("127.0.0.1", 14550), ("192.0.2.7", 14550)


class SignedGround(Ground):
    """A ground station that can sign, on a vehicle that starts as the process starts it."""

    def __init__(self, folder, *, given=None, clock=T, peer=LOCAL):
        super().__init__(folder)
        keyring = open_keyring(KeyFile(folder), given or {}, timestamp=clock, now=self.now)
        self.node = Node(self.node.craft, self.node.memory, [peer], keyring)
        self.peer, self.key, self.time = peer, None, T
        self.raw = []
        self.heard.clear()

    def send(self, message):
        data = self.codec.encode(message)
        self.time += 1
        if self.key is not None:
            data = sign_frame(data, self.key, Signature(0, self.time))
        self.deliver(data)

    def deliver(self, data):
        self.raw.append(data)
        self.node.receive(data, self.peer, self.now)
        self.collect()

    def collect(self):
        for _, data in self.node.datagrams(self.now):
            self.last_frame = data
            self.heard += self.codec.decode(data)

    @property
    def is_armed(self):
        return self.node.craft.autopilot.armed

    def arm(self):
        self.send(mavlink.MAVLink_command_long_message(1, 1, 400, 0, 1, 0, 0, 0, 0, 0, 0))
        return self.is_armed

    def heartbeat(self):
        self.send(mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3))

    def set_up(self, key):
        self.send(mavlink.MAVLink_setup_signing_message(1, 1, list(key), self.time))
