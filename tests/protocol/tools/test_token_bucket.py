"""A token bucket lets a burst through after a pause, and its rate on average."""

from hypothesis import given
from hypothesis import strategies as st

from protocol.tools.timing import TokenBucket


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
