"""A hostile link against a flying vehicle: the flight beside the same flight without it, bit for bit."""

from collections import Counter

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.plans import load
from sitl.airframe import load as load_airframe
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings
from sitl.craft import Craft
from sitl.memory import Memory
from sitl.node import Node
from sitl.parameters import Bindings, Surroundings
from sitl.vehicle import Start, Tuning, Vehicle
from tests.support.flood import Flood
from tests.support.paths import DATA

STEP = 0.02  # [s]
SECONDS, PER_STEP = 16.0, 10
GROUND = "ground"


def hovering(folder) -> Node:
    vehicle = Vehicle(load_airframe("nominal").parameters, seed=4, start=Start(up=3.0, airborne=True))
    bindings = Bindings(Settings(), Tuning(), Surroundings(gusts=0.5))
    world = World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"])
    memory = Memory(folder)
    memory.keep_mission(load(DATA / "square.plan").items)
    memory.keep_parameters({"SIM_WIND_SPD": 1.0})
    return Node(Craft(vehicle, world, bindings, airborne=True), memory, [GROUND])


class Flight:
    """A vehicle in the air, its ground station, and whoever else sends to it."""

    def __init__(self, folder):
        self.folder, self.node = folder, hovering(folder)
        self.ground, self.now = Codec(255, 190), 0.0
        self.heard, self.texts = Counter(), []

    def step(self, hostile=()):
        for key, data in hostile:
            self.node.receive(data, key, self.now)
        if round(self.now / STEP) % 50 == 0:
            alive = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
            self.node.receive(self.ground.encode(alive), GROUND, self.now)
        self.node.advance(10)
        self.now += STEP
        for key, data in self.node.datagrams(self.now):
            if key == GROUND:
                self.hear(self.ground.decode(data))

    def hear(self, messages):
        for message in messages:
            self.heard[message.get_type()] += 1
            if message.get_type() == "STATUSTEXT":
                self.texts.append(message.text)

    def state(self):
        autopilot, endpoint = self.node.craft.autopilot, self.node._endpoint
        return {
            "plant": self.node.craft.vehicle.plant.tobytes(),
            "mode": (autopilot.mode, autopilot.armed, autopilot.flying),
            "mission": repr((endpoint.mission, autopilot.mission.items, autopilot.mission.current)),
            "parameters": endpoint.parameters,
            "intervals": dict(endpoint._streams._intervals),
            "kept": {path.name: path.read_bytes() for path in sorted(self.folder.iterdir())},
        }


def strangers(flood, step):
    """Datagrams of one step: each from a port never seen before, and some in the name of the ground station."""
    return [(GROUND if n % 5 == 0 else f"port {step}.{n}", flood.datagram()) for n in range(PER_STEP)]


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """The same flight twice, the second one under the flood."""
    quiet, flooded = Flight(tmp_path_factory.mktemp("quiet")), Flight(tmp_path_factory.mktemp("flooded"))
    flood = Flood(7)
    for step in range(round(SECONDS / STEP)):
        quiet.step()
        flooded.step(strangers(flood, step))
    return quiet, flooded, flood


def test_a_flood_changes_no_state(flights):
    quiet, flooded, flood = flights
    assert min(flood.counts.values()) > 5
    assert sum(flood.counts.values()) > SECONDS / STEP * PER_STEP
    assert flooded.state() == quiet.state()


def test_telemetry_reaches_the_ground_station_as_often_as_without_the_flood(flights):
    quiet, flooded, _ = flights
    quiet_counts = {kind: n for kind, n in quiet.heard.items() if n >= 10}
    assert len(quiet_counts) > 12
    for kind, count in quiet_counts.items():
        assert flooded.heard[kind] >= 0.9 * count, kind
    assert flooded.ground.statistics.sources[1, 1].lost == 0


def test_the_operator_is_not_flooded(flights):
    quiet, flooded, _ = flights
    assert len(flooded.texts) <= len(quiet.texts) + 3


def tables(node):
    """Sizes of everything that grows with what arrives."""
    endpoint = node._endpoint
    yield from ((f"codec {key}", len(c._sequences)) for key, c in endpoint._links.codecs.items())
    yield "peers", len(endpoint._links.codecs)
    for server in endpoint._servers:
        name = type(server).__name__
        yield from ((f"{name}.{k}", len(v)) for k, v in vars(server).items() if isinstance(v, dict | list))
    yield "complaints", len(node._complained)


def test_no_table_grows_with_the_flood(flights):
    _, flooded, _ = flights
    assert {name: size for name, size in tables(flooded.node) if size > 256} == {}
