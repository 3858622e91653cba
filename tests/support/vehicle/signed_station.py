"""A ground station that can sign, and the keys and peers of the tests."""

from protocol.dialect import mavlink
from protocol.wire.signing import Signature, sign_frame
from sitl.mavlink.signing_keys import KeyFile, open_keyring
from tests.support.vehicle.fake_station import Bench, FakeStation

KEY, OTHER = bytes(range(32)), bytes(range(1, 33))
T = 36_000_000_000_000  # [10 us since 2015]
LOCAL, FAR = ("127.0.0.1", 14550), ("192.0.2.7", 14550)


class SignedStation(FakeStation):
    """A ground station that can sign, on a vehicle whose keys come from its command line or its state folder."""

    def __init__(self, folder, *, given=None, clock=T, peer=LOCAL):
        keyring = open_keyring(KeyFile(folder), given or {}, timestamp=clock, now=0.0)
        super().__init__(Bench(folder, peers=[peer], node_options={"keyring": keyring}), key=peer)
        self.key, self.time = None, T
        self.raw, self.last_frame = [], b""

    def send(self, *messages):
        for message in messages:
            data = self.codec.encode(message)
            self.time += 1
            if self.key is not None:
                data = sign_frame(data, self.key, Signature(0, self.time))
            self.send_datagram(data)

    def send_datagram(self, data):
        self.raw.append(data)
        super().send_datagram(data)

    def hear(self, data):
        self.last_frame = data
        super().hear(data)

    @property
    def is_armed(self):
        return self.autopilot.armed

    def arm(self):
        self.send(
            mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 1, 0, 0, 0, 0, 0, 0)
        )
        return self.is_armed

    def set_up(self, key):
        self.send(mavlink.MAVLink_setup_signing_message(1, 1, list(key), self.time))
