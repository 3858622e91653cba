"""Base of all engines: retransmission timers, round-trip times, and what is marked as sent."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import (
    INITIAL_TIMEOUT,
    LOSS_THRESHOLD,
    MAX_TIMEOUT,
    MIN_TIMEOUT,
    REORDER_WINDOW,
    SILENCE_LIMIT,
    STALL_LIMIT,
    Remote,
    RequestWindow,
    Retransmission,
    RetryPolicy,
    precedes,
)
from protocol.wire.codec import Codec


def beats(count):
    """HEARTBEATs of one vehicle with their sequence numbers."""
    vehicle, ground = Codec(1, 1), Codec(255, 190)
    beat = mavlink.MAVLink_heartbeat_message(19, 12, 0, 0, 4, 3)
    return [ground.decode(vehicle.encode(beat))[0] for _ in range(count)]


def answered(remote, delay, times=20):
    """Send messages that are each answered after ``delay``."""
    resend, now = Retransmission(remote), 0.0
    for _ in range(times):
        resend.start(now)
        while resend.deadline < now + delay:
            resend.retry(resend.deadline)
        now += delay
        resend.answer(now)


@pytest.mark.parametrize(("delay", "wait"), [(0.001, MIN_TIMEOUT), (0.5, 0.5), (1.2, 1.2), (5.0, MAX_TIMEOUT)])
def test_the_timeout_follows_the_round_trip_within_its_bounds(delay, wait):
    remote = Remote()
    answered(remote, delay)
    assert remote.rtt.timeout == pytest.approx(wait, rel=0.05)


def test_the_timeout_is_longer_than_a_known_round_trip():
    remote, resend = Remote(MIN_TIMEOUT), None
    answered(remote, 1.0)
    resend = Retransmission(remote)
    resend.start(0.0)
    assert resend.deadline > 1.0


def test_the_answer_to_a_repeated_message_is_not_measured():
    remote = Remote()
    resend = Retransmission(remote)
    resend.start(0.0)
    resend.retry(INITIAL_TIMEOUT)
    longer = remote.rtt.timeout
    resend.answer(INITIAL_TIMEOUT + 0.01)
    assert remote.rtt.timeout == longer > INITIAL_TIMEOUT


def test_the_timeout_doubles_with_every_miss_up_to_its_maximum():
    remote, waits = Remote(MIN_TIMEOUT), []
    resend = Retransmission(remote)
    resend.start(0.0)
    for _ in range(5):
        waits.append(remote.rtt.timeout)
        resend.retry(resend.deadline)
    assert waits == [0.25, 0.5, 1.0, MAX_TIMEOUT, MAX_TIMEOUT]


def give_up(heard):
    """The time at which an unanswered request fails if the vehicle is heard every second until ``heard``."""
    remote = Remote()
    resend, frames = Retransmission(remote), iter(beats(100))
    resend.start(0.0)
    next_beat = 1.0
    while True:
        while next_beat <= min(resend.deadline, heard):
            remote.hear(next(frames), next_beat)
            next_beat += 1.0
        now = resend.deadline
        if not resend.retry(now):
            assert resend.deadline == math.inf
            return now


@pytest.mark.parametrize(("heard", "end"), [(0.0, SILENCE_LIMIT), (5.0, 5.0 + SILENCE_LIMIT), (60.0, STALL_LIMIT)])
def test_a_dead_link_times_out_before_a_vehicle_that_does_not_answer(heard, end):
    assert end <= give_up(heard) < end + MAX_TIMEOUT


def test_progress_counts_as_a_sign_of_life():
    resend = Retransmission(Remote())
    resend.start(0.0)
    resend.wait(8.0)
    assert resend.retry(8.0 + SILENCE_LIMIT - 0.1)
    assert not resend.retry(8.0 + SILENCE_LIMIT)


# Several requests at a time


def test_a_window_limits_the_number_of_open_requests():
    window = RequestWindow(Remote(), range(8), 3, 0.0)
    assert window.ask(0.0) == [0, 1, 2]
    assert window.ask(0.0) == []
    assert window.take(1, 0.1)
    assert window.ask(0.1) == [3]
    assert list(window.missing) == [0, 2, 3, 4, 5, 6, 7]


def test_a_window_repeats_only_late_requests():
    window = RequestWindow(Remote(), range(3), 3, 0.0)
    window.ask(0.0)
    window.take(1, 0.1)
    assert window.deadline == INITIAL_TIMEOUT
    assert window.ask(INITIAL_TIMEOUT) == [0, 2]


def test_a_request_overtaken_by_three_answers_is_repeated_at_once():
    window = RequestWindow(Remote(), range(10), 5, 0.0)
    window.ask(0.0)
    for number in range(1, LOSS_THRESHOLD):
        window.take(number, 0.1)
        assert 0 not in window.ask(0.1)
    window.take(LOSS_THRESHOLD, 0.1)
    assert window.ask(0.1)[0] == 0
    assert 0 not in window.ask(0.1)


def test_answers_in_order_cause_no_repetition():
    window, asked = RequestWindow(Remote(), range(50), 5, 0.0), []
    asked += window.ask(0.0)
    for number in range(50):
        assert window.take(number, 0.0)
        asked += window.ask(0.0)
    assert asked == list(range(50))
    assert (window.deadline, list(window.missing)) == (math.inf, [])


def test_duplicate_and_unrequested_parts_are_not_progress():
    window = RequestWindow(Remote(), range(3), 3, 0.0)
    window.ask(0.0)
    assert window.take(0, 1.0)
    assert not window.take(0, 9.0)
    assert not window.take(7, 9.0)
    assert not window.is_over(1.0 + SILENCE_LIMIT - 0.1)
    assert window.is_over(1.0 + SILENCE_LIMIT)


# The order of frames


@pytest.mark.parametrize(
    ("earlier", "later", "expected"),
    [(1, 2, True), (2, 1, False), (3, 3, False), (255, 0, True), (200, 70, True), (0, 128, False)],
)
def test_sequence_numbers_are_compared_across_their_wrap(earlier, later, expected):
    assert precedes(earlier, later) is expected


def test_frame_numbers_continue_beyond_255():
    remote, frames = Remote(), beats(600)
    for frame in frames:
        remote.hear(frame, 0.0)
    assert remote.newest == frames[0].get_seq() + 599
    assert remote.number(frames[-3]) == remote.newest - 2


def test_frames_from_before_a_mark_are_recognised():
    remote = Remote()
    late, known, after = beats(3)
    assert not remote.was_sent_before(remote.mark(0.0), late, 0.0)
    remote.hear(known, 0.0)
    mark = remote.mark(1.0)
    assert [remote.was_sent_before(mark, frame, 1.5) for frame in (late, known, after)] == [True, True, False]
    assert not remote.was_sent_before(mark, late, 1.0 + REORDER_WINDOW)


def test_a_sequence_of_waits_begins_anew_after_a_sign_of_life():
    policy = RetryPolicy((1.0, 2.0, 4.0))
    policy.start(0.0)
    assert policy.deadline == 1.0
    assert policy.retry(1.0)
    assert policy.deadline == 3.0
    policy.extend(10.0)
    deadlines = [policy.deadline]
    while policy.retry(policy.deadline):
        deadlines.append(policy.deadline)
    assert deadlines == [10.0, 11.0, 13.0, 17.0]
    assert policy.deadline == math.inf
