"""The laws of listing and downloading logs, both sides, and both together over a bad link."""

import math
import random

import pytest

from protocol.dialect import mavlink
from protocol.endpoint import VehicleEndpoint
from protocol.engines import log_server
from protocol.engines.base import Peer
from protocol.engines.files import BytesFile, Log
from protocol.engines.log_client import RANGES, LogClient
from protocol.engines.log_server import CHUNK, LogServer
from protocol.errors import LocalProtocolError
from protocol.events import LogEraseRequested, LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog
from tests.support.link import Link, frame
from tests.support.lossy_pipe import LossyPipe

GROUND, OTHER, VEHICLE = Peer(255, 190, "ground"), Peer(245, 190, "other"), (1, 1)
LONG = random.Random(3).randbytes(30_000)
FULL = LONG[: 4 * CHUNK]


class Store:
    """Logs in memory; counts how many are open."""

    def __init__(self, *data):
        self.data = list(data)
        self.opened = 0

    def logs(self):
        return [Log(str(n), 1_700_000_000 + n, len(data)) for n, data in enumerate(self.data)]

    def open(self, name):
        if int(name) >= len(self.data):
            raise FileNotFoundError(name)
        self.opened += 1
        return Opened(self, self.data[int(name)])


class Opened(BytesFile):
    def __init__(self, store, data):
        super().__init__(data)
        self.store = store

    def close(self):
        self.store.opened -= 1


def listing(start=0, end=0xFFFF):
    return mavlink.MAVLink_log_request_list_message(1, 1, start, end)


def wanted(number, offset=0, count=0xFFFFFFFF):
    return mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count)


def ask(server, *requests, peer=GROUND):
    """Put requests, then let time pass until all is answered; the answers to that peer."""
    for request in requests:
        server.receive(request, 0.0, peer)
    return run(server, peer)


def run(server, peer=GROUND):
    out = server.messages_to_send()
    while (now := server.next_deadline()) < math.inf:
        server.handle_timer(now)
        out += server.messages_to_send()
    return [outgoing.message for outgoing in out if outgoing.peer == peer]


def joined(messages):
    data = bytearray(max(m.ofs + m.count for m in messages))
    for message in messages:
        data[message.ofs : message.ofs + message.count] = bytes(message.data[: message.count])
    return bytes(data)


# The vehicle's side


def test_a_list_names_every_log_from_0_on():
    entries = ask(LogServer(1, 1, Store(b"a", b"bc", LONG)), listing())
    assert [(e.id, e.num_logs, e.last_log_num, e.size) for e in entries] == [
        (0, 3, 2, 1),
        (1, 3, 2, 2),
        (2, 3, 2, len(LONG)),
    ]
    assert entries[1].time_utc == 1_700_000_001


def test_no_logs_is_said_with_one_entry():
    (entry,) = ask(LogServer(1, 1, Store()), listing())
    assert (entry.id, entry.num_logs) == (0, 0)


def test_a_part_of_the_list_can_be_asked_for():
    server = LogServer(1, 1, Store(b"a", b"b", b"c", b"d"))
    assert [e.id for e in ask(server, listing(1, 2))] == [1, 2]
    assert ask(server, listing(4, 9)) == []


def test_a_log_comes_whole_in_order_and_paced():
    server = LogServer(1, 1, Store(LONG))
    server.receive(wanted(0), 0.0, GROUND)
    server.handle_timer(server.next_deadline())
    first = [o.message for o in server.messages_to_send()]
    assert len(first) == log_server.MESSAGES
    messages = first + run(server)
    assert joined(messages) == LONG
    assert [m.ofs for m in messages] == list(range(0, len(LONG), CHUNK))
    assert messages[-1].count == len(LONG) % CHUNK


def test_a_log_of_whole_messages_is_ended_by_an_empty_one():
    messages = ask(LogServer(1, 1, Store(FULL)), wanted(0))
    assert [(m.ofs, m.count) for m in messages] == [(0, 90), (90, 90), (180, 90), (270, 90), (360, 0)]
    exact = ask(LogServer(1, 1, Store(FULL)), wanted(0, 0, len(FULL)))
    assert [m.count for m in exact] == [90] * 4


def test_ranges_asked_for_one_after_the_other_all_come():
    messages = ask(LogServer(1, 1, Store(LONG)), wanted(0, 900, 180), wanted(0, 0, 90), wanted(0, 900, 180))
    assert [(m.ofs, m.count) for m in messages] == [(900, 90), (990, 90), (0, 90)]


def test_what_does_not_exist_is_said_at_once():
    server = LogServer(1, 1, Store(LONG))
    assert [(m.id, m.ofs, m.count) for m in ask(server, wanted(7, 90))] == [(7, 90, 0)]
    assert [(m.ofs, m.count) for m in ask(server, wanted(0, len(LONG)))] == [(len(LONG), 0)]


def test_another_log_replaces_the_one_under_way():
    server = LogServer(1, 1, store := Store(LONG, FULL))
    ask(server, listing())
    server.receive(wanted(0), 0.0, GROUND)
    assert {m.id for m in ask(server, wanted(1))} == {1}
    assert store.opened == 1


def test_the_end_stops_the_stream_and_closes_the_log():
    server = LogServer(1, 1, store := Store(LONG))
    server.receive(wanted(0), 0.0, GROUND)
    assert ask(server, mavlink.MAVLink_log_request_end_message(1, 1)) == []
    assert store.opened == 0


def test_a_log_deleted_under_way_renumbers_nothing():
    store = Store(b"first", b"second")
    server = LogServer(1, 1, store)
    ask(server, listing())
    store.logs = lambda: [Log("1", 0, 6)]
    ask(server, listing(), peer=OTHER)
    assert joined(ask(server, wanted(1))) == b"second"
    assert joined(ask(server, wanted(0), peer=OTHER)) == b"second"


def test_a_flood_of_peers_and_ranges_stays_bounded():
    server = LogServer(1, 1, store := Store(LONG))
    for system in range(1, 100):
        for offset in range(100):
            server.receive(wanted(0, offset * CHUNK, CHUNK), 0.0, Peer(system, 1, system))
    assert store.opened == len(server._clients) == log_server.PEERS
    assert all(len(client.ranges) == log_server.RANGES for client in server._clients.values())


def test_peers_share_the_beat():
    server = LogServer(1, 1, Store(LONG))
    for peer in (GROUND, OTHER):
        server.receive(wanted(0), 0.0, peer)
    server.handle_timer(server.next_deadline())
    peers = [o.peer for o in server.messages_to_send()]
    assert peers.count(GROUND) == peers.count(OTHER) == log_server.MESSAGES / 2


def test_erasing_is_left_to_the_owner_and_other_targets_to_others():
    server = LogServer(1, 1, Store(LONG))
    server.receive(mavlink.MAVLink_log_erase_message(2, 1), 0.0, GROUND)
    assert server.events() == []
    server.receive(mavlink.MAVLink_log_erase_message(1, 1), 0.0, GROUND)
    assert server.events() == [LogEraseRequested()]


def test_a_failing_disk_ends_the_log_where_it_cannot_be_read():
    class Failing(Opened):
        def read(self, *_):
            raise OSError(5, "disk")

    store = Store(LONG)
    store.open = lambda _name: Failing(store, LONG)
    assert [(m.ofs, m.count) for m in ask(LogServer(1, 1, store), wanted(0, 90))] == [(90, 0)]


# The ground's side


def entry(number, count, size=100):
    return mavlink.MAVLink_log_entry_message(number, count, count - 1, 0, size)


def data(offset, content, number=0):
    return mavlink.MAVLink_log_data_message(number, offset, len(content), list(content.ljust(CHUNK, b"\0")))


def fetching(size):
    client = LogClient()
    client.fetch(VEHICLE, RemoteLog(0, 0, size), 0.0)
    client.messages_to_send()
    return client


def outcome(client):
    return [event for event in client.events() if not isinstance(event, LogProgress)]


def test_missing_entries_are_asked_for_again():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    for number in (0, 3):
        client.receive(entry(number, 4), 0.1)
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    (request,) = client.messages_to_send()
    assert (request.start, request.end) == (1, 2)
    for number in (1, 2):
        client.receive(entry(number, 4), 1.0)
    assert outcome(client) == [LogsListed(tuple(RemoteLog(n, 0, 100) for n in range(4)))]
    assert not client.is_busy


def test_numbers_may_begin_with_1():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    for number in (1, 2):
        client.receive(mavlink.MAVLink_log_entry_message(number, 2, 2, 0, 100), 0.1)
    assert outcome(client) == [LogsListed((RemoteLog(1, 0, 100), RemoteLog(2, 0, 100)))]


def test_a_vehicle_without_logs_lists_none():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    client.receive(mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0), 0.1)
    assert outcome(client) == [LogsListed(())]


def test_gaps_are_asked_for_as_ranges():
    client = fetching(6 * CHUNK + 10)
    for number in (0, 3):
        client.receive(data(number * CHUNK, bytes(CHUNK)), 0.1)
    client.handle_timer(client.next_deadline())
    requests = client.messages_to_send()
    assert [(r.ofs, r.count) for r in requests] == [(90, 180), (360, 190)]


def test_not_all_gaps_are_asked_for_at_once():
    client = fetching(200 * CHUNK)
    for number in range(0, 200, 2):
        client.receive(data(number * CHUNK, bytes(CHUNK)), 0.1)
    client.handle_timer(client.next_deadline())
    assert len(client.messages_to_send()) == RANGES


def test_foreign_and_malformed_data_is_not_taken():
    client = fetching(100)
    for message in (data(0, bytes(90), 5), data(7, bytes(90)), data(0, bytes(20)), data(900, bytes(90))):
        client.receive(message, 0.1)
    assert client.events() == []
    client.receive(data(0, bytes(90)), 0.1)
    client.receive(data(90, bytes(10)), 0.1)
    assert outcome(client) == [LogReceived(RemoteLog(0, 0, 100), bytes(100))]


def test_a_log_that_ends_early_fails():
    client = fetching(100)
    client.receive(data(90, b""), 0.1)
    assert outcome(client) == [LogFailed("log 0 ends at byte 90 of 100")]


def test_an_empty_log_needs_no_answer():
    client = fetching(0)
    assert outcome(client) == [LogReceived(RemoteLog(0, 0, 0), b"")]


def test_silence_ends_it_and_the_vehicle_is_told():
    client = fetching(100)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    assert outcome(client) == [LogFailed("no answer")]
    assert client.messages_to_send()[-1].get_type() == "LOG_REQUEST_END"


def test_one_thing_at_a_time_and_no_log_larger_than_memory():
    client = fetching(100)
    with pytest.raises(LocalProtocolError):
        client.request_list(VEHICLE, 0.0)
    with pytest.raises(LocalProtocolError, match="at most"):
        LogClient().fetch(VEHICLE, RemoteLog(0, 0, 1 << 31), 0.0)


def test_cancelling_ends_it():
    client = fetching(100)
    client.cancel("closed")
    assert (outcome(client), client.is_busy) == ([LogFailed("closed")], False)


# Both together


def converse(act, *, seed=0, limit=120.0, **losses):
    """Run a client's operation on a link; its one event and when it came."""
    server, client = LogServer(1, 1, Store(FULL, LONG, b"", b"x")), LogClient()
    up, down = LossyPipe(seed, **losses), LossyPipe(seed + 1000, **losses)
    now = 0.0
    act(client)
    while client.is_busy and now < limit:
        for engine, pipe in ((client, up), (server, down)):
            for item in engine.messages_to_send():
                pipe.send(getattr(item, "message", item), now)
        now = max(now, min(client.next_deadline(), server.next_deadline(), up.next_arrival(), down.next_arrival()))
        for message in up.receive(now):
            server.receive(message, now, GROUND)
        for message in down.receive(now):
            client.receive(message, now)
        server.handle_timer(now)
        client.handle_timer(now)
    (event,) = outcome(client)
    return event


@pytest.mark.parametrize("seed", range(6))
def test_lists_and_logs_survive_30_percent_loss(seed):
    losses = {"drop": 0.3, "duplicate": 0.1, "reorder": 0.3, "delay": 0.05}
    listed = converse(lambda client: client.request_list(VEHICLE, 0.0), seed=seed, **losses)
    assert [log.size for log in listed.logs] == [360, 30_000, 0, 1]
    for log, expected in zip(listed.logs, (FULL, LONG, b"", b"x"), strict=True):
        received = converse(lambda client, log=log: client.fetch(VEHICLE, log, 0.0), seed=seed, **losses)
        assert received == LogReceived(log, expected)


def test_only_the_station_in_control_may_erase():
    vehicle = VehicleEndpoint(validate=lambda _items: None, logs=Store(LONG))
    vehicle.operator.armed(GROUND, 0.0)
    asked = {}
    for system in (OTHER.system, GROUND.system):
        vehicle.receive_datagram(frame(mavlink.MAVLink_log_erase_message(1, 1), system), system, 0.1)
        asked[system] = any(isinstance(event, LogEraseRequested) for event in vehicle.events())
    assert asked == {OTHER.system: False, GROUND.system: True}


def test_the_endpoints_carry_it():
    link = Link(drop=0.2)
    link.vehicle.endpoint = link.vehicle.endpoint.__class__(
        validate=lambda _items: None, peers=["ground"], logs=Store(LONG)
    )
    assert link.run(lambda: link.ground.vehicle is not None)
    link.ground.list_logs(link.now)
    (log,) = link.wait_for(LogsListed).logs
    link.ground.fetch_log(log, link.now)
    assert link.wait_for(LogReceived).data == LONG
