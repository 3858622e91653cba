"""Elementary functions against the library's."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.model.arithmetic import arctangent, clipped, decay, exponential, heading_trigonometry, sine_cosine, wrapped

angles = st.one_of(st.floats(-7.0, 7.0), st.floats(-1e6, 1e6))
numbers = st.floats(-1e6, 1e6, allow_subnormal=False)


@given(angles)
def test_sine_and_cosine(x):
    assert sine_cosine(x) == pytest.approx((math.sin(x), math.cos(x)), abs=2.5e-16)


@pytest.mark.parametrize("quarters", range(-9, 10))
def test_sine_and_cosine_about_the_quarters_of_a_turn(quarters):
    for off in (-1e-9, 0.0, 1e-9, 0.785398, -0.785399):
        x = 0.5 * math.pi * quarters + off
        assert sine_cosine(x) == pytest.approx((math.sin(x), math.cos(x)), abs=2.5e-16)


@given(numbers, numbers)
def test_arctangent(y, x):
    expected = math.atan2(y, x) if x != 0.0 or y != 0.0 else 0.0
    assert arctangent(y, x) == pytest.approx(expected, rel=1e-15, abs=1e-300)


@given(st.floats(-100.0, 100.0))
def test_exponential(x):
    assert exponential(x) == pytest.approx(math.exp(x), rel=1e-12)


@given(st.floats(-1e3, 1e3))
def test_a_wrapped_angle_is_the_same_direction(x):
    assert -math.pi <= wrapped(x) <= math.pi
    assert math.cos(wrapped(x) - x) == pytest.approx(1.0)


def test_clipping():
    assert [clipped(x, -1.0, 2.0) for x in (-3.0, 0.5, 7.0)] == [-1.0, 0.5, 2.0]


def test_decay_is_the_exponential_of_short_steps() -> None:
    for x in (0.0, 1e-6, 1e-3, 0.024, 0.1):
        assert abs(decay(x) - math.exp(-x)) <= x**5 / 720.0 + 4e-16


def test_the_trigonometry_of_a_heading_is_that_of_its_half_and_its_whole() -> None:
    for heading in (-3.1, -0.3, 0.0, 1.0, 2.7):
        half, whole = 0.5 * heading, heading
        expected = (math.sin(half), math.cos(half), math.sin(whole), math.cos(whole))
        assert heading_trigonometry(heading) == pytest.approx(expected, abs=4e-16)
