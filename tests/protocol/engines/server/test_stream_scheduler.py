"""The schedule of one link: which message is due when."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.engines.server.stream_server import STREAM_OFF, StreamScheduler
from protocol.errors import LocalProtocolError

ACCEPTED, DENIED, UNSUPPORTED = 0, 2, 3


ATTITUDE, POSITION, HOME = 30, 32, 242


def scheduler():
    return StreamScheduler({ATTITUDE: 20_000, POSITION: 100_000, HOME: STREAM_OFF})


def count(streams, number, ticks, tick):
    return sum(number in streams.due(k * tick) for k in range(ticks))


@settings(max_examples=60, deadline=None)
@given(interval=st.integers(1, 200_000), tick=st.integers(1, 20_000), ticks=st.integers(1, 400))
def test_a_message_is_due_at_the_first_tick_of_each_of_its_intervals(interval, tick, ticks):
    streams = StreamScheduler({ATTITUDE: interval})
    times = [k * tick for k in range(ticks) if streams.due(k * tick)]
    assert times == [k * tick for k in range(ticks) if k == 0 or (k * tick) // interval > ((k - 1) * tick) // interval]


def test_messages_due_together_are_ordered_by_id():
    assert scheduler().due(0) == [ATTITUDE, POSITION]


def test_missed_messages_are_not_sent_later():
    streams = scheduler()
    streams.due(0)
    assert streams.due(1_000_000) == [ATTITUDE, POSITION]
    assert streams.due(1_000_000) == []
    assert streams.next_due() == 1_020_000


def test_a_new_rate_is_in_force_at_once():
    streams = scheduler()
    streams.due(7_000)
    assert streams.set_interval(ATTITUDE, 50_000.0) == ACCEPTED
    assert [t for t in range(7_000, 207_000, 1_000) if ATTITUDE in streams.due(t)] == [7_000, 57_000, 107_000, 157_000]
    assert streams.interval(ATTITUDE) == 50_000


def test_the_same_interval_again_does_not_shift_the_phase():
    streams = scheduler()
    beats = []
    for time in range(0, 100_000, 1_000):
        beats += [time] if ATTITUDE in streams.due(time) else []
        streams.set_interval(ATTITUDE, 20_000.0)
    assert beats == [0, 20_000, 40_000, 60_000, 80_000]


@pytest.mark.parametrize("default", [0.0, math.nan])
def test_zero_and_nan_restore_the_default_and_minus_one_stops(default):
    streams = scheduler()
    assert streams.set_interval(ATTITUDE, -1.0) == ACCEPTED
    assert count(streams, ATTITUDE, 100, 10_000) == 0
    assert streams.interval(ATTITUDE) == -1
    assert streams.set_interval(ATTITUDE, default) == ACCEPTED
    assert streams.interval(ATTITUDE) == 20_000
    assert streams.is_default


def test_a_stream_that_is_off_by_default_can_be_switched_on():
    streams = scheduler()
    assert streams.set_interval(HOME, 1e6) == ACCEPTED
    assert streams.due(0) == [ATTITUDE, POSITION, HOME]


@pytest.mark.parametrize("interval", [-2.0, 0.3, math.inf, 1e12])
def test_invalid_intervals_are_denied_and_change_nothing(interval):
    streams = scheduler()
    assert streams.set_interval(ATTITUDE, interval) == DENIED
    assert streams.interval(ATTITUDE) == 20_000


def test_an_unknown_stream_is_unsupported():
    streams = scheduler()
    assert streams.set_interval(999, 1e6) == UNSUPPORTED
    assert streams.interval(999) == 0


def test_all_off_means_never():
    assert StreamScheduler({ATTITUDE: -1}).next_due() == math.inf


@pytest.mark.parametrize("interval", [0, -2, 2**31])
def test_an_invalid_default_interval_raises(interval):
    with pytest.raises(LocalProtocolError):
        StreamScheduler({ATTITUDE: interval})


@pytest.mark.parametrize("interval", [1, 2**31 - 1])
def test_the_shortest_and_the_longest_interval_are_accepted(interval):
    streams = scheduler()
    assert streams.set_interval(ATTITUDE, interval) == ACCEPTED
    assert streams.interval(ATTITUDE) == interval
