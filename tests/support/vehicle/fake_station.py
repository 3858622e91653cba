"""A real vehicle on a bench, and plain ground stations: byte for byte, on a virtual clock, without a socket."""

import math

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import mode_from_custom
from protocol.wire.codec import Codec
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.mavlink.node import Node
from sitl.model.airframe_files import load
from sitl.simulation.avionics import Navigation
from sitl.simulation.simulation import Simulation
from sitl.simulation.start import Start
from sitl.simulation.tuning import Tuning
from sitl.tools.persistence import StateFolder
from sitl.vehicle.aircraft import Aircraft
from sitl.vehicle.parameters import Configuration, WorldSettings

FRAME = LocalFrame(HOME)
PEER = "ground"  # where a vehicle's only peer is, unless a test names others
STEP = 0.02  # between looks at the link [s]
NAN = math.nan


def make_aircraft(
    *, up=0.0, heading=0.0, settings=None, world_settings=None, seed=1, origin=HOME, navigation=Navigation.TRUTH,
    aligned=True, arena="open",
):  # fmt: skip
    """The nominal aircraft, hovering ``up`` metres above the origin, or on the ground at 0."""
    start = Start(up=up, heading=heading, airborne=up > 0.0)
    vehicle = Simulation(load("nominal").parameters, seed=seed, start=start, navigation=navigation, aligned=aligned)
    configuration = Configuration(settings or Settings(), Tuning(), world_settings or WorldSettings())
    return Aircraft(vehicle, World(LocalFrame(origin), ARENAS[arena]), configuration, airborne=up > 0.0)


class Bench:
    """A vehicle that hovers, or stands on the ground, and its link.

    Args:
        folder: Its state folder.
        aircraft: Another aircraft than ``make_aircraft`` makes of the other options.
        peers: Who hears the vehicle from the start.
        node_options: Of ``Node``.
        settle: How long it flies before any station is there [s].
        options: Of ``make_aircraft``.
    """

    def __init__(self, folder, *, aircraft=None, peers=(PEER,), node_options=None, settle=0.1, **options):
        self.aircraft = aircraft or make_aircraft(**options)
        self.node = Node(self.aircraft, StateFolder(folder), peers, **(node_options or {}))
        self.now = 0.0
        self.stations = {}
        if settle:
            self.advance(settle)

    @property
    def autopilot(self):
        return self.aircraft.autopilot

    def station(self, system=255, key=PEER):
        """Another ground station."""
        return FakeStation(self, system, key)

    def advance(self, seconds):
        for _ in range(round(seconds / STEP)):
            self.node.advance(10)
            self.now += STEP
            self.deliver()

    def advance_until(self, condition, limit):
        end = self.now + limit
        while not condition():
            assert self.now < end, f"not within {limit} s"
            self.advance(0.1)

    def deliver(self):
        for key, data in self.node.datagrams(self.now):
            if key in self.stations:
                self.stations[key].hear(data)


class FakeStation:
    """Ground station that sends messages to the vehicle and keeps everything it hears."""

    def __init__(self, bench, system=255, key=PEER):
        self.bench, self.peer, self.system = bench, key, system
        self._codec, self._heard, self._unread = Codec(system, 190), [], []
        bench.stations[key] = self

    @classmethod
    def with_vehicle(cls, folder, **options):
        """The only station of a vehicle, there from the start; options are those of ``Bench``."""
        station = cls(Bench(folder, settle=0.0, **options))
        station.advance(0.1)
        return station

    @property
    def codec(self):
        """Its end of the link, which has read all that came."""
        for data in self._unread:
            self._heard += self._codec.decode(data)
        self._unread.clear()
        return self._codec

    @codec.setter
    def codec(self, codec):
        self._codec = codec

    @property
    def heard(self):
        """Every message that came, oldest first; they are decoded only where a test looks."""
        assert self.codec
        return self._heard

    @property
    def node(self):
        return self.bench.node

    @property
    def vehicle(self):
        return self.bench.aircraft.vehicle

    @property
    def autopilot(self):
        return self.bench.autopilot

    def advance(self, seconds):
        self.bench.advance(seconds)

    def wait(self, seconds):
        """Let the link's time pass, in one step and without flying."""
        self.bench.now += seconds
        self.bench.deliver()

    def hear(self, data):
        self._unread.append(data)

    def send(self, *messages):
        for message in messages:
            self.send_datagram(self._codec.encode(message))

    def send_datagram(self, data):
        self.bench.node.receive(data, self.peer, self.bench.now)
        self.bench.deliver()

    def beat(self):
        self.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3))

    def command(self, command, *params):
        """The result of a command."""
        seven = (*params, *(NAN,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *seven))
        acks = (m for m in reversed(self.heard) if m.get_type() == "COMMAND_ACK" and m.command == command)
        return next(acks).result

    def ask_for(self, *names):
        """Get the messages that only those get who ask for one of their family."""
        for name in names:
            number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
            assert self.command(mavlink.MAV_CMD_REQUEST_MESSAGE, number) == mavlink.MAV_RESULT_ACCEPTED

    def mode(self, mode):
        """The result of asking for a mode."""
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *mode.value)

    def upload(self, items, kind=0):
        """The result of an upload."""
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        for seq, item in enumerate(items):
            self.send(item.to_message(seq, 1, 1, kind=kind))
        return self.last("MISSION_ACK").type

    def set_parameter(self, name, value):
        self.send(mavlink.MAVLink_param_set_message(1, 1, name.encode(), value, mavlink.MAV_PARAM_TYPE_REAL32))

    def all(self, kind):
        """Messages of a type, in order."""
        return [m for m in self.heard if m.get_type() == kind]

    def last(self, kind):
        """The last message of a type, or None."""
        return next((m for m in reversed(self.heard) if m.get_type() == kind), None)

    def texts(self):
        """All STATUSTEXTs, joined where they were split."""
        return "".join(m.text for m in self.all("STATUSTEXT"))

    @property
    def flight_mode(self):
        """As HEARTBEAT reports it."""
        return mode_from_custom(self.last("HEARTBEAT").custom_mode)
