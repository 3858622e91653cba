"""The log client: lists and logs are complete or fail."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.log_client import MAX_GAPS, LogClient
from protocol.errors import LocalProtocolError
from protocol.events import LogFailed, LogProgress, LogReceived, LogsListed, RemoteLog
from protocol.ranges import LOG_DATA_SIZE
from tests.support.links.log_store import data

VEHICLE = (1, 1)


def entry(number, count, size=100):
    return mavlink.MAVLink_log_entry_message(number, count, count - 1, 0, size)


def fetching(size):
    client = LogClient()
    client.fetch(VEHICLE, RemoteLog(0, 0, size), 0.0)
    client.messages_to_send()
    return client


def outcome(client):
    return [event for event in client.events() if not isinstance(event, LogProgress)]


def test_missing_entries_are_requested_again():
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


def test_log_numbers_may_start_at_1():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    for number in (1, 2):
        client.receive(mavlink.MAVLink_log_entry_message(number, 2, 2, 0, 100), 0.1)
    assert outcome(client) == [LogsListed((RemoteLog(1, 0, 100), RemoteLog(2, 0, 100)))]


def test_a_vehicle_without_logs_has_an_empty_list():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    client.receive(mavlink.MAVLink_log_entry_message(0, 0, 0, 0, 0), 0.1)
    assert outcome(client) == [LogsListed(())]


def test_gaps_are_requested_as_ranges():
    client = fetching(6 * LOG_DATA_SIZE + 10)
    for number in (0, 3):
        client.receive(data(number * LOG_DATA_SIZE, bytes(LOG_DATA_SIZE)), 0.1)
    client.handle_timer(client.next_deadline())
    requests = client.messages_to_send()
    assert [(r.ofs, r.count) for r in requests] == [(90, 180), (360, 190)]


def test_gaps_are_not_all_requested_at_once():
    client = fetching(200 * LOG_DATA_SIZE)
    for number in range(0, 200, 2):
        client.receive(data(number * LOG_DATA_SIZE, bytes(LOG_DATA_SIZE)), 0.1)
    client.handle_timer(client.next_deadline())
    assert len(client.messages_to_send()) == MAX_GAPS


def test_unrequested_and_malformed_data_is_ignored():
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


def test_a_silent_vehicle_ends_the_download_with_log_request_end():
    client = fetching(100)
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
    assert outcome(client) == [LogFailed("no answer")]
    assert client.messages_to_send()[-1].get_type() == "LOG_REQUEST_END"


def test_one_download_at_a_time_and_no_too_large_log():
    client = fetching(100)
    with pytest.raises(LocalProtocolError):
        client.request_list(VEHICLE, 0.0)
    with pytest.raises(LocalProtocolError, match="the maximum is"):
        LogClient().fetch(VEHICLE, RemoteLog(0, 0, 1 << 31), 0.0)


def test_cancelling_ends_the_download():
    client = fetching(100)
    client.cancel("closed")
    assert (outcome(client), client.is_busy) == ([LogFailed("closed")], False)


def test_the_whole_list_is_requested():
    client = LogClient()
    client.request_list(VEHICLE, 0.0)
    (request,) = client.messages_to_send()
    assert (request.start, request.end) == (0, 0xFFFF)
