"""The mission client downloads and clears plans, and selects the current item."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import Remote
from protocol.engines.client.mission_client import MissionClient
from protocol.errors import LocalProtocolError
from protocol.events import CurrentItemSet, MissionCleared, MissionDownloaded, MissionFailed
from tests.support.links.link import plan
from tests.support.links.mission_client import (
    CANCELLED,
    ERROR,
    HEARTBEAT,
    INVALID_SEQUENCE,
    ITEMS,
    VEHICLE,
    ack,
    ask,
    count,
    current,
    downloading,
    ends,
    feed,
    hear,
    item,
    numbered,
    sent,
    uploading,
)


def test_a_cancelled_download_is_cancelled_at_the_vehicle():
    client = downloading()
    feed(client, count(3), item(0))
    client.messages_to_send()
    client.cancel("cancelled")
    assert [(m.get_type(), m.type) for m in client.messages_to_send()] == [("MISSION_ACK", CANCELLED)]
    assert client.next_deadline() == math.inf


def test_a_download_requests_every_item_and_acknowledges():
    client = downloading()
    feed(client, count(3), item(0), item(1), item(2))
    assert sent(client) == [
        ("MISSION_REQUEST_LIST", None),
        *[("MISSION_REQUEST_INT", n) for n in range(3)],
        ("MISSION_ACK", None),
    ]
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_a_download_of_an_empty_plan_ends_at_once():
    client = downloading()
    feed(client, count(0))
    assert ends(client) == [MissionDownloaded(())]


def test_only_a_lost_item_is_requested_again():
    client = downloading()
    feed(client, count(3), item(0), item(2))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_REQUEST_INT", 1)]
    feed(client, item(1), now=1.0)
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_five_items_are_requested_at_a_time():
    client, items = downloading(), plan(20)
    feed(client, count(20))
    assert sent(client)[1:] == [("MISSION_REQUEST_INT", n) for n in range(5)]
    feed(client, items[2].to_message(2, 255, 190))
    assert sent(client) == [("MISSION_REQUEST_INT", 5)]


def test_an_item_overtaken_by_three_others_is_requested_again_at_once():
    client, items = downloading(), plan(20)
    feed(client, count(20))
    client.messages_to_send()
    feed(client, *[items[n].to_message(n, 255, 190) for n in (1, 2)])
    assert ("MISSION_REQUEST_INT", 0) not in sent(client)
    feed(client, items[3].to_message(3, 255, 190))
    assert ("MISSION_REQUEST_INT", 0) in sent(client)


def test_after_a_refusal_items_are_requested_one_by_one():
    client = downloading()
    feed(client, count(3), item(1), ack(INVALID_SEQUENCE))
    client.messages_to_send()
    assert ends(client) == []
    feed(client, count(3), item(0))
    assert sent(client) == [("MISSION_REQUEST_INT", 0), ("MISSION_REQUEST_INT", 1)]
    feed(client, item(1), item(2))
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_unrequested_and_duplicate_items_are_dropped():
    client = downloading()
    feed(client, count(3), item(2), item(0), item(0), item(1), count(3), item(2), item(2))
    assert ends(client) == [MissionDownloaded(ITEMS)]


@pytest.mark.parametrize("before", [count(2, 5), count(2, 0), count(3, 4)])
def test_a_plan_that_changes_is_downloaded_anew(before):
    """A different number of items, or the same number with another plan id."""
    client = downloading()
    feed(client, before, item(0), count(3, 5), item(0), count(3, 5), item(1), item(2))
    assert ends(client)[-1] == MissionDownloaded(ITEMS)
    assert sent(client).count(("MISSION_REQUEST_INT", 0)) == 2


def test_an_accepting_ack_during_a_download_is_ignored():
    client = downloading()
    feed(client, ack(), count(3), ack(), item(0))
    assert client.is_busy


def test_a_download_fails_if_every_request_is_refused():
    client = downloading()
    feed(client, count(3), ack(INVALID_SEQUENCE), count(3), ack(INVALID_SEQUENCE))
    assert ends(client) == [MissionFailed("download", INVALID_SEQUENCE, "INVALID_SEQUENCE")]


def test_clear_ends_with_its_ack():
    client = MissionClient(255, 190)
    client.clear(VEHICLE, 0.0)
    feed(client, ack())
    client.clear(VEHICLE, 1.0)
    feed(client, ack(ERROR))
    assert ends(client) == [MissionCleared(), MissionFailed("clear", ERROR, "ERROR")]


def test_the_current_item_is_set_once_the_vehicle_confirms_it():
    client = MissionClient(255, 190)
    client.set_current(VEHICLE, 2, 0.0)
    feed(client, current(0), current(1))
    assert client.is_busy
    feed(client, current(2))
    assert ends(client) == [CurrentItemSet(2)]


def test_messages_of_other_plan_types_and_for_others_are_ignored():
    client = uploading()
    client.messages_to_send()
    feed(client, ask(0, kind=1), ack(ERROR, kind=2), mavlink.MAVLink_mission_ack_message(245, 190, ERROR))
    assert (sent(client), client.events()) == ([], [])


def test_items_of_another_plan_type_are_ignored():
    client = downloading()
    feed(client, count(3), ITEMS[0].to_message(0, 255, 190, kind=1))
    assert client.events() == []


def test_a_clear_of_all_types_ends_with_the_ack_for_all_types():
    client = MissionClient(255, 190)
    client.clear(VEHICLE, 0.0, 255)
    feed(client, ack(kind=0))
    assert client.is_busy
    feed(client, ack(kind=255))
    assert ends(client) == [MissionCleared(255)]


def test_items_of_an_earlier_download_are_ignored():
    remote, new = Remote(), plan(3, 700)
    client = MissionClient(255, 190, remote)
    fresh = [new[n].to_message(n, 255, 190) for n in range(3)]
    old, heartbeat, told, *rest = numbered(item(0), HEARTBEAT, count(3), *fresh)
    hear(client, remote, heartbeat)
    client.download(VEHICLE, 0.1)
    hear(client, remote, told, old, *rest)
    assert ends(client) == [MissionDownloaded(new)]


def test_one_operation_at_a_time():
    client = uploading()
    for begin in (lambda: client.clear(VEHICLE, 0.0), lambda: client.download(VEHICLE, 0.0)):
        with pytest.raises(LocalProtocolError, match="announcing"):
            begin()


@pytest.mark.parametrize(
    "begin", [lambda c: c.upload(VEHICLE, [ITEMS[0]] * 65536, 0.0), lambda c: c.set_current(VEHICLE, -1, 0.0)]
)
def test_numbers_that_do_not_fit_the_wire_are_refused(begin):
    client = MissionClient(255, 190)
    with pytest.raises(LocalProtocolError):
        begin(client)
    assert not client.is_busy
