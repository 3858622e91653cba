"""A recorded flight through codec and endpoints gives the events of that flight."""

import pytest

from protocol.dialect import mavlink
from protocol.endpoints.endpoint_ground import GroundEndpoint
from protocol.endpoints.endpoint_vehicle import VehicleEndpoint
from protocol.engines.server.mission_server import plan_id
from protocol.events import CommandRequested, MissionReceived, VehicleFound
from protocol.plans import load
from protocol.tlog import read_tlog
from protocol.wire.codec import Codec
from tests.support.paths import DATA

GROUND, VEHICLE = (255, 190), (1, 1)


@pytest.fixture(scope="module")
def flight():
    """(time [s], frame, source) of every record, and the log."""
    reader = read_tlog(DATA / "square-flight.tlog")
    sources = list(zip(reader.systems.tolist(), reader.components.tolist(), strict=True))
    return reader, [
        (time / 1e6, frame, source) for (time, frame), source in zip(reader.records(), sources, strict=True)
    ]


def test_every_frame_decodes_and_encodes_to_the_same_bytes(flight):
    """Except for sequence numbers, the codec writes the recorded bytes."""
    _, records = flight
    decoder = Codec(*GROUND)
    for _, frame, source in records:
        (message,) = decoder.decode(frame)
        again = bytearray(Codec(*source).encode(message))
        header = len(frame) - 2
        assert again[5:header] == frame[5:header]
    assert decoder.statistics.bad_crc == decoder.statistics.garbage_bytes == 0
    assert all(counted.lost == 0 for counted in decoder.statistics.sources.values())


def test_the_ground_endpoint_finds_the_vehicle_and_loses_it_after_the_end(flight):
    _, records = flight
    ground, events = GroundEndpoint(), []
    for time, frame, source in records:
        if source == VEHICLE:
            ground.receive_datagram(frame, time)
            ground.handle_timer(time)
            events += ground.events()
    assert [type(event) for event in events] == [VehicleFound]
    end = records[-1][0]
    ground.handle_timer(end + 3.5)
    assert not ground.is_present


def test_the_vehicle_endpoint_understands_the_recorded_ground_station(flight):
    _, records = flight
    vehicle = VehicleEndpoint(
        commands={mavlink.MAV_CMD_COMPONENT_ARM_DISARM, mavlink.MAV_CMD_MISSION_START},
        validate=lambda _items: None,
        peers=["ground"],
    )
    events = []
    for time, frame, source in records:
        if source == GROUND:
            vehicle.receive_datagram(frame, "ground", time)
            for event in vehicle.events():
                events.append(event)
                if isinstance(event, CommandRequested):
                    vehicle.acknowledge(event.request, mavlink.MAV_RESULT_ACCEPTED, time)
    assert vehicle.mission == load(DATA / "square.plan").items
    assert [type(event) for event in events] == [MissionReceived, CommandRequested, CommandRequested]
    assert [event.command for event in events[1:]] == [400, 300]


def test_recorded_requests_get_the_recorded_answers(flight):
    """The mission engine answers the recorded upload as in the log, except for the plan id."""
    reader, records = flight
    vehicle = VehicleEndpoint(validate=lambda _items: None, peers=["ground"])
    decoder, answers = Codec(*GROUND), []
    for time, frame, source in records:
        if source == GROUND:
            vehicle.receive_datagram(frame, "ground", time)
            answers += [decoder.decode(data)[0] for _, data in vehicle.datagrams_to_send()]
    kinds = ("MISSION_REQUEST_INT", "MISSION_ACK")
    then = [reader.decode(row) for kind in kinds for row in reader.rows(kind, VEHICLE)]
    now = [message for kind in kinds for message in answers if message.get_type() == kind]
    assert now[-1].opaque_id == plan_id(vehicle.mission)
    now[-1].opaque_id = 0
    assert [message.to_dict() for message in now] == [message.to_dict() for message in then]
