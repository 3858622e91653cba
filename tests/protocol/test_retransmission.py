"""The clock of every transfer: how long to wait, what to ask for again, when to give up."""

import math

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.engines.retransmission import (
    FIRST,
    LATE,
    LEAST,
    MOST,
    OVERTAKEN,
    SILENCE,
    STALL,
    Partner,
    Resend,
    Window,
    precedes,
)


def beats(count):
    """HEARTBEATs as frames of one vehicle: each with its sequence number."""
    vehicle, ground = Codec(1, 1), Codec(255, 190)
    beat = mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)
    return [ground.decode(vehicle.encode(beat))[0] for _ in range(count)]


def answered(partner, delay, times=20):
    """Questions that are each answered after ``delay``."""
    resend, now = Resend(partner), 0.0
    for _ in range(times):
        resend.start(now)
        while resend.deadline < now + delay:
            resend.retry(resend.deadline)
        now += delay
        resend.answer(now)


@pytest.mark.parametrize(("delay", "wait"), [(0.001, LEAST), (0.5, 0.5), (1.2, 1.2), (5.0, MOST)])
def test_the_wait_follows_the_round_trip_within_its_bounds(delay, wait):
    partner = Partner()
    answered(partner, delay)
    assert partner.timeout == pytest.approx(wait, rel=0.05)


def test_no_wait_is_shorter_than_the_round_trip_once_that_is_known():
    partner, resend = Partner(LEAST), None
    answered(partner, 1.0)
    resend = Resend(partner)
    resend.start(0.0)
    assert resend.deadline > 1.0


def test_the_answer_to_what_was_sent_twice_measures_nothing():
    partner = Partner()
    resend = Resend(partner)
    resend.start(0.0)
    resend.retry(FIRST)
    longer = partner.timeout
    resend.answer(FIRST + 0.01)
    assert partner.timeout == longer > FIRST


def test_the_wait_doubles_with_every_silence_up_to_a_bound():
    partner, waits = Partner(LEAST), []
    resend = Resend(partner)
    resend.start(0.0)
    for _ in range(5):
        waits.append(partner.timeout)
        resend.retry(resend.deadline)
    assert waits == [0.25, 0.5, 1.0, MOST, MOST]


def give_up(heard):
    """When a request without answers is given up, the vehicle being heard every second until ``heard``."""
    partner = Partner()
    resend, frames = Resend(partner), iter(beats(100))
    resend.start(0.0)
    next_beat = 1.0
    while True:
        while next_beat <= min(resend.deadline, heard):
            partner.hear(next(frames), next_beat)
            next_beat += 1.0
        now = resend.deadline
        if not resend.retry(now):
            assert resend.deadline == math.inf
            return now


@pytest.mark.parametrize(("heard", "end"), [(0.0, SILENCE), (5.0, 5.0 + SILENCE), (60.0, STALL)])
def test_a_dead_link_is_given_up_soon_and_a_mute_vehicle_later(heard, end):
    assert end <= give_up(heard) < end + MOST


def test_progress_counts_as_a_sign_of_life():
    resend = Resend(Partner())
    resend.start(0.0)
    resend.wait(8.0)
    assert resend.retry(8.0 + SILENCE - 0.1)
    assert not resend.retry(8.0 + SILENCE)


# Several questions at a time


def test_a_window_keeps_so_many_questions_open_and_no_more():
    window = Window(Partner(), range(8), 3, 0.0)
    assert window.ask(0.0) == [0, 1, 2]
    assert window.ask(0.0) == []
    assert window.take(1, 0.1)
    assert window.ask(0.1) == [3]
    assert list(window.missing) == [0, 2, 3, 4, 5, 6, 7]


def test_a_window_asks_again_for_what_is_late_and_nothing_else():
    window = Window(Partner(), range(3), 3, 0.0)
    window.ask(0.0)
    window.take(1, 0.1)
    assert window.deadline == FIRST
    assert window.ask(FIRST) == [0, 2]


def test_what_three_later_answers_overtook_is_asked_for_again_at_once():
    window = Window(Partner(), range(10), 5, 0.0)
    window.ask(0.0)
    for number in range(1, OVERTAKEN):
        window.take(number, 0.1)
        assert 0 not in window.ask(0.1)
    window.take(OVERTAKEN, 0.1)
    assert window.ask(0.1)[0] == 0
    assert 0 not in window.ask(0.1)


def test_answers_in_order_repeat_nothing_even_if_all_come_at_once():
    window, asked = Window(Partner(), range(50), 5, 0.0), []
    asked += window.ask(0.0)
    for number in range(50):
        assert window.take(number, 0.0)
        asked += window.ask(0.0)
    assert asked == list(range(50))
    assert (window.deadline, list(window.missing)) == (math.inf, [])


def test_what_comes_twice_or_was_never_missing_is_no_progress():
    window = Window(Partner(), range(3), 3, 0.0)
    window.ask(0.0)
    assert window.take(0, 1.0)
    assert not window.take(0, 9.0)
    assert not window.take(7, 9.0)
    assert not window.is_over(1.0 + SILENCE - 0.1)
    assert window.is_over(1.0 + SILENCE)


# The order of frames


@pytest.mark.parametrize(
    ("earlier", "later", "expected"),
    [(1, 2, True), (2, 1, False), (3, 3, False), (255, 0, True), (200, 70, True), (0, 128, False)],
)
def test_sequence_numbers_are_compared_round_the_corner(earlier, later, expected):
    assert precedes(earlier, later) is expected


def test_frames_are_counted_on_beyond_255():
    partner, frames = Partner(), beats(600)
    for frame in frames:
        partner.hear(frame, 0.0)
    assert partner.newest == frames[0].get_seq() + 599
    assert partner.number(frames[-3]) == partner.newest - 2


def test_what_was_said_before_a_moment_is_told_from_what_came_after():
    partner = Partner()
    late, known, after = beats(3)
    assert not partner.said_before(partner.mark(0.0), late, 0.0)
    partner.hear(known, 0.0)
    mark = partner.mark(1.0)
    assert [partner.said_before(mark, frame, 1.5) for frame in (late, known, after)] == [True, True, False]
    assert not partner.said_before(mark, late, 1.0 + LATE)
