"""A NatNet stream of a motion, handed to a bridge on a virtual clock."""

from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from protocol.wire.signing import Keyring
from sitl.motion_capture.natnet_server import NatnetServer
from tests.support.motion_capture.hall import UNICAST, cameras, motion

BEGAN = 1000.0  # our clock when the cameras' clock is 0 [s]


class Stream:
    """Cameras, server and bridge; ``sent`` is what goes to the vehicle, with its time.

    Args:
        at: The true motion as a function of time.
        settings: Of the bridge.
        vehicle: Takes what is sent, and says what it wants; None: nobody.
        clock: Of the stamps.
        network: From server to bridge [s].
        keyring: Of the bridge.
        options: Of ``cameras``.
    """

    def __init__(
        self, at=motion, *, settings=None, vehicle=None, clock="auto", network=0.0, keyring=None, **options
    ):  # fmt: skip
        self.cameras = cameras(**options)
        self.server = NatnetServer(self.cameras.body, (3, 1), 200.0, UNICAST)
        self.natnet, self.autopilot = NatnetLink(), AutopilotLink(1, keyring or Keyring(), clock)
        self.bridge = PoseBridge(settings or BridgeSettings(), self.natnet, self.autopilot)
        self.at, self.vehicle, self.network = at, vehicle, network
        self.time, self.sent, self.is_down = 0.0, [], False
        self._on_their_way = []

    @property
    def now(self):
        return BEGAN + self.time

    def run(self, seconds):
        for _ in range(round(1000 * seconds)):
            self.time = round(self.time + 0.001, 6)
            self._step()

    def said(self, words):
        return [line for line in self.bridge.said if words in line]

    def _step(self):
        now = self.now
        if round(1000 * self.time) % 10 == 0:
            self.cameras.look(self.at(self.time))
        if not self.is_down:
            for request in self.natnet.requests(now):
                for answer in self.server.receive(request, "client", now):
                    self.bridge.from_server(answer, now)
        for frame in self.cameras.frames(self.time):
            self._on_their_way += (
                [] if self.is_down else [(now + self.network, d) for _, d in self.server.send(frame, now)]
            )
        while self._on_their_way and self._on_their_way[0][0] <= now + 1e-9:
            self._send(self.bridge.from_server(self._on_their_way.pop(0)[1], now))
        if self.vehicle is not None and round(1000 * self.time) % 100 == 0:
            self.bridge.from_vehicle(self.vehicle.beat(now), now)
        self._send(self.autopilot.outgoing(now))
        self.bridge.handle_timer(now)

    def _send(self, datagrams):
        for data in datagrams:
            self.sent.append((self.now, data))
            if self.vehicle is not None:
                self.vehicle.receive(data, self.now)
