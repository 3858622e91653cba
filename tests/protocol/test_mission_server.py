"""The laws of the mission protocol on the vehicle's side."""

import math

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.mission_server import MissionServer, Refusal
from protocol.engines.retransmission import STALL
from protocol.events import CurrentItemRequested, MissionCleared, MissionReceived, MissionRefused
from protocol.plans.mission import MissionItem
from tests.support.link import plan

GROUND, OTHER = Peer(255, 190, "ground"), Peer(245, 190, "other")
OLD = plan(2, offset=500)
ACCEPTED, UNSUPPORTED, NO_SPACE, INVALID_SEQUENCE, DENIED, CANCELLED = 0, 3, 4, 13, 14, 15


def count(n, kind=0):
    return mavlink.MAVLink_mission_count_message(1, 1, n, kind)


def item(seq, items=None):
    return (items or plan(20))[seq].to_message(seq, 1, 1)


def server(items=OLD, refusal=None):
    return MissionServer(1, 1, items, validate=lambda _items: refusal)


def told(engine, peer=GROUND):
    """What went out, in short: ("REQUEST", seq), ("ACK", result), ("COUNT", n), ("ITEM", seq)."""
    short = []
    for out in engine.messages_to_send():
        message = out.message
        assert out.peer == peer
        assert (message.target_system, message.target_component) == peer[:2]
        kind = message.get_type()
        field = {
            "MISSION_REQUEST_INT": "seq",
            "MISSION_ACK": "type",
            "MISSION_COUNT": "count",
            "MISSION_ITEM_INT": "seq",
        }
        short.append((kind.removeprefix("MISSION_").removesuffix("_INT"), getattr(message, field[kind])))
    return short


def numbered(*messages, sender=GROUND):
    """Messages as frames of one sender: each with its sequence number."""
    ground, vehicle = Codec(*sender[:2]), Codec(1, 1)
    return [vehicle.decode(ground.encode(message))[0] for message in messages]


def feed(engine, *messages, peer=GROUND, now=0.0):
    for message in messages:
        engine.receive(message, now, peer)


def test_an_upload_asks_for_every_item_in_order_and_ends_with_one_ack():
    engine, new = server(), plan(3)
    feed(engine, count(3), *[item(n, new) for n in range(3)])
    assert told(engine) == [("REQUEST", 0), ("REQUEST", 1), ("REQUEST", 2), ("ACK", ACCEPTED)]
    assert engine.events() == [MissionReceived(new)]
    assert engine.items == new


def test_the_old_plan_stays_until_the_new_one_is_complete():
    engine = server()
    feed(engine, count(3), item(0), item(1))
    assert engine.items == OLD
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1), peer=OTHER)
    assert engine.messages_to_send()[-1].message.count == 2


def test_an_item_ahead_of_its_turn_is_dropped_and_the_expected_one_asked_for_again():
    engine = server()
    feed(engine, count(3), item(2))
    assert told(engine) == [("REQUEST", 0), ("REQUEST", 0)]
    feed(engine, item(0))
    assert told(engine) == [("REQUEST", 1)]


def test_an_item_that_comes_twice_is_taken_once_and_asks_for_nothing():
    """A request for every repeated item would double the traffic with every repetition."""
    engine = server()
    feed(engine, count(2), item(0), item(0))
    assert told(engine) == [("REQUEST", 0), ("REQUEST", 1)]


def test_a_dropped_item_is_asked_for_again_until_patience_ends_then_the_old_plan_stays():
    engine, times = server(), []
    feed(engine, count(2))
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
        times.append(now)
    assert told(engine) == [("REQUEST", 0)] * 9 + [("ACK", CANCELLED)]
    assert times == pytest.approx([0.25, 0.75, 1.75, 3.25, 4.75, 6.25, 7.75, 9.25, 10.75])
    assert [type(event) for event in engine.events()] == [MissionRefused]
    assert engine.items == OLD
    assert not engine.is_receiving


def test_a_lost_final_ack_is_given_again_when_the_last_item_comes_again():
    engine = server()
    feed(engine, count(2), item(0), item(1), item(1), item(0))
    assert told(engine)[2:] == [("ACK", ACCEPTED)] * 2
    assert len(engine.events()) == 1


def test_a_cancel_by_the_sender_restores_the_old_plan():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED))
    assert engine.items == OLD
    assert engine.next_deadline() == math.inf
    assert [event.result for event in engine.events()] == [CANCELLED]


def test_a_cancelling_sender_gets_no_answer_that_it_could_take_for_one_to_its_next_upload():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED), item(1), item(2))
    assert told(engine) == [("REQUEST", 0), ("REQUEST", 1)]


def test_an_accepting_ack_of_the_sender_cancels_nothing():
    """It ends a download, which needs no state here."""
    engine = server()
    feed(engine, count(2), mavlink.MAVLink_mission_ack_message(1, 1, ACCEPTED))
    assert engine.is_receiving


def test_a_dropped_request_costs_nothing_but_a_repeated_one():
    engine = server()
    feed(engine, count(2))
    engine.handle_timer(engine.next_deadline())
    feed(engine, item(0), now=0.3)
    assert told(engine) == [("REQUEST", 0), ("REQUEST", 0), ("REQUEST", 1)]


def test_a_dropped_count_of_a_download_is_given_again():
    engine = server()
    feed(engine, *[mavlink.MAVLink_mission_request_list_message(1, 1)] * 2)
    assert told(engine) == [("COUNT", 2)] * 2


def test_requests_wait_as_long_as_answers_take():
    """At half a second each way every item is asked for once; 0.25 s would ask four times."""
    engine, now = server(), 0.0
    feed(engine, count(20), now=now)
    for seq in range(20):
        due = now + 1.0
        while engine.next_deadline() < due:
            engine.handle_timer(engine.next_deadline())
        now = due
        feed(engine, item(seq), now=now)
    requests = [seq for what, seq in told(engine) if what == "REQUEST"]
    assert {seq: requests.count(seq) for seq in range(3, 20)} == dict.fromkeys(range(3, 20), 1)


def test_after_a_while_the_items_before_are_asked_for_too_in_order():
    """A sender that a late request set back would ignore a request further on."""
    engine = server()
    feed(engine, count(9), item(0), item(1), item(2))
    engine.messages_to_send()
    asked = []
    for _ in range(4):
        engine.handle_timer(engine.next_deadline())
        asked.append([seq for _, seq in told(engine)])
    assert asked == [[3], [2, 3], [1, 2, 3], [1, 2, 3]]
    feed(engine, item(2), item(3), now=5.0)
    assert told(engine) == [("REQUEST", 4)]


@pytest.mark.parametrize("away", [2.0, 5.0, 8.0])
def test_an_upload_goes_on_where_it_was_when_the_link_was_away(away):
    engine, new = server(), plan(3)
    feed(engine, count(3), item(0))
    while engine.next_deadline() < away:
        engine.handle_timer(engine.next_deadline())
    feed(engine, item(1), item(2), now=away)
    assert engine.items == new


def test_a_sender_that_keeps_sending_the_wrong_item_is_given_up_in_the_end():
    engine, now = server(), 0.0
    feed(engine, count(3), item(0))
    while engine.is_receiving:
        now = engine.next_deadline()
        feed(engine, item(0), now=now)
        engine.handle_timer(now)
    assert now == pytest.approx(STALL, abs=1.5)
    assert engine.items == OLD


def test_a_given_up_upload_is_said_again_to_a_sender_that_goes_on():
    engine = server()
    feed(engine, count(3), item(0))
    while (now := engine.next_deadline()) < math.inf:
        engine.handle_timer(now)
    engine.messages_to_send()
    feed(engine, item(1), now=now)
    assert told(engine) == [("ACK", CANCELLED)]


def test_a_clear_during_an_own_upload_ends_it_with_one_answer():
    engine = server()
    feed(engine, count(3), item(0), mavlink.MAVLink_mission_clear_all_message(1, 1))
    assert told(engine)[2:] == [("ACK", ACCEPTED)]
    assert (engine.items, engine.is_receiving) == ((), False)


def test_an_item_of_another_plan_type_is_no_part_of_an_upload():
    engine, new = server(), plan(2)
    feed(engine, count(2), new[0].to_message(0, 1, 1, kind=1), new[0].to_message(0, 1, 1, kind=255))
    assert told(engine) == [("REQUEST", 0)]


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


def partial(first, last):
    return mavlink.MAVLink_mission_write_partial_list_message(1, 1, first, last)


@pytest.mark.parametrize(("first", "last"), [(0, 0), (1, 2), (0, 3), (3, 3)])
def test_a_partial_write_replaces_its_items_and_no_others(first, last):
    old, new = plan(4), plan(4, 900)
    engine = server(old)
    feed(engine, partial(first, last))
    for seq in range(first, last + 1):
        assert told(engine) == [("REQUEST", seq)]
        assert engine.items == old
        feed(engine, new[seq].to_message(seq, 1, 1))
    assert told(engine) == [("ACK", ACCEPTED)]
    assert engine.items == (*old[:first], *new[first : last + 1], *old[last + 1 :])
    assert engine.events() == [MissionReceived(engine.items)]


def test_a_partial_write_to_one_behind_the_last_item_ends_with_the_last():
    old, new = plan(4), plan(4, 900)
    engine = server(old)
    feed(engine, partial(3, 4), new[3].to_message(3, 1, 1))
    assert told(engine) == [("REQUEST", 3), ("ACK", ACCEPTED)]
    assert engine.items == (*old[:3], new[3])


@pytest.mark.parametrize(("first", "last"), [(2, 2), (1, 3), (1, 0), (-1, 0), (0, -1), (30000, 30000)])
def test_a_partial_write_of_items_that_are_not_there_is_refused(first, last):
    engine = server()
    feed(engine, partial(first, last), item(0))
    assert told(engine) == [("ACK", INVALID_SEQUENCE)]
    assert engine.items == OLD


def test_nothing_can_be_written_into_a_plan_that_is_not_there():
    engine = server(())
    feed(engine, partial(0, 0), item(0))
    assert told(engine) == [("ACK", INVALID_SEQUENCE)]


def test_a_partial_write_is_refused_for_what_the_whole_plan_would_be_then():
    seen = []
    engine = MissionServer(1, 1, OLD, validate=lambda items: seen.append(tuple(items)) or Refusal(UNSUPPORTED, "no"))
    feed(engine, partial(1, 1), item(1))
    assert told(engine)[-1] == ("ACK", UNSUPPORTED)
    assert seen == [(OLD[0], plan(20)[1])]
    assert engine.items == OLD


def test_a_partial_write_that_gets_no_items_is_given_up_and_asks_for_none_before_its_first():
    engine = server(plan(6))
    feed(engine, partial(4, 5))
    while (deadline := engine.next_deadline()) < math.inf:
        engine.handle_timer(deadline)
    asked = told(engine)
    assert set(asked) == {("REQUEST", 4), ("ACK", CANCELLED)}
    assert asked[-1] == ("ACK", CANCELLED)
    assert engine.items == plan(6)


def test_a_partial_write_during_the_upload_of_another_is_denied():
    engine = server()
    feed(engine, count(2))
    told(engine)
    feed(engine, partial(0, 0), peer=OTHER)
    assert told(engine, OTHER) == [("ACK", DENIED)]


def test_items_and_a_cancel_from_before_an_upload_are_no_part_of_it():
    engine, new = server(), plan(2, 900)
    cancel = mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED)
    old, end, opens, *rest = numbered(item(0), cancel, count(2), *[new[n].to_message(n, 1, 1) for n in range(2)])
    feed(engine, opens, old, end, *rest)
    assert engine.items == new


def test_an_item_that_was_reordered_within_its_upload_counts():
    engine, new = server(), plan(2)
    opens, first, beat, second = numbered(count(2), item(0), mavlink.MAVLink_mission_ack_message(1, 1, 0), item(1))
    feed(engine, opens, beat, first, second)
    assert engine.items == new


@pytest.mark.parametrize(
    "late",
    [count(5), mavlink.MAVLink_mission_clear_all_message(1, 1), mavlink.MAVLink_mission_set_current_message(1, 1, 0)],
)
def test_what_later_frames_overtook_begins_nothing_any_more(late):
    engine = server()
    old, opens, first = numbered(late, count(1), item(0))
    feed(engine, opens, first, old)
    assert (engine.items, engine.is_receiving) == (plan(1), False)
    assert told(engine) == [("REQUEST", 0), ("ACK", ACCEPTED)]
    assert [type(event) for event in engine.events()] == [MissionReceived]


def test_a_refused_plan_restores_the_old_one_and_says_why():
    engine = server(refusal=Refusal(10, "latitude"))
    feed(engine, count(1), item(0))
    assert told(engine)[-1] == ("ACK", 10)
    assert engine.events() == [MissionRefused(10, "latitude")]
    assert engine.items == OLD


def test_a_count_that_comes_again_starts_again_from_the_first_item():
    engine = server()
    feed(engine, count(3), item(0), item(1), count(2))
    assert told(engine)[-1] == ("REQUEST", 0)
    feed(engine, item(0), item(1))
    assert engine.items == plan(2)


def test_another_ground_station_is_denied_while_one_uploads():
    engine = server()
    feed(engine, count(2))
    engine.messages_to_send()
    feed(engine, count(5), item(0), mavlink.MAVLink_mission_clear_all_message(1, 1), peer=OTHER)
    assert told(engine, OTHER) == [("ACK", DENIED), ("ACK", DENIED)]
    feed(engine, mavlink.MAVLink_mission_ack_message(1, 1, CANCELLED), peer=OTHER)
    assert engine.is_receiving


def test_a_ground_station_that_changes_its_port_goes_on():
    engine, moved = server(), Peer(255, 190, "new port")
    feed(engine, count(2), item(0))
    engine.messages_to_send()
    feed(engine, item(1), peer=moved)
    assert told(engine, moved) == [("ACK", ACCEPTED)]


@pytest.mark.parametrize("clear", [count(0), mavlink.MAVLink_mission_clear_all_message(1, 1, 0)])
def test_count_zero_clears_as_clear_does(clear):
    engine = server()
    feed(engine, clear)
    assert told(engine) == [("ACK", ACCEPTED)]
    assert engine.events() == [MissionCleared()]
    assert engine.items == ()


def test_clear_of_all_types_clears_the_plan_and_clear_of_a_fence_does_not():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_clear_all_message(1, 1, 1))
    assert engine.items == OLD
    feed(engine, mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
    assert engine.items == ()


def test_a_clear_that_a_later_upload_overtook_clears_nothing():
    """Frames carry sequence numbers: an old one must not undo what came after it."""
    engine, sender, receiver = server(), Codec(255, 190), Codec(1, 1)
    clear = mavlink.MAVLink_mission_clear_all_message(1, 1)
    first, second, *rest = [receiver.decode(sender.encode(m))[0] for m in (clear, clear, count(1), item(0))]
    feed(engine, *rest, first, second)
    assert engine.items == plan(1)


@pytest.mark.parametrize("kind", [1, 2])
def test_fences_and_rally_points_are_answered_politely(kind):
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1, kind), count(3, kind), count(0, kind))
    assert told(engine) == [("COUNT", 0), ("ACK", UNSUPPORTED), ("ACK", ACCEPTED)]
    assert not engine.is_receiving


def test_answers_carry_the_type_that_was_asked_for():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_list_message(1, 1, 2), count(3, 1))
    assert [out.message.mission_type for out in engine.messages_to_send()] == [2, 1]


def test_more_items_than_fit_are_refused_at_once():
    engine = server()
    feed(engine, count(1001))
    assert told(engine) == [("ACK", NO_SPACE)]


def test_five_requests_in_flight_are_answered_one_by_one():
    engine = server(plan(6))
    for seq in (4, 0, 2, 1, 3):
        feed(engine, mavlink.MAVLink_mission_request_int_message(1, 1, seq))
    assert told(engine) == [("ITEM", seq) for seq in (4, 0, 2, 1, 3)]


def test_the_old_request_gets_the_new_item():
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
    assert told(engine) == [("ACK", INVALID_SEQUENCE)] * 2
    assert engine.events() == []


def test_a_current_item_that_exists_is_handed_on():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_set_current_message(1, 1, 1))
    assert engine.events() == [CurrentItemRequested(1)]


def test_a_partial_download_is_unsupported():
    engine = server()
    feed(engine, mavlink.MAVLink_mission_request_partial_list_message(1, 1, 0, 1))
    assert told(engine) == [("ACK", UNSUPPORTED)]


def test_messages_for_others_and_items_nobody_asked_for_change_nothing():
    engine = server()
    feed(
        engine, mavlink.MAVLink_mission_count_message(2, 1, 3), item(0), mavlink.MAVLink_mission_clear_all_message(1, 9)
    )
    assert told(engine) == []
    assert engine.items == OLD


def test_nan_and_minus_zero_come_back_bit_for_bit():
    engine = server()
    odd = MissionItem(16, 3, (math.nan, -0.0, 1e-40, -math.inf), -(2**31), 2**31 - 1, math.nan)
    sender, vehicle, ground = Codec(255, 190), Codec(1, 1), Codec(255, 190)
    for message in (count(1), odd.to_message(0, 1, 1), mavlink.MAVLink_mission_request_int_message(1, 1, 0)):
        feed(engine, *vehicle.decode(sender.encode(message)))
    sent = sender.encode(odd.to_message(0, 255, 190))
    (back,) = ground.decode(vehicle.encode(engine.messages_to_send()[-1].message))
    assert bytes(back.get_msgbuf()[10:38]) == sent[10:38]  # four params, x, y, z
    assert MissionItem.from_message(back) == odd
