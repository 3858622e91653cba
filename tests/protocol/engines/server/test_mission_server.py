"""The mission server: downloads, clears, the current item, and messages that arrive late."""

import pytest

from protocol.dialect import mavlink
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived
from protocol.wire.codec import Codec
from tests.support.links.link import plan
from tests.support.links.mission_server import OLD, count, feed, item, numbered, received, server

ACCEPTED, UNSUPPORTED, INVALID_SEQUENCE = 0, 3, 13


def test_a_lost_count_of_a_download_is_sent_again():
    engine = server()
    feed(engine, *[mavlink.MAVLink_mission_request_list_message(1, 1)] * 2)
    assert received(engine) == [("COUNT", 2)] * 2


@pytest.mark.parametrize(
    "message",
    [
        count(3, 255),
        mavlink.MAVLink_mission_request_list_message(1, 1, 255),
        mavlink.MAVLink_mission_request_int_message(1, 1, 0, 255),
    ],
)
def test_all_types_at_once_can_be_cleared_and_nothing_else(message):
    engine = server()
    feed(engine, message)
    (out,) = engine.messages_to_send()
    assert (out.message.type, out.message.mission_type) == (UNSUPPORTED, 255)


@pytest.mark.parametrize(
    "late",
    [count(5), mavlink.MAVLink_mission_clear_all_message(1, 1), mavlink.MAVLink_mission_set_current_message(1, 1, 0)],
)
def test_a_late_count_starts_no_upload(late):
    engine = server()
    old, opens, first = numbered(late, count(1), item(0))
    feed(engine, opens, first, old)
    assert (engine.items, engine.is_receiving) == (plan(1), False)
    assert received(engine) == [("REQUEST", 0), ("ACK", ACCEPTED)]
    assert [type(event) for event in engine.events()] == [MissionReceived]


@pytest.mark.parametrize("clear", [count(0), mavlink.MAVLink_mission_clear_all_message(1, 1, 0)])
def test_count_zero_clears_as_clear_does(clear):
    engine = server()
    feed(engine, clear)
    assert received(engine) == [("ACK", ACCEPTED)]
    assert engine.events() == [MissionCleared()]
    assert engine.items == ()


def test_clear_of_all_types_clears_the_plan_and_clear_of_a_fence_does_not():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    assert engine.items == OLD
    feed(engine, mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert engine.items == ()


def test_a_late_clear_does_not_clear_a_newer_plan():
    """Frames carry sequence numbers: an old one must not undo what came after it."""
    engine, sender, receiver = server(), Codec(255, 190), Codec(1, 1)
    clear = mavlink.MAVLink_mission_clear_all_message(1, 1)
    first, second, *rest = [receiver.decode(sender.encode(m))[0] for m in (clear, clear, count(1), item(0))]
    feed(engine, *rest, first, second)
    assert engine.items == plan(1)


@pytest.mark.parametrize("kind", [1, 2])
def test_fence_and_rally_requests_are_answered_without_such_plans(kind):
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1, kind), count(3, kind), count(0, kind))
    assert received(engine) == [("COUNT", 0), ("ACK", UNSUPPORTED), ("ACK", ACCEPTED)]
    assert not engine.is_receiving


def test_answers_carry_the_requested_plan_type():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1, 2), count(3, 1))
    assert [out.message.mission_type for out in engine.messages_to_send()] == [2, 1]


def test_five_requests_in_flight_are_answered_one_by_one():
    engine = server(plan(6))
    for seq in (4, 0, 2, 1, 3):
        feed(engine, mavlink.MAVLink_mission_request_int_message(1, 1, seq))
    assert received(engine) == [("ITEM", seq) for seq in (4, 0, 2, 1, 3)]


def test_an_old_request_message_gets_a_new_item_message():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_message(1, 1, 1))
    (out,) = engine.messages_to_send()
    assert out.message.get_type() == "MISSION_ITEM_INT"


def test_the_current_item_is_marked_in_a_download():
    engine = server()
    engine.current = 1
    for seq in (0, 1):
        feed(engine, mavlink.MAVLink_mission_request_int_message(1, 1, seq))
    assert [out.message.current for out in engine.messages_to_send()] == [0, 1]


def test_an_item_that_does_not_exist_is_an_invalid_sequence():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_int_message(1, 1, 2))
    feed(engine, mavlink.MAVLink_mission_set_current_message(1, 1, 2))
    assert received(engine) == [("ACK", INVALID_SEQUENCE)] * 2
    assert engine.events() == []


def test_an_existing_current_item_is_reported():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_set_current_message(1, 1, 1))
    assert engine.events() == [CurrentItemRequested(1)]


def test_a_partial_download_is_unsupported():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_partial_list_message(1, 1, 0, 1))
    assert received(engine) == [("ACK", UNSUPPORTED)]


def test_messages_for_others_and_unrequested_items_are_ignored():
    engine = server()
    feed(
        engine, mavlink.MAVLink_mission_count_message(2, 1, 3), item(0), mavlink.MAVLink_mission_clear_all_message(1, 9)
    )
    assert received(engine) == []
    assert engine.items == OLD
