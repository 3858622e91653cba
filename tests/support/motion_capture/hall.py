"""A hall with cameras, a bridge and a vehicle, byte for byte, on a virtual clock and without a socket."""

import numpy as np
from scipy.spatial.transform import Rotation

from darko_gcs.motion_capture.bridge_links import AutopilotLink, NatnetLink
from darko_gcs.motion_capture.pose_bridge import BridgeSettings, PoseBridge
from darko_gcs.motion_capture.poses import AxesSettings
from protocol.natnet import Address
from protocol.wire.signing import TICKS_PER_SECOND, Keyring
from sitl.motion_capture.cameras import Cameras, Disturbances, HallAxes, TrueMotion, read_disturbance
from sitl.motion_capture.motive_process import VehicleWatch
from sitl.motion_capture.natnet_server import NatnetServer
from sitl.motion_capture.rigid_body import load_rigid_body
from sitl.sensors.sensor_files import load_sensors
from tests.support.vehicle.signed_station import T

ENAC = HallAxes()
IDEAL = {"noise": 0.0, "attitude_noise": 0.0, "misalignment": 0.0, "step": 1e-6}
PROMPT = {"delay": 0.0, "jitter": 0.0, "dropout": 0.0}
UNICAST = Address(1511)
UPTIME = 5000.0  # of the computer when the vehicle boots: its clock is not the vehicle's [s]
FLYING = 5  # control periods in a step of the hall
LOOKS = 5  # of everybody at the link in a step


def sensors(*, ideal=False, **changed):
    """The shipped instruments, with values of motion capture changed."""
    shipped = load_sensors()
    values = (IDEAL | PROMPT if ideal else {}) | changed
    spec = shipped.motion_capture
    timing = spec.timing._replace(**{k: v for k, v in values.items() if k in spec.timing._fields})
    own = {k: v for k, v in values.items() if k in spec._fields}
    return shipped._replace(motion_capture=spec._replace(timing=timing, **own))


def cameras(axes=ENAC, seed=1, events=(), **changed):
    """Cameras with values of their specification changed."""
    disturbances = Disturbances(tuple(map(read_disturbance, events)))
    return Cameras(sensors(**changed), load_rigid_body(), axes, seed, disturbances)


def motion(time, position=(0.0, 0.0, 1.0), attitude=None, velocity=(0.0, 0.0, 0.0), rates=(0.0, 0.0, 0.0)):
    """A true state; upright on the tail, its belly north, unless it is told otherwise."""
    upright = Rotation.from_euler("y", -90, degrees=True)
    return TrueMotion(time, np.array(position), np.array(velocity), attitude or upright, np.array(rates))


def frames_of(made, seconds, at=motion):
    """All frames of a motion that is a function of time."""
    frames = []
    for k in range(round(100 * seconds) + 1):
        made.look(at(k / 100.0))
        frames += made.frames(k / 100.0)
    return frames


def bridge_axes(axes):
    """The bridge's settings for a hall."""
    return AxesSettings(axes.up_axis, axes.long_edge, axes.east, axes.front)


class Mailbox:
    """A peer of the vehicle that keeps what it hears."""

    def __init__(self):
        self.letters = []

    def hear(self, data):
        self.letters.append(data)

    def empty(self):
        letters, self.letters = self.letters, []
        return letters


class Hall:
    """A vehicle of a bench, seen by cameras, and the bridge that sends it its poses.

    Args:
        station: Of the vehicle.
        axes: Of the hall.
        version: Bit-stream.
        group: Multicast group; empty: unicast.
        settings: Of the bridge, but for the axes.
        key: That the hall and the bridge sign with.
        clock: Of the stamps.
        options: Of ``cameras``.
    """

    def __init__(
        self, station, *, axes=ENAC, version=(3, 1), group="", settings=None, key=None, clock="auto", **options
    ):
        self.station, self.bench = station, station.bench
        self.bench.now += UPTIME
        self.cameras = cameras(axes, **options)
        rate = self.cameras._spec.timing.rate
        self.server = NatnetServer(self.cameras.body, version, rate, Address(1511, group))
        keyring = Keyring(
            {} if key is None else {None: key}, timestamp=T + round(UPTIME * TICKS_PER_SECOND), now=self.bench.now
        )
        self.watch = VehicleWatch(keyring)
        self.natnet, self.autopilot = NatnetLink(), AutopilotLink(1, keyring, clock)
        self.bridge = PoseBridge(
            (settings or BridgeSettings())._replace(axes=bridge_axes(axes)), self.natnet, self.autopilot
        )
        self.poses = []
        self._seen = self.bench.stations["hall"] = Mailbox()
        self._mail = self.bench.stations["bridge"] = Mailbox()

    def fly(self, seconds, each=lambda: None):
        """Fly for a time, looking and sending."""
        for _ in range(round(500 * seconds / FLYING)):
            before = len(self.station.heard)
            self.bench.node.advance(FLYING)
            for _ in range(LOOKS):
                self.bench.now += 0.002 * FLYING / LOOKS
                self.bench.deliver()
                self._look(self.bench.now)
            self.station.heard[before:] = [m for m in self.station.heard[before:] if m.get_type() != "DARKO_TRUTH"]
            each()

    def _look(self, now):
        for data in self._seen.empty():
            for each in self.watch.receive(data, now):
                self.cameras.look(each)
        for data in self.watch.requests(now):
            self.bench.node.receive(data, "hall", now)
        for request in self.natnet.requests(now):
            for answer in self.server.receive(request, "client", now):
                self.bridge.from_server(answer, now)
        for frame in self.cameras.frames(self.watch.time(now)):
            for _, data in self.server.send(frame, now):
                self._to_vehicle(self.bridge.from_server(data, now), now)
        for data in self._mail.empty():
            self.bridge.from_vehicle(data, now)
        self._to_vehicle(self.autopilot.outgoing(now), now)
        self.bridge.handle_timer(now)

    def _to_vehicle(self, datagrams, now):
        for data in datagrams:
            self.poses.append(data)
            self.bench.node.receive(data, "bridge", now)
