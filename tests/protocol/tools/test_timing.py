"""Times of another clock, told by packets of unknown delay, and a limit on how often something may happen."""

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.tools.timing import ClockMatch, TokenBucket


def test_the_quickest_packet_tells_how_far_the_clocks_are_apart():
    clocks = ClockMatch()
    for k, late in enumerate((0.03, 0.01, 0.02, 0.05)):
        assert clocks.hear(k, 100.0 + k + late)
    assert clocks.ours(7.0) == pytest.approx(107.01)
    assert clocks.theirs(107.01) == pytest.approx(7.0)


def test_a_clock_that_drifts_is_followed_within_two_windows():
    clocks, draws = ClockMatch(5.0), random.Random(1)
    for k in range(4000):
        clocks.hear(0.01 * k * (1 - 1e-4), 0.01 * k + 0.02 * draws.random())
    assert clocks.ours(40.0 * (1 - 1e-4)) == pytest.approx(40.0, abs=2e-3)


def test_a_clock_that_is_set_or_restarted_is_noticed_once():
    clocks = ClockMatch()
    clocks.hear(50.0, 100.0)
    assert not clocks.hear(0.0, 101.0)
    assert clocks.hear(1.0, 102.0)
    assert clocks.ours(1.0) == pytest.approx(102.0)


def test_a_window_is_over_exactly_at_its_length():
    clocks = ClockMatch(5.0)
    for stamp, now in ((0.0, 100.0), (4.75, 105.0), (9.75, 110.0)):  # the first packet was quicker by a quarter
        assert clocks.hear(stamp, now)
    assert clocks.ours(0.0) == 100.25


def test_a_full_bucket_lets_its_capacity_through_at_once():
    bucket = TokenBucket(capacity=3, rate=1.0)
    assert [bucket.take(0.0) for _ in range(4)] == [True, True, True, False]


def test_tokens_return_at_the_rate_up_to_the_capacity():
    bucket = TokenBucket(capacity=3, rate=2.0, tokens=0.0)
    assert not bucket.take(0.4)
    assert bucket.take(0.5)
    assert bucket.level(100.0) == 3


def test_a_refused_request_spends_nothing():
    bucket = TokenBucket(capacity=3, rate=1.0)
    assert not bucket.take(0.0, 4)
    assert bucket.take(0.0, 3)


def test_time_that_goes_backwards_adds_and_removes_nothing():
    bucket = TokenBucket(capacity=3, rate=1.0, now=10.0, tokens=1.0)
    assert bucket.level(5.0) == 1.0


@given(st.lists(st.tuples(st.floats(0.0, 5.0), st.integers(1, 4)), max_size=60))
def test_no_sequence_exceeds_the_burst_and_the_rate(requests):
    bucket, now, taken = TokenBucket(capacity=5, rate=2.0), 0.0, 0
    for pause, count in requests:
        now += pause
        taken += count * bucket.take(now, count)
    assert taken <= 5 + 2.0 * now + 1e-6
