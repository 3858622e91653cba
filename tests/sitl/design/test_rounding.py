"""Rounding is exact, idempotent and indifferent to noise."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.design.rounding import rounded, rounded_matrix

NUMBERS = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(st.lists(NUMBERS, min_size=1, max_size=20), st.integers(3, 15))
def test_what_is_rounded_is_near_and_stays_as_it_is(numbers, digits):
    once = rounded_matrix(numbers, digits)
    largest = np.abs(numbers).max()
    assert np.abs(once - numbers).max() <= 10.0**-digits * largest
    assert rounded_matrix(once, digits).tobytes() == once.tobytes()


@pytest.mark.parametrize("scale", [1.0, -0.25, 1024.0, math.pi, 1e-7])
def test_noise_is_gone_even_where_the_largest_is_a_power_of_two(scale):
    M = scale * np.array([[1.0, 0.3, 0.0], [1e-3, -0.7, 1e-12]])
    noisy = M + scale * 1e-14 * np.random.default_rng(1).standard_normal((100, *M.shape))
    assert all(rounded_matrix(one).tobytes() == rounded_matrix(M).tobytes() for one in noisy)


def test_tiny_entries_are_zero_without_a_sign():
    tiny = rounded_matrix([5.0, 1e-12, -1e-12])[1:]
    assert tiny.tolist() == [0.0, 0.0]
    assert not np.signbit(tiny).any()


def test_a_multiple_of_a_power_of_two_has_few_bits():
    value = rounded(math.pi)
    assert value == pytest.approx(math.pi, rel=1e-9)
    assert (value * 2**30).is_integer()
    assert rounded(math.pi, 3) == pytest.approx(math.pi, rel=0.001)


def test_what_is_no_number_stays():
    assert rounded_matrix([1.0, math.inf, -math.inf]).tolist() == [1.0, math.inf, -math.inf]
    assert np.isnan(rounded_matrix([1.0, math.nan])[1])
    assert rounded_matrix(np.zeros((2, 3))).tolist() == [[0.0] * 3] * 2
    assert rounded(0.0) == 0.0


def test_the_result_is_of_rows_whatever_it_was_made_of():
    assert rounded_matrix(np.ones((2, 3)).T).flags.c_contiguous
