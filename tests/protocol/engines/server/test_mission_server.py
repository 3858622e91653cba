"""The vehicle's side of the mission protocol (https://mavlink.io/en/services/mission.html), and its plans."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import STALL_LIMIT
from protocol.engines.server.mission_server import MissionInstead
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived, MissionRefused
from protocol.plans.plan import MissionItem, Refusal
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.link import plan
from tests.support.links.mission_server import OLD, OTHER, count, feed, item, numbered, received, server

PLAN_ACCEPTED, NO_SPACE, DENIED, CANCELLED = 0, 4, 14, 15


def test_an_upload_requests_every_item_in_order_and_ends_with_one_ack():
    engine, new = server(), plan(3)
    feed(engine, count(3), *[item(n, new) for n in range(3)])
    assert received(engine) == [("REQUEST", 0), ("REQUEST", 1), ("REQUEST", 2), ("ACK", PLAN_ACCEPTED)]
    assert engine.events() == [MissionReceived(new)]
    assert engine.items == new


def test_the_old_plan_stays_until_the_new_one_is_complete():
    engine = server()
    feed(engine, count(3), item(0), item(1))
    assert engine.items == OLD
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1), peer=OTHER)
    assert engine.messages_to_send()[-1].message.count == 2


def test_an_early_item_is_dropped_and_the_expected_one_requested_again():
    engine = server()
    feed(engine, count(3), item(2))
    assert received(engine) == [("REQUEST", 0), ("REQUEST", 0)]
    feed(engine, item(0))
    assert received(engine) == [("REQUEST", 1)]


def test_a_duplicate_item_is_ignored():
    """A new request for every duplicate item would double the traffic with every repetition."""
    engine = server()
    feed(engine, count(2), item(0), item(0))
    assert received(engine) == [("REQUEST", 0), ("REQUEST", 1)]


def test_a_lost_item_is_requested_again_until_the_upload_times_out():
    engine, times = server(), []
    feed(engine, count(2))
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
        times.append(now)
    assert received(engine) == [("REQUEST", 0)] * 9 + [("ACK", CANCELLED)]
    assert times == pytest.approx([0.25, 0.75, 1.75, 3.25, 4.75, 6.25, 7.75, 9.25, 10.75])
    assert [type(event) for event in engine.events()] == [MissionRefused]
    assert engine.items == OLD
    assert not engine.is_receiving


def test_a_lost_final_ack_is_repeated_when_the_last_item_arrives_again():
    engine = server()
    feed(engine, count(2), item(0), item(1))
    assert received(engine)[2:] == [("ACK", PLAN_ACCEPTED)]
    feed(engine, item(1))
    assert received(engine) == [("ACK", PLAN_ACCEPTED)]
    feed(engine, item(0))
    assert received(engine) == []
    assert len(engine.events()) == 1


def test_a_cancel_by_the_sender_keeps_the_old_plan():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED))
    assert engine.items == OLD
    assert engine.next_deadline() == math.inf
    assert [event.result for event in engine.events()] == [CANCELLED]


def test_a_cancel_by_the_sender_is_not_answered():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED), item(1), item(2))
    assert received(engine) == [("REQUEST", 0), ("REQUEST", 1)]


def test_an_accepting_ack_of_the_sender_is_ignored():
    """It ends a download, for which the vehicle has no state."""
    engine = server()
    feed(engine, count(2), mavlink.MAVLink_mission_ack_message(1, 1, PLAN_ACCEPTED))
    assert engine.is_receiving


def test_a_lost_request_is_repeated():
    engine = server()
    feed(engine, count(2))
    engine.handle_timer(engine.next_deadline())
    feed(engine, item(0), now=0.3)
    assert received(engine) == [("REQUEST", 0), ("REQUEST", 0), ("REQUEST", 1)]


def test_the_wait_for_items_follows_the_round_trip():
    """At half a second of delay each way every item is requested once; with 0.25 s four times."""
    engine, now = server(), 0.0
    feed(engine, count(20), now=now)
    for seq in range(20):
        due = now + 1.0
        while engine.next_deadline() < due:
            engine.handle_timer(engine.next_deadline())
        now = due
        feed(engine, item(seq), now=now)
    requests = [seq for what, seq in received(engine) if what == "REQUEST"]
    assert {seq: requests.count(seq) for seq in range(3, 20)} == dict.fromkeys(range(3, 20), 1)


def test_after_some_repetitions_earlier_items_are_requested_too():
    """A sender that a late request has set back ignores requests for later items."""
    engine = server()
    feed(engine, count(9), item(0), item(1), item(2))
    engine.messages_to_send()
    asked = []
    for _ in range(4):
        engine.handle_timer(engine.next_deadline())
        asked.append([seq for _, seq in received(engine)])
    assert asked == [[3], [2, 3], [1, 2, 3], [1, 2, 3]]
    feed(engine, item(2), item(3), now=5.0)
    assert received(engine) == [("REQUEST", 4)]


@pytest.mark.parametrize("away", [2.0, 5.0, 8.0])
def test_an_upload_resumes_after_a_link_outage(away):
    engine, new = server(), plan(3)
    feed(engine, count(3), item(0))
    while engine.next_deadline() < away:
        engine.handle_timer(engine.next_deadline())
    feed(engine, item(1), item(2), now=away)
    assert engine.items == new


def test_an_upload_of_only_wrong_items_times_out():
    engine, now = server(), 0.0
    feed(engine, count(3), item(0))
    while engine.is_receiving:
        now = engine.next_deadline()
        feed(engine, item(0), now=now)
        engine.handle_timer(now)
    assert now == pytest.approx(STALL_LIMIT, abs=1.5)
    assert engine.items == OLD


def test_items_after_a_timeout_get_the_final_ack_again():
    engine = server()
    feed(engine, count(3), item(0))
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
    engine.messages_to_send()
    feed(engine, item(1), now=now)
    assert received(engine) == [("ACK", CANCELLED)]


def test_a_clear_ends_the_senders_own_upload_with_one_answer():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_clear_all_message(1, 1))
    assert received(engine)[2:] == [("ACK", PLAN_ACCEPTED)]
    assert (engine.items, engine.is_receiving) == ((), False)


def test_an_item_of_another_plan_type_is_ignored():
    engine, new = server(), plan(2)
    feed(engine, count(2), new[0].to_message(0, 1, 1, kind=1), new[0].to_message(0, 1, 1, kind=255))
    assert received(engine) == [("REQUEST", 0)]


def test_items_and_a_cancel_from_before_an_upload_are_ignored():
    engine, new = server(), plan(2, 900)
    cancel = mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED)
    old, end, opens, *rest = numbered(item(0), cancel, count(2), *[new[n].to_message(n, 1, 1) for n in range(2)])
    feed(engine, opens, old, end, *rest, now=100.0)
    assert engine.items == new


def test_a_reordered_item_of_the_same_upload_is_accepted():
    engine, new = server(), plan(2)
    opens, first, beat, second = numbered(count(2), item(0), mavlink.MAVLink_mission_ack_message(1, 1, 0), item(1))
    feed(engine, opens, beat, first, second)
    assert engine.items == new


def test_a_refused_plan_keeps_the_old_one_and_reports_the_reason():
    engine = server(refusal=Refusal("latitude", 10))
    feed(engine, count(1), item(0))
    assert received(engine)[-1] == ("ACK", 10)
    assert engine.events() == [MissionRefused(10, "latitude")]
    assert engine.items == OLD


def test_a_repeated_count_restarts_the_upload():
    engine = server()
    feed(engine, count(3), item(0), item(1), count(2))
    assert received(engine)[-1] == ("REQUEST", 0)
    feed(engine, item(0), item(1))
    assert engine.items == plan(2)


def test_another_ground_station_is_denied_while_one_uploads():
    engine = server()
    feed(engine, count(2))
    engine.messages_to_send()
    feed(engine, count(5), item(0), mavlink.MAVLink_mission_clear_all_message(1, 1), peer=OTHER)
    assert received(engine, OTHER) == [("ACK", DENIED), ("ACK", DENIED)]
    feed(engine, mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED), peer=OTHER)
    assert engine.is_receiving


def test_a_ground_station_may_change_its_port_during_an_upload():
    engine, moved = server(), Peer(255, 190, "new port")
    feed(engine, count(2), item(0))
    engine.messages_to_send()
    feed(engine, item(1), peer=moved)
    assert received(engine, moved) == [("ACK", PLAN_ACCEPTED)]


def test_too_many_items_are_refused_at_once():
    engine = server()
    feed(engine, count(1000))
    assert received(engine) == [("REQUEST", 0)]
    feed(engine, count(1001))
    assert received(engine) == [("ACK", NO_SPACE)]


def test_nan_and_minus_zero_are_stored_bit_for_bit():
    engine = server()
    odd = MissionItem(
        command=16, frame=3, params=(math.nan, -0.0, 1e-40, -math.inf), x=-(2**31), y=2**31 - 1, z=math.nan
    )
    sender, vehicle, ground = Codec(255, 190), Codec(1, 1), Codec(255, 190)
    for message in (count(1), odd.to_message(0, 1, 1), mavlink.MAVLink_mission_request_int_message(1, 1, 0)):
        feed(engine, *vehicle.decode(sender.encode(message)))
    sent = sender.encode(odd.to_message(0, 255, 190))
    (back,) = ground.decode(vehicle.encode(engine.messages_to_send()[-1].message))
    assert bytes(back.get_msgbuf()[10:38]) == sent[10:38]  # four params, x, y, z
    assert MissionItem.from_message(back) == odd


SHOWN = MissionInstead(plan(3, 900), current=2, reason="a flight plan is flown")


def test_an_upload_ends_with_the_reason_when_something_else_is_shown():
    engine = server()
    feed(engine, count(2), item(0))
    engine.messages_to_send()
    engine.show_instead(SHOWN)
    assert received(engine) == [("ACK", DENIED)]
    assert engine.events() == [MissionRefused(DENIED, "a flight plan is flown")]
    assert (engine.is_receiving, engine.items, engine.next_deadline()) == (False, OLD, math.inf)


def test_without_an_upload_nothing_is_sent_when_something_else_is_shown():
    engine = server()
    engine.show_instead(SHOWN)
    engine.show_instead(None)
    assert (engine.messages_to_send(), engine.events()) == ([], [])


def test_an_upload_goes_on_when_the_plan_itself_is_shown():
    engine = server()
    feed(engine, count(1))
    engine.show_instead(None)
    feed(engine, item(0))
    assert received(engine) == [("REQUEST", 0), ("ACK", PLAN_ACCEPTED)]


def test_peers_download_what_is_shown_instead_and_cannot_change_it():
    engine = server()
    engine.show_instead(SHOWN)
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1))
    for seq in range(4):
        feed(engine, mavlink.MAVLink_mission_request_int_message(1, 1, seq))
    counted, *items, beyond = [out.message for out in engine.messages_to_send()]
    assert (counted.count, beyond.type) == (3, 13)
    assert [MissionItem.from_message(message) for message in items] == list(SHOWN.items)
    assert [message.current for message in items] == [0, 0, 1]
    feed(engine, count(0), count(2), mavlink.MAVLink_mission_clear_all_message(1, 1))
    feed(engine, mavlink.MAVLink_mission_set_current_message(1, 1, 0))
    assert received(engine) == [("ACK", DENIED)] * 4
    assert {event.reason for event in engine.events()} == {"a flight plan is flown"}
    engine.show_instead(None)
    assert engine.items == OLD


@pytest.mark.parametrize(("items", "state"), [(SHOWN.items, mavlink.MISSION_STATE_ACTIVE), ((), 1)])
def test_the_current_item_is_that_of_what_is_shown_instead(items, state):
    engine, message = server(), mavlink.MAVLink_mission_current_message(1, 2)
    engine.show_instead(SHOWN._replace(items=items, current=min(2, len(items))))
    engine.mark(message)
    assert (message.seq, message.total, message.mission_state) == (min(2, len(items)), len(items), state)
    assert message.mission_mode == 1  # in mission mode
    assert (message.mission_id != 0) == bool(items)
    assert engine.current == 1


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
