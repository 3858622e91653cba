"""Gaps of a series: nothing is known there."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from protocol.flight_log.field_expressions import between, longest_step, pieces, with_gaps

TIMES = np.array([0.0, 1.0, 2.0, 50.0, 51.0])
VALUES = np.array([0.0, 1.0, 2.0, 50.0, 51.0])


def test_values_between_neighbours_are_in_proportion_and_in_a_gap_there_are_none():
    found = between(np.array([-1.0, 0.5, 2.0, 2.5, 30.0, 49.9, 50.0, 50.5, 52.0]), TIMES, VALUES)
    assert np.array_equal(found, [0.0, 0.5, 2.0, np.nan, np.nan, np.nan, 50.0, 50.5, 51.0], equal_nan=True)


def test_far_outside_nothing_is_known():
    assert np.isnan(between(np.array([-9.0, 60.0]), TIMES, VALUES)).all()


def test_a_drawn_line_breaks_in_the_middle_of_a_gap():
    times, values = with_gaps(TIMES, VALUES)
    assert times.tolist() == [0.0, 1.0, 2.0, 26.0, 50.0, 51.0]
    assert np.array_equal(values, [0.0, 1.0, 2.0, np.nan, 50.0, 51.0], equal_nan=True)
    assert with_gaps(TIMES, np.stack((VALUES, VALUES), axis=1))[1].shape == (6, 2)


def test_a_slow_message_has_no_gap_at_its_own_rate():
    slow = np.arange(5) * 30.0
    assert len(with_gaps(slow, slow)[0]) == 5


@given(st.lists(st.floats(0.0, 1e4), min_size=1, max_size=20))
def test_at_its_own_times_a_series_is_itself(times):
    times = np.unique(np.array(times))
    assert between(times, times, times * 2.0).tolist() == (times * 2.0).tolist()
    assert longest_step(times) >= 2.0


def test_a_series_falls_into_pieces_between_its_gaps():
    assert [(piece.start, piece.stop) for piece in pieces(TIMES)] == [(0, 3), (3, 5)]
