"""Plan messages that arrive after later ones of their sender, at the limits of what the mission server remembers."""

import pytest

from protocol.dialect import mavlink
from protocol.events import MissionCleared
from protocol.wire.codec import Codec
from protocol.wire.message import Peer
from tests.support.links.mission_server import GROUND, feed, numbered, received, server

CLEAR = mavlink.MAVLink_mission_clear_all_message(1, 1, 0)
LIST = mavlink.MAVLink_mission_request_list_message(1, 1, 0)


def clears(engine):
    """Whether the plan was cleared since the last look."""
    return MissionCleared() in engine.events()


@pytest.mark.parametrize(("age", "cleared"), [(0.0, False), (1.99, False), (2.0, True)])
def test_a_frame_counts_as_late_for_two_seconds(age, cleared):
    engine = server()
    earlier, later = numbered(CLEAR, LIST)
    feed(engine, later, now=10.0)
    feed(engine, earlier, now=10.0 + age)
    assert clears(engine) == cleared


@pytest.mark.parametrize(("number", "cleared"), [(0, False), (127, False), (128, True), (200, True)])
def test_a_frame_counts_as_late_up_to_half_the_range_of_sequence_numbers(number, cleared):
    """Sent so many frames before: from 128 on it is taken for a later one."""
    engine, codec = server(), Codec(255, 190)
    codec.sequence = 250
    (newest,) = Codec(1, 1).decode(codec.encode(LIST))
    codec.sequence = (250 - number) & 0xFF
    (late,) = Codec(1, 1).decode(codec.encode(CLEAR))
    feed(engine, newest)
    feed(engine, late)
    assert clears(engine) == (cleared or number == 0)  # the same number is a repetition, not an earlier frame


def test_of_65_senders_the_one_that_was_silent_longest_is_forgotten():
    """The first one is heard again before the last: the second one is forgotten in its place."""
    engine = server()
    senders = [Peer(system, 190, "ground") for system in range(1, 66)]
    frames = {sender: numbered(CLEAR, LIST, LIST, sender=sender) for sender in senders}
    for sender in senders[:64]:
        feed(engine, frames[sender][1], peer=sender)
    feed(engine, frames[senders[0]][2], peer=senders[0])
    feed(engine, frames[senders[64]][1], peer=senders[64])
    feed(engine, frames[senders[0]][0], peer=senders[0])
    feed(engine, frames[senders[2]][0], peer=senders[2])
    assert not clears(engine)
    feed(engine, frames[senders[1]][0], peer=senders[1])
    assert clears(engine)


def test_a_sender_is_the_same_at_another_address():
    engine = server()
    earlier, later = numbered(CLEAR, LIST)
    feed(engine, later, peer=GROUND)
    feed(engine, earlier, peer=GROUND._replace(key="moved"))
    assert not clears(engine)


@pytest.mark.parametrize(("seq", "answer"), [(1, [("ITEM", 1)]), (2, [])])
def test_a_late_request_for_an_item_that_is_not_there_any_more_is_ignored(seq, answer):
    engine = server()
    request = mavlink.MAVLink_mission_request_int_message(1, 1, seq)
    late, newest = numbered(request, LIST)
    feed(engine, newest)
    engine.messages_to_send()
    feed(engine, late)
    assert received(engine) == answer
