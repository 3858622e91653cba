"""Times on another clock: the quickest packet counts, drift is followed, a restart is noticed."""

import random

import pytest

from protocol.tools.timing import ClockMatch


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
