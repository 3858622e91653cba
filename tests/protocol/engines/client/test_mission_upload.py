"""The mission client uploads: the vehicle requests items, the client serves them."""

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import REORDER_WINDOW, SILENCE_LIMIT, STALL_LIMIT, Remote
from protocol.engines.client.mission_client import MissionClient
from protocol.errors import LocalProtocolError
from protocol.events import MissionCleared, MissionDownloaded, MissionFailed, MissionProgress, MissionUploaded
from tests.support.links.link import plan
from tests.support.links.mission_client import (
    CANCELLED,
    ERROR,
    HEARTBEAT,
    ITEMS,
    NO_SPACE,
    VEHICLE,
    ack,
    ask,
    count,
    ends,
    exhaust,
    feed,
    hear,
    item,
    numbered,
    sent,
    uploading,
)


def test_an_upload_serves_the_requested_items_and_ends_with_the_ack():
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ack())
    assert sent(client) == [("MISSION_COUNT", None), *[("MISSION_ITEM_INT", n) for n in range(3)]]
    assert client.events() == [*[MissionProgress("upload", n, 3) for n in range(3)], MissionUploaded(3)]
    assert not client.is_busy


def test_the_old_request_message_gets_the_new_item_message():
    client = uploading()
    feed(client, mavlink.MAVLink_mission_request_message(255, 190, 0))
    assert sent(client)[-1] == ("MISSION_ITEM_INT", 0)


def test_a_repeated_request_is_served_again():
    client = uploading()
    feed(client, ask(0), ask(1), ask(0), ask(1), ask(2), ack())
    assert [seq for _, seq in sent(client)[1:]] == [0, 1, 0, 1, 2]
    assert ends(client) == [MissionUploaded(3)]


def test_a_request_beyond_the_end_is_ignored():
    client = uploading()
    feed(client, ask(3))
    assert sent(client) == [("MISSION_COUNT", None)]
    assert client.is_busy


def test_an_ack_before_all_items_were_requested_fails_the_upload():
    client = uploading()
    feed(client, ask(0), ack())
    assert ends(client) == [MissionFailed("upload", None, "accepted before item 1 was requested")]
    last = client.messages_to_send()[-1]
    assert (last.get_type(), last.type) == ("MISSION_ACK", CANCELLED)


def test_an_ack_before_any_request_is_ignored():
    client = uploading()
    feed(client, ack())
    assert client.is_busy


def test_an_upload_of_an_empty_plan_is_a_count_of_zero():
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
def test_unanswered_messages_are_repeated_until_the_timeout(begin, operation):
    client = MissionClient(255, 190)
    begin(client)
    assert exhaust(client) == (6, SILENCE_LIMIT)
    assert ends(client) == [MissionFailed(operation, None, "no answer")]
    assert not client.is_busy


def test_an_item_without_a_next_request_is_repeated():
    client = uploading()
    feed(client, ask(0), ask(1))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_ITEM_INT", 1)]


def test_after_a_lost_ack_the_last_item_is_repeated():
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ask(0))
    client.messages_to_send()
    client.handle_timer(client.next_deadline())
    assert sent(client) == [("MISSION_ITEM_INT", 2)]
    feed(client, ack(), now=2.0)
    assert ends(client) == [MissionUploaded(3)]


def test_an_early_request_is_not_served():
    client = uploading()
    feed(client, ask(0), ask(2))
    assert sent(client) == [("MISSION_COUNT", None), ("MISSION_ITEM_INT", 0)]
    assert client.is_busy


def test_a_silent_vehicle_times_out_before_one_that_does_not_answer():
    remote = Remote()
    client = MissionClient(255, 190, remote)
    client.upload(VEHICLE, ITEMS, 0.0)
    for message in numbered(*[HEARTBEAT] * 60):
        remote.hear(message, client.next_deadline())
        client.handle_timer(client.next_deadline())
        if not client.is_busy:
            break
        last = client.next_deadline()
    assert last == pytest.approx(STALL_LIMIT, abs=1.5)
    assert ends(client) == [MissionFailed("upload", None, "no answer")]


@pytest.mark.parametrize(
    ("begin", "answers", "expected"),
    [
        (lambda c: c.upload(VEHICLE, ITEMS, 0.0), (ask(0), ask(1), ask(2), ack()), MissionUploaded(3)),
        (lambda c: c.download(VEHICLE, 0.0), (count(3), item(0), item(1), item(2)), MissionDownloaded(ITEMS)),
    ],
)
@pytest.mark.parametrize("away", [2.0, 5.0, 8.0])
def test_a_transfer_resumes_after_a_link_outage(begin, answers, expected, away):
    client = MissionClient(255, 190)
    begin(client)
    first, *rest = answers
    feed(client, first, now=0.0)
    while client.next_deadline() < away:
        client.handle_timer(client.next_deadline())
    feed(client, *rest, now=away)
    assert ends(client) == [expected]


def test_an_answer_restarts_the_retry_limit():
    client = uploading()
    for _ in range(4):
        client.handle_timer(client.next_deadline())
    feed(client, ask(0), now=6.0)
    repeated, end = exhaust(client)
    assert repeated == 6
    assert 6.0 + SILENCE_LIMIT <= end < 6.0 + SILENCE_LIMIT + 1.5


def test_a_cancelled_upload_is_cancelled_at_the_vehicle():
    client = uploading()
    feed(client, ask(0))
    client.messages_to_send()
    client.cancel("cancelled")
    (message,) = client.messages_to_send()
    assert (message.get_type(), message.type) == ("MISSION_ACK", CANCELLED)
    assert ends(client) == [MissionFailed("upload", None, "cancelled")]
    client.cancel("again")
    assert client.events() == []


@pytest.mark.parametrize("answers", [(), (ask(0),), (ask(0), ask(1), ask(2))])
def test_an_upload_cancelled_by_the_vehicle_fails(answers):
    client = uploading()
    feed(client, *answers, ack(CANCELLED))
    assert ends(client) == [MissionFailed("upload", CANCELLED, "OPERATION_CANCELLED")]
    assert all(m.get_type() != "MISSION_ACK" for m in client.messages_to_send())


def test_a_request_after_the_end_is_declined():
    client = MissionClient(255, 190)
    feed(client, ask(0))
    (message,) = client.messages_to_send()
    assert (message.get_type(), message.type) == ("MISSION_ACK", CANCELLED)


@pytest.mark.parametrize("late", [ask(2), ack(ERROR), ack(CANCELLED)])
def test_frames_from_before_an_upload_are_ignored(late):
    remote = Remote()
    client = MissionClient(255, 190, remote)
    before, heartbeat, *answers = numbered(late, HEARTBEAT, ask(0), ask(1), ask(2), ack())
    remote.hear(heartbeat, 0.0)
    client.upload(VEHICLE, ITEMS, 0.0)
    hear(client, remote, before)
    assert sent(client) == [("MISSION_COUNT", None)]
    hear(client, remote, *answers)
    assert ends(client) == [MissionUploaded(3)]


def test_old_frames_are_recognised_within_the_reorder_window():
    """A restarted vehicle counts from zero: for a moment all its frames look old."""
    remote = Remote()
    client = MissionClient(255, 190, remote)
    early, *_, newest = numbered(ask(0), *[HEARTBEAT] * 100)
    remote.hear(newest, 0.0)
    client.upload(VEHICLE, ITEMS, 0.0)
    hear(client, remote, early, now=REORDER_WINDOW)
    assert ("MISSION_ITEM_INT", 0) in sent(client)


def test_an_ack_with_the_id_of_the_plan_before_is_ignored():
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


def test_the_ack_of_an_earlier_clear_does_not_end_an_upload():
    """A vehicle that sends plan ids sends one for every plan."""
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
    remote = Remote()
    client = MissionClient(255, 190, remote)
    client.upload(VEHICLE, ITEMS[:1], 0.0)
    early, request, last = numbered(ack(), ask(0), ack())
    hear(client, remote, request, early)
    assert client.is_busy
    hear(client, remote, last)
    assert ends(client) == [MissionUploaded(1)]


def test_acks_without_plan_ids_are_accepted():
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


def test_single_items_are_written_and_no_others_served():
    client = MissionClient(255, 190)
    client.write_items(VEHICLE, ITEMS, range(1, 2), 0.0)
    feed(client, ask(0), ask(2), ask(1), ack())
    assert sent(client) == [("MISSION_WRITE_PARTIAL_LIST", None), ("MISSION_ITEM_INT", 1)]
    assert ends(client) == [MissionUploaded(1, is_partial=True)]


def test_a_refused_write_of_single_items_fails():
    client = MissionClient(255, 190)
    client.write_items(VEHICLE, ITEMS, range(1, 2), 0.0)
    feed(client, ack(ERROR))
    assert ends(client) == [MissionFailed("upload", ERROR, "ERROR")]


@pytest.mark.parametrize("changed", [range(0), range(2, 4), range(-1, 1)])
def test_items_that_there_are_not_cannot_be_written(changed):
    client = MissionClient(255, 190)
    with pytest.raises(LocalProtocolError, match="cannot be written"):
        client.write_items(VEHICLE, ITEMS, changed, 0.0)
    assert not client.is_busy


def test_the_first_item_can_be_written_alone():
    client = MissionClient(255, 190)
    client.write_items(VEHICLE, ITEMS, range(1), 0.0)
    feed(client, ask(0), ack())
    assert sent(client) == [("MISSION_WRITE_PARTIAL_LIST", None), ("MISSION_ITEM_INT", 0)]
    assert ends(client) == [MissionUploaded(1, is_partial=True)]


@pytest.mark.parametrize(("age", "is_over"), [(4.99, False), (5.0, True)])
def test_an_early_ack_may_belong_to_the_operation_before_for_five_seconds(age, is_over):
    client = uploading()
    feed(client, ask(0), ask(1), ask(2), ack())
    client.upload(VEHICLE, ITEMS, 8.0)
    feed(client, ask(0), ack(), now=8.0 + age)
    assert client.is_busy != is_over
