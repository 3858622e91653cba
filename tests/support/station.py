"""A ground station as plain as can be, and the vehicle it talks to: byte for byte, without a socket."""

import math

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.modes import mode_from_custom
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import Simulation, Start, Tuning
from sitl.wire.node import Node

HOME = Geodetic(43.5648, 1.4811, 150.0)
FRAME = LocalFrame(HOME)
STEP = 0.02  # [s] between looks at the link
NAN = math.nan


class Sky:
    """A vehicle that hovers where it is told to, or stands on the ground, and its link."""

    def __init__(self, folder, *, up=0.0, settings=None, surroundings=None, seed=1, origin=HOME):
        vehicle = Simulation(load("nominal").parameters, seed=seed, start=Start(up=up, airborne=up > 0.0))
        bindings = Bindings(settings or Settings(), Tuning(), surroundings or Surroundings())
        self.craft = Craft(vehicle, World(LocalFrame(origin), ARENAS["open"]), bindings, airborne=up > 0.0)
        self.node = Node(self.craft, Memory(folder), ["main"])
        self.now = 0.0
        self.stations = {}
        self.advance(0.1)

    @property
    def autopilot(self):
        return self.craft.autopilot

    def station(self, system=255, key="main"):
        """Another ground station."""
        self.stations[key] = station = Station(self, system, key)
        return station

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
                self.stations[key].heard += self.stations[key].codec.decode(data)


class Station:
    """What it sends, and everything it hears."""

    def __init__(self, sky, system, key):
        self.sky, self.key, self.system = sky, key, system
        self.codec, self.heard = Codec(system, 190), []

    def send(self, *messages):
        for message in messages:
            self.sky.node.receive(self.codec.encode(message), self.key, self.sky.now)
            self.sky.deliver()

    def beat(self):
        self.send(mavlink.MAVLink_heartbeat_message(mavlink.MAV_TYPE_GCS, 8, 0, 0, 4, 3))

    def command(self, command, *params):
        """The result of a command."""
        seven = (*params, *(NAN,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *seven))
        acks = (m for m in reversed(self.heard) if m.get_type() == "COMMAND_ACK" and m.command == command)
        return next(acks).result

    def mode(self, mode):
        """The result of asking for a mode."""
        return self.command(mavlink.MAV_CMD_DO_SET_MODE, 1, *mode.value)

    def upload(self, items, kind=0):
        """The result of an upload."""
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), kind))
        for seq, item in enumerate(items):
            self.send(item.to_message(seq, 1, 1, kind=kind))
        return self.last("MISSION_ACK").type

    def last(self, kind):
        return next((m for m in reversed(self.heard) if m.get_type() == kind), None)

    def texts(self):
        """All STATUSTEXTs, joined where they were split."""
        return "".join(m.text for m in self.heard if m.get_type() == "STATUSTEXT")

    @property
    def flight_mode(self):
        """As HEARTBEAT tells it."""
        return mode_from_custom(self.last("HEARTBEAT").custom_mode)
