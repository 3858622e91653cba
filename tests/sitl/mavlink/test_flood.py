"""A hostile link against a flying vehicle: the flight equals the one without it, bit for bit."""

import random
from collections import Counter

import pytest

from protocol.dialect import mavlink
from protocol.wire.codec import Codec
from sitl.mavlink import commands
from sitl.mavlink.broadcast import TEXTS_PER_SECOND
from sitl.model.plant import is_finite
from tests.support.links.flood import STATION, Flood, framed, orders, random_payload
from tests.support.vehicle.fake_station import PEER, STEP
from tests.support.vehicle.hovering_node import hovering

SECONDS, PER_STEP = 8.0, 20


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
            self.node.receive(self.ground.encode(alive), PEER, self.now)
        self.node.advance(10)
        self.now += STEP
        for key, data in self.node.datagrams(self.now):
            if key == PEER:
                self.hear(self.ground.decode(data))

    def hear(self, messages):
        for message in messages:
            self.heard[message.get_type()] += 1
            if message.get_type() == "STATUSTEXT" and message.chunk_seq == 0:
                self.texts.append(message.text)

    def state(self):
        autopilot, endpoint = self.node.aircraft.autopilot, self.node.endpoint
        return {
            "flight": self.node.aircraft.vehicle.flight,
            "mode": (autopilot.mode, autopilot.armed, autopilot.flying),
            "mission": repr((endpoint.mission, autopilot.mission.items, autopilot.mission.current)),
            "parameters": endpoint.parameters,
            "intervals": endpoint._streams.intervals,
            "kept": {path.name: path.read_bytes() for path in sorted(self.folder.iterdir())},
        }


def strangers(flood, step):
    """Datagrams of one step: each from a port never seen before, and some in the name of the ground station."""
    return [(PEER if n % 5 == 0 else f"port {step}.{n}", flood.datagram()) for n in range(PER_STEP)]


@pytest.fixture(scope="module")
def flights(tmp_path_factory):
    """The same flight twice, the second one under the flood."""
    quiet, flooded = Flight(tmp_path_factory.mktemp("quiet")), Flight(tmp_path_factory.mktemp("flooded"))
    flood = Flood(7)
    for step in range(round(SECONDS / STEP)):
        quiet.step()
        flooded.step(strangers(flood, step))
    return quiet, flooded, flood


@pytest.mark.long
def test_a_flood_changes_no_state(flights):
    quiet, flooded, flood = flights
    assert min(flood.counts.values()) > 5
    assert sum(flood.counts.values()) > SECONDS / STEP * PER_STEP
    assert flooded.state() == quiet.state()


@pytest.mark.long
def test_telemetry_reaches_the_ground_station_as_often_as_without_the_flood(flights):
    quiet, flooded, _ = flights
    quiet_counts = {kind: n for kind, n in quiet.heard.items() if n >= 10}
    assert len(quiet_counts) > 10
    for kind, count in quiet_counts.items():
        assert flooded.heard[kind] >= 0.9 * count, kind
    assert flooded.ground.statistics.sources[1, 1].lost == 0


@pytest.mark.long
def test_the_operator_is_not_flooded(flights):
    quiet, flooded, _ = flights
    assert len(flooded.texts) <= len(quiet.texts) + 3


def tables(node):
    """Sizes of everything that grows with what arrives."""
    endpoint = node.endpoint
    yield from ((f"codec {key}", len(c._sequences)) for key, c in endpoint._links.codecs.items())
    yield "peers", len(endpoint._links.codecs)
    for server in endpoint._servers:
        name = type(server).__name__
        yield from ((f"{name}.{k}", len(v)) for k, v in vars(server).items() if isinstance(v, dict | list))
    yield "texts", node._broadcast.remembered_texts


def test_no_table_grows_with_the_flood(flights):
    _, flooded, _ = flights
    assert {name: size for name, size in tables(flooded.node) if size > 256} == {}


@pytest.fixture
def vehicle(tmp_path):
    return Flight(tmp_path)


def refused_orders(number):
    """Well-formed orders to this vehicle, no two alike, each of which it refuses in words."""
    long, to = mavlink.MAVLink_command_long_message, (1, 1)
    yield mavlink.MAVLink_param_set_message(*to, b"DRK_V_ENTER", -2.0 - number, mavlink.MAV_PARAM_TYPE_REAL32)
    yield long(*to, mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 0, 2 + number, 0, 0, 0, 0, 0, 0)
    yield long(*to, mavlink.MAV_CMD_DO_CHANGE_SPEED, 0, 1, 100 + number, 0, 0, 0, 0, 0)
    yield long(*to, mavlink.MAV_CMD_MISSION_START, 0, 100 + number, 0, 0, 0, 0, 0, 0)


def test_a_thousand_refused_commands_are_all_answered_but_not_all_explained(vehicle):
    before = vehicle.node.aircraft.autopilot.mode
    for number in range(250):
        frames = [vehicle.ground.encode(order) for order in refused_orders(number)]
        vehicle.step([(PEER, frame) for frame in frames])
    assert vehicle.heard["COMMAND_ACK"] == 750
    assert vehicle.heard["PARAM_ERROR"] == 250
    assert 20 <= len(vehicle.texts) <= 20 + 250 * STEP * TEXTS_PER_SECOND + 2  # a burst, and then one a second
    for _ in range(round(12 / STEP)):
        vehicle.step()
    assert sum("further answers were not sent" in text for text in vehicle.texts) == 1
    assert vehicle.node.aircraft.autopilot.mode == before


def test_two_alternating_complaints_are_each_sent_now_and_then(vehicle):
    def setpoint(frame, x):
        return mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, frame, 0b1101_1111_1000, x, 0, -3, 0, 0, 0, 0, 0, 0, 0, 0
        )

    for _ in range(100):
        bad = [setpoint(mavlink.MAV_FRAME_BODY_NED, 1.0), setpoint(mavlink.MAV_FRAME_LOCAL_NED, 1e6)]
        vehicle.step([(PEER, vehicle.ground.encode(message)) for message in bad])
    assert len(vehicle.texts) == 2


def test_strangers_who_send_once_displace_no_ground_station(vehicle):
    alive = mavlink.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3)
    other = Codec(254, 190)
    for step in range(100):
        late = [("late", other.encode(alive))] if step % 10 == 0 else []
        vehicle.step([*late, *((f"{step}.{n}", Codec(9, n).encode(alive)) for n in range(1, 10 if step > 20 else 2))])
    peers = vehicle.node.endpoint.statistics
    assert {PEER, "late"} < set(peers)
    assert len(peers) <= 1 + 16


def test_frames_from_many_system_ids_fill_no_table(vehicle):
    """Without signing anybody can send in any name: that is answered, but not remembered."""
    for number in range(3000):
        codec = Codec(1 + number % 250, number // 250)
        order = mavlink.MAVLink_command_long_message(1, 1, mavlink.MAV_CMD_DO_SET_MODE, 0, 1, 99, number, 0, 0, 0, 0)
        vehicle.node.receive(codec.encode(order), PEER, vehicle.now)
        clear = mavlink.MAVLink_mission_count_message(1, 1, 2000, 0)
        vehicle.node.receive(codec.encode(clear), PEER, vehicle.now)
        vehicle.now += 0.001
        vehicle.node.datagrams(vehicle.now)
    assert {name: size for name, size in tables(vehicle.node) if size > 256} == {}
    assert vehicle.node.aircraft.autopilot.mission is not None


@pytest.mark.long
def test_well_formed_nonsense_of_every_kind_breaks_no_flight(vehicle):
    """Messages of the whole dialect with payloads of any bits, refused or obeyed."""
    draw = random.Random(12)
    for _ in range(1500):
        known = mavlink.mavlink_map[draw.choice(sorted(mavlink.mavlink_map))]
        if draw.random() < 0.7:
            known = mavlink.mavlink_map[draw.choice(ORDERED)]
        vehicle.step([(PEER, any_frame(draw, known))] if draw.random() < 0.5 else [])
    assert is_finite(vehicle.node.aircraft.vehicle.truth)
    assert vehicle.heard["COMMAND_ACK"] > 50


ORDERED = sorted({order.id for order in orders(1, 1)} | {84, 86, 82})  # 84, 86, 82: the set-points


def any_frame(draw, known):
    """A frame for this vehicle whose checksum is right, and whose numbers may be anything."""
    payload = random_payload(draw, known)
    values = list(known.unpacker.unpack(payload))
    fields = dict(zip(known.ordered_fieldnames, range(len(values)), strict=False))
    if len(values) == len(known.ordered_fieldnames):
        for name in ("target_system", "target_component", "target"):
            if name in fields:
                values[fields[name]] = 1
        if "command" in fields and draw.random() < 0.9:
            values[fields["command"]] = draw.choice(sorted(commands.HANDLERS))
        payload = bytearray(known.unpacker.pack(*values))
    return framed(known, payload, draw.randrange(256), STATION)
