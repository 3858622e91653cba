"""The vehicle on the wire and a ground station as plain as can be: byte for byte, without a socket."""

import math

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from sitl.airframe import load
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.parameters import Bindings, Surroundings
from sitl.simulation.simulation import Simulation, Start, Tuning
from sitl.wire.node import Node

PEER = "ground"
HOME = Geodetic(43.5648, 1.4811, 150.0)
NAN = math.nan


class Ground:
    """A ground station as plain as can be: what it sends, and everything it hears."""

    def __init__(self, folder, *, airborne=False, seed=1, gusts=0.0):
        start = Start(up=3.0, airborne=True) if airborne else Start()
        vehicle = Simulation(load("nominal").parameters, seed=seed, start=start)
        bindings = Bindings(Settings(), Tuning(), Surroundings(gusts=gusts))
        world = World(LocalFrame(HOME), ARENAS["open"])
        self.node = Node(Craft(vehicle, world, bindings, airborne=airborne), Memory(folder), [PEER])
        self.codec, self.heard, self.now = Codec(255, 190), [], 0.0
        self.advance(0.1)

    @property
    def vehicle(self):
        return self.node.craft.vehicle

    def send(self, message):
        self.node.receive(self.codec.encode(message), PEER, self.now)
        self.collect()

    def advance(self, seconds):
        for _ in range(round(seconds / 0.02)):
            self.node.advance(10)
            self.now += 0.02
            self.collect()

    def collect(self):
        for _, data in self.node.datagrams(self.now):
            self.heard += self.codec.decode(data)

    def last(self, kind):
        return next((m for m in reversed(self.heard) if m.get_type() == kind), None)

    def texts(self):
        return "".join(m.text for m in self.heard if m.get_type() == "STATUSTEXT")

    def command(self, command, *params):
        seven = (*params, *(NAN,) * (7 - len(params)))
        self.send(mavlink.MAVLink_command_long_message(1, 1, command, 0, *seven))
        return self.last("COMMAND_ACK").result

    def upload(self, items):
        self.send(mavlink.MAVLink_mission_count_message(1, 1, len(items), 0))
        for seq, item in enumerate(items):
            self.send(item.to_message(seq, 1, 1))
        return self.last("MISSION_ACK").type
