"""The log server: lists and ranges for many peers."""

import math
import random

from protocol.dialect import mavlink
from protocol.engines.file_transfer import Log
from protocol.engines.server import log_server
from protocol.engines.server.log_server import LogServer
from protocol.events import LogEraseRequested
from protocol.ranges import LOG_DATA_SIZE
from protocol.wire.message import Peer
from tests.support.links.log_store import Opened, Store

GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")


LONG = random.Random(3).randbytes(30_000)


FULL = LONG[: 4 * LOG_DATA_SIZE]


def listing(start=0, end=0xFFFF):
    return mavlink.MAVLink_log_request_list_message(1, 1, start, end)


def wanted(number, offset=0, count=0xFFFFFFFF):
    return mavlink.MAVLink_log_request_data_message(1, 1, number, offset, count)


def ask(server, *requests, peer=GROUND):
    """Send requests, let time pass until all are answered; returns the answers to that peer."""
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


def test_a_list_contains_every_log_numbered_from_0():
    entries = ask(LogServer(1, 1, Store(b"a", b"bc", LONG)), listing())
    assert [(e.id, e.num_logs, e.last_log_num, e.size) for e in entries] == [
        (0, 3, 2, 1),
        (1, 3, 2, 2),
        (2, 3, 2, len(LONG)),
    ]
    assert entries[1].time_utc == 1_700_000_001


def test_a_list_without_logs_is_one_empty_entry():
    (entry,) = ask(LogServer(1, 1, Store()), listing())
    assert (entry.id, entry.num_logs, entry.last_log_num, entry.time_utc, entry.size) == (0, 0, 0, 0, 0)


def test_a_part_of_the_list_can_be_requested():
    server = LogServer(1, 1, Store(b"a", b"b", b"c", b"d"))
    assert [e.id for e in ask(server, listing(1, 2))] == [1, 2]
    assert ask(server, listing(4, 9)) == []


def test_a_log_is_sent_completely_in_order_and_at_the_send_rate():
    server = LogServer(1, 1, Store(LONG))
    server.receive(wanted(0), 0.0, GROUND)
    server.handle_timer(server.next_deadline())
    first = [o.message for o in server.messages_to_send()]
    assert len(first) == log_server.MESSAGES_PER_INTERVAL
    messages = first + run(server)
    assert joined(messages) == LONG
    assert [m.ofs for m in messages] == list(range(0, len(LONG), LOG_DATA_SIZE))
    assert messages[-1].count == len(LONG) % LOG_DATA_SIZE


def test_a_full_last_message_is_followed_by_an_empty_one():
    messages = ask(LogServer(1, 1, Store(FULL)), wanted(0))
    assert [(m.ofs, m.count) for m in messages] == [(0, 90), (90, 90), (180, 90), (270, 90), (360, 0)]
    exact = ask(LogServer(1, 1, Store(FULL)), wanted(0, 0, len(FULL)))
    assert [m.count for m in exact] == [90] * 4


def test_several_requested_ranges_are_all_sent():
    messages = ask(LogServer(1, 1, Store(LONG)), wanted(0, 900, 180), wanted(0, 0, 90), wanted(0, 900, 180))
    assert [(m.ofs, m.count) for m in messages] == [(900, 90), (990, 90), (0, 90)]


def test_requests_for_a_missing_log_are_answered_at_once():
    server = LogServer(1, 1, Store(LONG))
    assert [(m.id, m.ofs, m.count) for m in ask(server, wanted(7, 90))] == [(7, 90, 0)]
    assert [(m.ofs, m.count) for m in ask(server, wanted(0, len(LONG)))] == [(len(LONG), 0)]


def test_a_request_for_another_log_ends_the_present_one():
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


def test_a_deleted_log_does_not_renumber_a_download():
    store = Store(b"first", b"second")
    server = LogServer(1, 1, store)
    ask(server, listing())
    store.logs = lambda: [Log("1", 0, 6)]
    ask(server, listing(), peer=OTHER)
    assert joined(ask(server, wanted(1))) == b"second"
    assert joined(ask(server, wanted(0), peer=OTHER)) == b"second"


def test_peers_and_ranges_are_limited():
    server = LogServer(1, 1, store := Store(LONG))
    for system in range(1, 100):
        for offset in range(100):
            server.receive(wanted(0, offset * LOG_DATA_SIZE, LOG_DATA_SIZE), 0.0, Peer(system, 1, system))
    assert store.opened == len(server._clients) == log_server.MAX_LOG_CLIENTS
    assert all(len(client.ranges) == log_server.MAX_OPEN_RANGES for client in server._clients.values())


def test_peers_share_the_send_rate():
    server = LogServer(1, 1, Store(LONG))
    for peer in (GROUND, OTHER):
        server.receive(wanted(0), 0.0, peer)
    server.handle_timer(server.next_deadline())
    peers = [o.peer for o in server.messages_to_send()]
    assert peers.count(GROUND) == peers.count(OTHER) == log_server.MESSAGES_PER_INTERVAL / 2


def test_erasing_is_reported_and_other_targets_are_ignored():
    server = LogServer(1, 1, Store(LONG))
    server.receive(mavlink.MAVLink_log_erase_message(2, 1), 0.0, GROUND)
    assert server.events() == []
    server.receive(mavlink.MAVLink_log_erase_message(1, 1), 0.0, GROUND)
    assert server.events() == [LogEraseRequested()]


def test_a_read_error_ends_the_log_there():
    class Failing(Opened):
        def read(self, *_):
            raise OSError(5, "disk")

    store = Store(LONG)
    store.open = lambda _name: Failing(store, LONG)
    assert [(m.ofs, m.count) for m in ask(LogServer(1, 1, store), wanted(0, 90))] == [(90, 0)]


def entry(number, count, size=100):
    return mavlink.MAVLink_log_entry_message(number, count, count - 1, 0, size)


def test_the_next_parts_are_due_an_interval_later_and_none_after_the_last():
    server = LogServer(1, 1, Store(LONG))
    server.receive(wanted(0, 0, 12 * LOG_DATA_SIZE), 7.0, GROUND)
    due = [server.next_deadline()]
    while due[-1] < math.inf:
        server.handle_timer(due[-1])
        due.append(server.next_deadline())
    calls = math.ceil(12 / log_server.MESSAGES_PER_INTERVAL)
    assert due == [*(7.0 + k * log_server.SEND_INTERVAL for k in range(calls)), math.inf]
    assert [m.message.ofs for m in server.messages_to_send()] == [k * LOG_DATA_SIZE for k in range(12)]


def test_32_ranges_wait_at_a_time():
    requests = [wanted(0, 90 * number, 90) for number in range(40)]
    messages = ask(LogServer(1, 1, Store(LONG)), *requests)
    assert [message.ofs for message in messages] == [90 * number for number in range(32)]
