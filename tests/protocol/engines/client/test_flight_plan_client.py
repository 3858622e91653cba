"""The flight plan client: when it requests the table, what of it again, and which events."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.client.flight_plan_client import FlightPlanClient
from protocol.engines.server.flight_plan_server import FlightPlanServer
from protocol.events import FlightPlanReceived
from protocol.wire.codec import Codec
from tests.support.links.flight_plan_table import event, status, table

EVENT = mavlink.DARKO_PLAN_PART_EVENT


def heard(message):
    (decoded,) = Codec(255, 190).decode(Codec(1, 1).encode(message))
    return decoded


def told(server, **changes):
    """The server's status, with changes."""
    message = status()
    server.mark(message)
    for name, value in changes.items():
        setattr(message, name, value)
    return heard(message)


def requested(client, part=mavlink.DARKO_PLAN_PART_ENTRY):
    """Numbers of the entries, or events, requested since the last look."""
    return [message.number for message in client.messages_to_send() if message.part == part]


@pytest.fixture
def server():
    made = FlightPlanServer(1, 1)
    made.load(table(blocks=4, waypoints=2, variables=1))  # 8 entries; 4, 5 and 6 can change
    return made


@pytest.fixture
def client(server):
    """With the whole table."""
    made = FlightPlanClient()
    made.receive(told(server), 0.0)
    for number in range(8):
        made.receive(heard(server._entries[number]), 0.1)
    assert made.events() == [FlightPlanReceived(server.plan_id, 8)]
    made.messages_to_send()
    return made


def test_entries_that_can_change_are_requested_after_two_statuses_with_another_checksum(client, server):
    wrong = told(server, checksum=1)
    client.receive(wrong, 1.0)
    assert requested(client) == []
    client.receive(wrong, 1.25)
    assert requested(client) == [4, 5, 6]


def test_a_status_with_the_right_checksum_between_two_others_counts_from_the_beginning(client, server):
    for now, checksum in ((1.0, 1), (1.25, None), (1.5, 1)):
        client.receive(told(server) if checksum is None else told(server, checksum=checksum), now)
    assert requested(client) == []


def test_after_a_new_request_two_more_statuses_lead_to_the_next_one(client, server):
    wrong = told(server, checksum=1)
    for now in (1.0, 1.25):
        client.receive(wrong, now)
    for number in requested(client):
        client.receive(heard(server._entries[number]), 1.3)
    client.receive(wrong, 1.5)
    assert requested(client) == []
    client.receive(wrong, 1.75)
    assert requested(client) == [4, 5, 6]


@pytest.mark.parametrize(("entries", "asked"), [(0, 0), (1, 1), (9, 9), (10, 10), (11, 10), (2000, 10), (2001, 0)])
def test_ten_entries_are_requested_at_a_time_of_a_table_of_up_to_2000(server, entries, asked):
    client = FlightPlanClient()
    client.receive(told(server, entries=entries), 0.0)
    assert requested(client) == list(range(asked))


def test_an_event_of_another_plan_does_not_stand_for_one_that_is_missing(client, server):
    happened = heard(server.tell(event()))
    happened.plan_id += 1
    client.receive(happened, 1.0)
    client.receive(told(server), 1.25)
    assert requested(client, EVENT) == [1]


@pytest.mark.parametrize(("age", "again"), [(0.99, []), (1.0, [1])])
def test_an_event_is_requested_again_after_a_second(client, server, age, again):
    server.tell(event())
    client.receive(told(server), 1.0)
    assert requested(client, EVENT) == [1]
    client.receive(told(server), 1.0 + age)
    assert requested(client, EVENT) == again
