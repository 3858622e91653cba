"""Recognition of repeated commands by the command server: by age, sequence and confirmation."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.command_server import CommandServer
from protocol.events import CommandRequested
from protocol.wire.codec import Codec
from protocol.wire.message import Peer

ARM, REPOSITION, ACCEPTED = 400, 192, 0
GROUND = Peer(255, 190, "ground")


def long(confirmation=0, p1=1.0):
    return mavlink.MAVLink_command_long_message(1, 1, ARM, confirmation, p1, *[math.nan] * 6)


def integer(x=5):
    return mavlink.MAVLink_command_int_message(1, 1, 0, REPOSITION, 0, 0, -1, 1, 0, math.nan, x, 7, 160.0)


class Requests:
    """A server that accepts every request at once, and counts them."""

    def __init__(self):
        self.server = CommandServer(1, 1, {ARM, REPOSITION})

    def executes(self, message, now, sequence):
        """Whether the message is executed; it is answered once in any case."""
        codec = Codec(255, 190)
        codec.sequence = sequence
        (received,) = Codec(1, 1).decode(codec.encode(message))
        self.server.receive(received, now, GROUND)
        requested = [event for event in self.server.events() if isinstance(event, CommandRequested)]
        for event in requested:
            self.server.acknowledge(event.request, ACCEPTED, now)
        assert len(self.server.messages_to_send()) == 1
        return len(requested) == 1


@pytest.fixture
def requests():
    made = Requests()
    assert made.executes(long(), 10.0, 250)
    return made


@pytest.mark.parametrize(("age", "is_new"), [(0.49, False), (0.5, True)])
def test_the_same_frame_within_half_a_second_is_the_same_request(requests, age, is_new):
    assert requests.executes(long(), 10.0 + age, 250) == is_new


@pytest.mark.parametrize(("age", "is_new"), [(1.99, False), (2.0, True)])
@pytest.mark.parametrize("sequence", [249, 123])
def test_an_earlier_frame_within_two_seconds_is_late(requests, age, is_new, sequence):
    assert requests.executes(long(), 10.0 + age, sequence) == is_new


@pytest.mark.parametrize("sequence", [251, 0, 122])
def test_a_later_frame_without_confirmation_is_a_new_request(requests, sequence):
    assert requests.executes(long(), 10.1, sequence)


@pytest.mark.parametrize(
    ("confirmation", "age", "is_new"), [(1, 2.99, False), (1, 3.0, True), (2, 4.49, False), (2, 4.5, True)]
)
def test_a_confirmation_counts_for_one_and_a_half_seconds_and_as_long_for_each_that_was_lost(
    requests, confirmation, age, is_new
):
    assert requests.executes(long(confirmation), 10.0 + age, 251) == is_new


def test_confirmations_are_counted_from_the_last_one_that_came(requests):
    for confirmation in (1, 2, 3):
        assert not requests.executes(long(confirmation), 10.0 + confirmation, 250 + confirmation)
    assert requests.executes(long(4), 16.1, 254)


@pytest.mark.parametrize("repetition", [4, 120])
def test_what_was_sent_before_the_last_repetition_is_late_wherever_the_numbers_wrap(requests, repetition):
    assert not requests.executes(long(1), 10.5, repetition)
    assert not requests.executes(long(), 10.6, repetition - 2)
    assert requests.executes(long(), 10.7, repetition + 2)


def test_a_repetition_that_seems_half_the_range_ahead_is_not_taken_for_newer(requests):
    assert not requests.executes(long(1), 10.5, (250 + 128) % 256)
    assert requests.executes(long(), 10.6, 260 % 256)


@pytest.mark.parametrize(("age", "is_new"), [(1.49, False), (1.5, True)])
def test_a_command_int_is_repeated_within_one_and_a_half_seconds(requests, age, is_new):
    assert requests.executes(integer(), 20.0, 1)
    assert requests.executes(integer(), 20.0 + age, 2) == is_new


def test_answers_are_remembered_for_thirty_seconds(requests):
    requests.executes(long(p1=0.0), 40.0, 251)
    assert len(requests.server._records) == 2
    requests.executes(long(p1=0.0), 40.1, 252)
    assert len(requests.server._records) == 1


@pytest.mark.parametrize(("others", "is_new"), [(254, False), (255, True)])
def test_the_256th_answer_makes_room_for_the_next_message_by_the_oldest_one(others, is_new):
    requests = Requests()
    for number in range(others + 1):
        assert requests.executes(long(p1=float(number)), 10.0, number % 256)
    assert requests.executes(long(1, p1=0.0), 10.1, (others + 1) % 256) == is_new
