"""Flight plan files sent to a vehicle over bad links: they arrive whole, and are judged once."""

import random
import zlib

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.flight_plan_client import FlightPlanUpload
from protocol.engines.server.flight_plan_server import FlightPlanFileServer
from protocol.engines.table_values import PIECE_BYTES
from protocol.errors import LocalProtocolError
from protocol.events import FlightPlanAnswered, FlightPlanUploaded
from protocol.ranges import MAX_PLAN_FILE
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.lossy_pipe import LossyPipe

GROUND, OTHER, VEHICLE = Peer(255, 190, "ground"), Peer(254, 190, "other"), (1, 1)
PLAN = random.Random(1).randbytes(7_000)
ACCEPTED, REJECTED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def converse(data, *, seed=0, answer=(ACCEPTED, b""), limit=120.0, **losses):
    """Send a file; the events of the client, and the files that the vehicle had to judge."""
    server, client = FlightPlanFileServer(1, 1), FlightPlanUpload(255, 190)
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    vehicle, ground = Codec(1, 1), Codec(255, 190)
    now, judged, events = 0.0, [], []
    client.send(VEHICLE, data, now)
    while client.is_busy and now < limit:
        for message in client.messages_to_send():
            up.send(ground.encode(message), now)
        now = max(now, min(client.next_deadline(), up.next_arrival(), down.next_arrival()))
        for message in (m for frame in up.receive(now) for m in vehicle.decode(frame)):
            server.receive(message, now, GROUND)
            for event in server.events():
                judged.append(event)
                server.answer(event.peer, *answer)
        for outgoing in server.messages_to_send():
            down.send(vehicle.encode(outgoing.message), now)
        for message in (m for frame in down.receive(now) for m in ground.decode(frame)):
            client.receive(message, now)
        client.handle_timer(now)
        events += client.events()
    return events, judged


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("size", [1, PIECE_BYTES, PIECE_BYTES + 1, len(PLAN)])
def test_a_file_arrives_whole_and_is_judged_once(seed, size):
    events, judged = converse(PLAN[:size], seed=seed, drop=0.3, duplicate=0.1, reorder=0.3, delay=0.05)
    assert events == [FlightPlanAnswered("")]
    assert judged == [FlightPlanUploaded(PLAN[:size], GROUND)]


@pytest.mark.parametrize("seed", range(3))
def test_a_refusal_says_why(seed):
    events, _ = converse(PLAN, seed=seed, answer=(REJECTED, b"plan:3:7: no"), drop=0.3, delay=0.05)
    assert events == [FlightPlanAnswered("plan:3:7: no")]


def test_a_silent_vehicle_is_given_up():
    events, judged = converse(PLAN, drop=1.0)
    assert (events, judged) == ([FlightPlanAnswered("no answer")], [])


def test_several_pieces_are_under_way_at_a_time():
    client = FlightPlanUpload(255, 190)
    client.send(VEHICLE, PLAN, 0.0)
    assert len(client.messages_to_send()) == 10
    with pytest.raises(LocalProtocolError, match="already"):
        client.send(VEHICLE, PLAN, 0.0)


@pytest.mark.parametrize("size", [0, MAX_PLAN_FILE + 1])
def test_files_without_content_or_too_large_are_not_sent(size):
    with pytest.raises(LocalProtocolError, match="bytes"):
        FlightPlanUpload(255, 190).send(VEHICLE, b"x" * size, 0.0)


def piece(size=100, offset=0, count=None, crc=1, to=VEHICLE):
    count = min(size - offset, PIECE_BYTES) if count is None else count
    return mavlink.MAVLink_darko_plan_file_message(size, crc, offset, *to, count, [0] * PIECE_BYTES)


@pytest.mark.parametrize(
    "message",
    [
        piece(size=0, count=0),
        piece(size=MAX_PLAN_FILE + 1, count=PIECE_BYTES),
        piece(size=0xFFFFFFFF, count=PIECE_BYTES),
        piece(offset=100, count=0),
        piece(offset=180, count=20),
        piece(size=1000, offset=10, count=PIECE_BYTES),
        piece(count=99),
        piece(size=1000, count=255),
        piece(to=(9, 1)),
    ],
)
def test_what_is_no_piece_is_ignored(message):
    server = FlightPlanFileServer(1, 1)
    server.receive(message, 0.0, GROUND)
    assert (server.messages_to_send(), server.events()) == ([], [])


def test_a_file_with_another_checksum_is_damaged():
    server = FlightPlanFileServer(1, 1)
    server.receive(piece(), 0.0, GROUND)
    (answer,) = server.messages_to_send()
    assert (answer.message.result, server.events()) == (mavlink.MAV_RESULT_FAILED, [])


def test_one_station_at_a_time_loads():
    server = FlightPlanFileServer(1, 1)
    server.receive(piece(size=1000), 0.0, GROUND)
    server.receive(piece(size=500), 1.0, OTHER)
    results = [outgoing.message.result for outgoing in server.messages_to_send()]
    assert results == [mavlink.MAV_RESULT_IN_PROGRESS, REJECTED]
    server.receive(piece(size=500), 15.0, OTHER)
    assert server.messages_to_send()[0].message.result == mavlink.MAV_RESULT_IN_PROGRESS


def test_a_sender_may_begin_another_file():
    server = FlightPlanFileServer(1, 1)
    server.receive(piece(size=1000), 0.0, GROUND)
    data = bytes(100)
    server.receive(piece(crc=zlib.crc32(data)), 1.0, GROUND)
    assert server.events() == [FlightPlanUploaded(data, GROUND)]


def test_a_file_that_is_sent_once_more_is_judged_once_more():
    server, data = FlightPlanFileServer(1, 1), bytes(100)
    for now, judged in ((0.0, 1), (0.5, 0), (10.0, 1)):  # a repetition, and a second request of the operator
        server.receive(piece(crc=zlib.crc32(data)), now, GROUND)
        events = server.events()
        assert len(events) == judged
        for event in events:
            server.answer(event.peer, ACCEPTED)


@pytest.mark.parametrize(("age", "result"), [(2.0, ACCEPTED), (2.01, mavlink.MAV_RESULT_IN_PROGRESS)])
def test_a_piece_that_comes_two_seconds_after_the_answer_belongs_to_the_file_that_was_judged(age, result):
    server, data = FlightPlanFileServer(1, 1), bytes(200)
    crc = zlib.crc32(data)
    for offset in (0, 180):
        server.receive(piece(size=200, offset=offset, crc=crc), 5.0, GROUND)
    server.answer(GROUND, ACCEPTED)
    server.messages_to_send()
    server.receive(piece(size=200, crc=crc), 5.0 + age, GROUND)
    assert [outgoing.message.result for outgoing in server.messages_to_send()] == [result]


@pytest.mark.parametrize(("age", "result"), [(9.99, REJECTED), (10.0, mavlink.MAV_RESULT_IN_PROGRESS)])
def test_a_station_that_is_silent_for_ten_seconds_makes_way_for_another(age, result):
    server = FlightPlanFileServer(1, 1)
    server.receive(piece(size=1000), 5.0, GROUND)
    server.messages_to_send()
    server.receive(piece(size=500), 5.0 + age, OTHER)
    assert [outgoing.message.result for outgoing in server.messages_to_send()] == [result]
