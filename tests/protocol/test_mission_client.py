"""The laws of the mission protocol on the ground station's side."""

import math

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.mission_client import ASKED_AT_ONCE, MissionClient
from protocol.engines.retransmission import LATE, SILENCE, STALL, Partner
from protocol.errors import LocalProtocolError
from protocol.events import (
    CurrentItemSet,
    MissionCleared,
    MissionDownloaded,
    MissionFailed,
    MissionProgress,
    MissionUploaded,
)
from tests.support.link import plan

VEHICLE = (1, 1)
ITEMS = plan(3)
ACCEPTED, ERROR, NO_SPACE, INVALID_SEQUENCE, CANCELLED = 0, 1, 4, 13, 15


def ask(seq, kind=0):
    return mavlink.MAVLink_mission_request_int_message(255, 190, seq, kind)


def ack(result=ACCEPTED, kind=0, opaque_id=0):
    return mavlink.MAVLink_mission_ack_message(255, 190, result, kind, opaque_id)


def count(n, opaque_id=0):
    return mavlink.MAVLink_mission_count_message(255, 190, n, 0, opaque_id)


def item(seq):
    return ITEMS[seq].to_message(seq, 255, 190)


def current(seq):
    return mavlink.MAVLink_mission_current_message(seq)


def uploading():
    client = MissionClient(255, 190)
    client.upload(VEHICLE, ITEMS, 0.0)
    return client


def downloading():
    client = MissionClient(255, 190)
    client.download(VEHICLE, 0.0)
    return client


def feed(client, *messages, now=0.1):
    for message in messages:
        client.receive(message, now)


def numbered(*messages):
    """Messages as a vehicle's frames: each with its sequence number."""
    vehicle, ground = Codec(*VEHICLE), Codec(255, 190)
    return [ground.decode(vehicle.encode(message))[0] for message in messages]


def hear(client, partner, *messages, now=0.1):
    """Frames as an endpoint hands them in."""
    for message in messages:
        partner.hear(message, now)
        client.receive(message, now)


HEARTBEAT = mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)


def sent(client):
    return [(m.get_type(), getattr(m, "seq", None)) for m in client.messages_to_send()]


def ends(client):
    return [event for event in client.events() if not isinstance(event, MissionProgress)]


def exhaust(client):
    """Let all patience run out; how often something was sent again, and when it ended."""
    client.messages_to_send()
    while (now := client.next_deadline()) < math.inf:
        client.handle_timer(now)
        last = now
    return len([m for m in client.messages_to_send() if m.get_type() != "MISSION_ACK"]), last


def test_an_upload_serves_what_is_asked_for_and_ends_with_the_ack():
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ack())
    assert sent(client) == [("MISSION_COUNT", None), *[("MISSION_ITEM_INT", n) for n in range(3)]]
    assert client.events() == [*[MissionProgress("upload", n, 3) for n in range(3)], MissionUploaded(3)]
    assert not client.is_busy


def test_the_old_request_is_served_with_the_new_item():
    client = uploading()
    feed(client, mavlink.MAVLink_mission_request_message(255, 190, 0))
    assert sent(client)[-1] == ("MISSION_ITEM_INT", 0)


def test_an_item_asked_for_again_is_served_again():
    client = uploading()
    feed(client, ask(0), ask(1), ask(0), ask(1), ask(2), ack())
    assert [seq for _, seq in sent(client)[1:]] == [0, 1, 0, 1, 2]
    assert ends(client) == [MissionUploaded(3)]


def test_a_request_beyond_the_end_is_ignored():
    client = uploading()
    feed(client, ask(3))
    assert sent(client) == [("MISSION_COUNT", None)]
    assert client.is_busy


def test_an_ack_before_all_items_were_asked_for_fails_and_cancels():
    client = uploading()
    feed(client, ask(0), ack())
    assert ends(client) == [MissionFailed("upload", None, "accepted before item 1 was asked for")]
    last = client.messages_to_send()[-1]
    assert (last.get_type(), last.type) == ("MISSION_ACK", CANCELLED)


def test_an_ack_before_any_request_belongs_to_something_earlier():
    client = uploading()
    feed(client, ack())
    assert client.is_busy


def test_an_upload_of_nothing_is_a_count_of_zero():
    client = MissionClient(255, 190)
    client.upload(VEHICLE, (), 0.0)
    feed(client, ack())
    assert ends(client) == [MissionUploaded(0)]


@pytest.mark.parametrize(("result", "name"), [(NO_SPACE, "NO_SPACE"), (99, "MAV_MISSION_RESULT 99")])
def test_an_error_ack_fails_with_its_result(result, name):
    client = uploading()
    feed(client, ask(0), ack(result))
    assert ends(client) == [MissionFailed("upload", result, name)]


@pytest.mark.parametrize(
    ("begin", "operation"),
    [
        (lambda c: c.upload(VEHICLE, ITEMS, 0.0), "upload"),
        (lambda c: c.download(VEHICLE, 0.0), "download"),
        (lambda c: c.clear(VEHICLE, 0.0), "clear"),
        (lambda c: c.set_current(VEHICLE, 1, 0.0), "set_current"),
    ],
)
def test_silence_repeats_then_gives_up(begin, operation):
    client = MissionClient(255, 190)
    begin(client)
    assert exhaust(client) == (6, SILENCE)
    assert ends(client) == [MissionFailed(operation, None, "no answer")]
    assert not client.is_busy


def test_silence_after_an_item_repeats_that_item():
    client = uploading()
    feed(client, ask(0), ask(1))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_ITEM_INT", 1)]


def test_a_dropped_ack_is_asked_for_with_the_last_item_whatever_else_was_asked_for_late():
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ask(0))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_ITEM_INT", 2)]
    feed(client, ack(), now=2.0)
    assert ends(client) == [MissionUploaded(3)]


def test_an_item_whose_turn_has_not_come_is_not_served():
    client = uploading()
    feed(client, ask(0), ask(2))
    assert sent(client) == [("MISSION_COUNT", None), ("MISSION_ITEM_INT", 0)]
    assert client.is_busy


def test_a_vehicle_that_is_heard_but_does_not_answer_is_given_up_later_than_a_silent_one():
    partner = Partner()
    client = MissionClient(255, 190, partner)
    client.upload(VEHICLE, ITEMS, 0.0)
    for message in numbered(*[HEARTBEAT] * 60):
        partner.hear(message, client.next_deadline())
        client.handle_timer(client.next_deadline())
        if not client.is_busy:
            break
        last = client.next_deadline()
    assert last == pytest.approx(STALL, abs=1.5)
    assert ends(client) == [MissionFailed("upload", None, "no answer")]


@pytest.mark.parametrize(
    ("begin", "answers", "expected"),
    [
        (lambda c: c.upload(VEHICLE, ITEMS, 0.0), (ask(0), ask(1), ask(2), ack()), MissionUploaded(3)),
        (lambda c: c.download(VEHICLE, 0.0), (count(3), item(0), item(1), item(2)), MissionDownloaded(ITEMS)),
    ],
)
@pytest.mark.parametrize("away", [2.0, 5.0, 8.0])
def test_a_transfer_goes_on_where_it_was_when_the_link_was_away(begin, answers, expected, away):
    client = MissionClient(255, 190)
    begin(client)
    first, *rest = answers
    feed(client, first, now=0.0)
    while client.next_deadline() < away:
        client.handle_timer(client.next_deadline())
    feed(client, *rest, now=away)
    assert ends(client) == [expected]


def test_an_answer_after_a_silence_goes_on_with_full_patience():
    client = uploading()
    for _ in range(4):
        client.handle_timer(client.next_deadline())
    feed(client, ask(0), now=6.0)
    repeated, end = exhaust(client)
    assert repeated == 6
    assert 6.0 + SILENCE <= end < 6.0 + SILENCE + 1.5


def test_a_cancelled_upload_tells_the_vehicle():
    client = uploading()
    feed(client, ask(0))
    client.messages_to_send()
    client.cancel("cancelled")
    (message,) = client.messages_to_send()
    assert (message.get_type(), message.type) == ("MISSION_ACK", CANCELLED)
    assert ends(client) == [MissionFailed("upload", None, "cancelled")]
    client.cancel("again")
    assert client.events() == []


def test_a_cancelled_download_tells_the_vehicle():
    client = downloading()
    feed(client, count(3), item(0))
    client.messages_to_send()
    client.cancel("cancelled")
    assert [(m.get_type(), m.type) for m in client.messages_to_send()] == [("MISSION_ACK", CANCELLED)]
    assert client.next_deadline() == math.inf


@pytest.mark.parametrize("answers", [(), (ask(0),), (ask(0), ask(1), ask(2))])
def test_an_upload_the_vehicle_cancels_fails_and_says_so(answers):
    client = uploading()
    feed(client, *answers, ack(CANCELLED))
    assert ends(client) == [MissionFailed("upload", CANCELLED, "OPERATION_CANCELLED")]
    assert all(m.get_type() != "MISSION_ACK" for m in client.messages_to_send())


def test_a_request_after_the_end_is_declined_so_that_the_vehicle_stops_asking():
    client = MissionClient(255, 190)
    feed(client, ask(0))
    (message,) = client.messages_to_send()
    assert (message.get_type(), message.type) == ("MISSION_ACK", CANCELLED)


def test_a_download_fetches_item_by_item_and_thanks():
    client = downloading()
    feed(client, count(3), item(0), item(1), item(2))
    assert sent(client) == [
        ("MISSION_REQUEST_LIST", None),
        *[("MISSION_REQUEST_INT", n) for n in range(3)],
        ("MISSION_ACK", None),
    ]
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_a_download_of_nothing_ends_at_once():
    client = downloading()
    feed(client, count(0))
    assert ends(client) == [MissionDownloaded(())]


def test_a_dropped_item_is_asked_for_again_and_no_other():
    client = downloading()
    feed(client, count(3), item(0), item(2))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_REQUEST_INT", 1)]
    feed(client, item(1), now=1.0)
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_a_few_items_are_asked_for_at_a_time_and_one_more_for_each_that_comes():
    client, items = downloading(), plan(20)
    feed(client, count(20))
    assert sent(client)[1:] == [("MISSION_REQUEST_INT", n) for n in range(ASKED_AT_ONCE)]
    feed(client, items[2].to_message(2, 255, 190))
    assert sent(client) == [("MISSION_REQUEST_INT", ASKED_AT_ONCE)]


def test_an_item_that_three_later_ones_overtook_is_asked_for_again_without_waiting():
    client, items = downloading(), plan(20)
    feed(client, count(20))
    client.messages_to_send()
    feed(client, *[items[n].to_message(n, 255, 190) for n in (1, 2)])
    assert ("MISSION_REQUEST_INT", 0) not in sent(client)
    feed(client, items[3].to_message(3, 255, 190))
    assert ("MISSION_REQUEST_INT", 0) in sent(client)


def test_a_vehicle_that_refuses_requests_out_of_order_is_asked_one_by_one():
    client = downloading()
    feed(client, count(3), item(1), ack(INVALID_SEQUENCE))
    client.messages_to_send()
    assert ends(client) == []
    feed(client, count(3), item(0))
    assert sent(client) == [("MISSION_REQUEST_INT", 0), ("MISSION_REQUEST_INT", 1)]
    feed(client, item(1), item(2))
    assert ends(client) == [MissionDownloaded(ITEMS)]


def test_items_out_of_turn_and_twice_are_dropped():
    client = downloading()
    feed(client, count(3), item(2), item(0), item(0), item(1), count(3), item(2), item(2))
    assert ends(client) == [MissionDownloaded(ITEMS)]


@pytest.mark.parametrize("before", [count(2, 5), count(2, 0), count(3, 4)])
def test_a_plan_that_changes_under_way_is_fetched_from_the_start(before):
    """Another number of items, or as many with another id."""
    client = downloading()
    feed(client, before, item(0), count(3, 5), item(0), count(3, 5), item(1), item(2))
    assert ends(client)[-1] == MissionDownloaded(ITEMS)
    assert sent(client).count(("MISSION_REQUEST_INT", 0)) == 2


def test_an_accepting_ack_during_a_download_belongs_to_something_earlier():
    client = downloading()
    feed(client, ack(), count(3), ack(), item(0))
    assert client.is_busy


def test_a_vehicle_that_refuses_every_request_fails_the_download():
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


def test_the_current_item_is_set_when_the_vehicle_says_so_and_not_before():
    client = MissionClient(255, 190)
    client.set_current(VEHICLE, 2, 0.0)
    feed(client, current(0), current(1))
    assert client.is_busy
    feed(client, current(2))
    assert ends(client) == [CurrentItemSet(2)]


def test_messages_of_other_plan_types_and_for_others_change_nothing():
    client = uploading()
    client.messages_to_send()
    feed(client, ask(0, kind=1), ack(ERROR, kind=2), mavlink.MAVLink_mission_ack_message(245, 190, ERROR))
    assert (sent(client), client.events()) == ([], [])


def test_items_of_another_plan_type_are_no_part_of_a_download():
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


@pytest.mark.parametrize("late", [ask(2), ack(ERROR), ack(CANCELLED)])
def test_what_the_vehicle_said_before_an_upload_began_is_no_part_of_it(late):
    partner = Partner()
    client = MissionClient(255, 190, partner)
    before, heartbeat, *answers = numbered(late, HEARTBEAT, ask(0), ask(1), ask(2), ack())
    partner.hear(heartbeat, 0.0)
    client.upload(VEHICLE, ITEMS, 0.0)
    hear(client, partner, before)
    assert sent(client) == [("MISSION_COUNT", None)]
    hear(client, partner, *answers)
    assert ends(client) == [MissionUploaded(3)]


def test_items_of_an_earlier_download_are_no_part_of_a_later_one():
    partner, new = Partner(), plan(3, 700)
    client = MissionClient(255, 190, partner)
    fresh = [new[n].to_message(n, 255, 190) for n in range(3)]
    old, heartbeat, told, *rest = numbered(item(0), HEARTBEAT, count(3), *fresh)
    hear(client, partner, heartbeat)
    client.download(VEHICLE, 0.1)
    hear(client, partner, told, old, *rest)
    assert ends(client) == [MissionDownloaded(new)]


def test_frames_are_told_old_from_new_only_as_long_as_they_may_be_late():
    """A vehicle that was restarted counts from zero: for a moment all it says looks old."""
    partner = Partner()
    client = MissionClient(255, 190, partner)
    early, *_, newest = numbered(ask(0), *[HEARTBEAT] * 100)
    partner.hear(newest, 0.0)
    client.upload(VEHICLE, ITEMS, 0.0)
    hear(client, partner, early, now=LATE)
    assert ("MISSION_ITEM_INT", 0) in sent(client)


def test_an_ack_with_the_id_of_the_plan_before_is_late():
    client, other = uploading(), plan(3, 700)
    feed(client, ask(0), ask(1), ask(2), ack(opaque_id=5))
    client.upload(VEHICLE, other, 1.0)
    feed(client, ask(0), ask(1), ack(opaque_id=5), ask(2), ack(opaque_id=5), now=1.1)
    assert ends(client) == [MissionUploaded(3)]
    feed(client, ack(opaque_id=6), now=1.2)
    client.clear(VEHICLE, 2.0)
    feed(client, ack(opaque_id=6), now=2.1)
    assert client.is_busy
    feed(client, ack(), now=2.2)
    assert ends(client) == [MissionUploaded(3), MissionCleared()]


def test_the_ack_of_an_earlier_clear_is_not_taken_for_that_of_an_upload():
    """A vehicle that gives ids gives one to every plan there is."""
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ack(opaque_id=5))
    client.clear(VEHICLE, 1.0)
    feed(client, ack(), now=1.1)
    client.upload(VEHICLE, ITEMS, 2.0)
    feed(client, ask(0), ack(), ask(1), ask(2), ack(), now=2.1)
    assert client.is_busy
    feed(client, ack(opaque_id=5), now=2.2)
    assert ends(client) == [MissionUploaded(3), MissionCleared(), MissionUploaded(3)]


def test_an_ack_from_before_the_last_request_does_not_end_an_upload():
    partner = Partner()
    client = MissionClient(255, 190, partner)
    client.upload(VEHICLE, ITEMS[:1], 0.0)
    early, request, last = numbered(ack(), ask(0), ack())
    hear(client, partner, request, early)
    assert client.is_busy
    hear(client, partner, last)
    assert ends(client) == [MissionUploaded(1)]


def test_a_vehicle_without_ids_is_believed():
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ack())
    client.clear(VEHICLE, 0.2)
    feed(client, ack(), now=0.3)
    client.upload(VEHICLE, ITEMS[:1], 0.3)
    feed(client, ask(0), ack(), now=0.4)
    assert ends(client) == [MissionUploaded(3), MissionCleared(), MissionUploaded(1)]


def test_the_same_plan_uploaded_again_has_the_same_id():
    client = uploading()
    for now in (1.0, 2.0):
        feed(client, ask(0), ask(1), ask(2), ack(opaque_id=5), now=now)
        assert ends(client) == [MissionUploaded(3)]
        client.upload(VEHICLE, ITEMS, now)


def test_one_operation_at_a_time():
    client = uploading()
    for begin in (lambda: client.clear(VEHICLE, 0.0), lambda: client.download(VEHICLE, 0.0)):
        with pytest.raises(LocalProtocolError, match="announcing"):
            begin()


@pytest.mark.parametrize(
    "begin", [lambda c: c.upload(VEHICLE, [ITEMS[0]] * 65536, 0.0), lambda c: c.set_current(VEHICLE, -1, 0.0)]
)
def test_numbers_the_wire_has_not_are_refused(begin):
    client = MissionClient(255, 190)
    with pytest.raises(LocalProtocolError):
        begin(client)
    assert not client.is_busy
