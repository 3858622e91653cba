"""Numbers within a range, and the words for a number out of it."""

import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.ranges import ANY_NUMBER, MAX_FLOAT32, finite, first_flaw, one_of, whole

SPEED = finite("speed", 0.1, 22.0, "m/s", also=(-1.0,), default=False)
COUNT = whole("repeat count", 0, 65535, also=(-1.0,))


@pytest.mark.parametrize("value", [0.1, 22.0, -1.0, struct.unpack("<f", struct.pack("<f", 0.1))[0]])
def test_limits_belong_to_a_range_also_as_the_wire_rounds_them(value):
    assert SPEED.allows(value)


@pytest.mark.parametrize("value", [0.0, 0.099, 22.001, -2.0, math.inf, -math.inf, math.nan, 1e38, 1e-45])
def test_what_is_out_of_a_range_is_not_allowed(value):
    assert not SPEED.allows(value)


@pytest.mark.parametrize(
    ("value", "allowed"), [(0, True), (65535, True), (-1, True), (1.5, False), (-2, False), (-0.0, False)]
)
def test_a_whole_number_has_no_fraction_and_zero_no_sign(value, allowed):
    assert COUNT.allows(value) is allowed


@given(st.floats())
def test_a_number_without_a_meaning_is_finite_or_left_open(value):
    assert ANY_NUMBER.allows(value) is (math.isnan(value) or abs(value) <= MAX_FLOAT32)


@pytest.mark.parametrize(
    ("allowed", "words"),
    [
        (SPEED, "-1 or a number from 0.1 to 22 m/s"),
        (COUNT, "-1 or a whole number from 0 to 65535"),
        (one_of("VTOL state", 0, 3, 4), "0, 3 or 4"),
        (one_of("reset", 1), "1"),
        (ANY_NUMBER, "a number that is finite"),
    ],
)
def test_a_range_is_told_in_words(allowed, words):
    assert allowed.words == words


def test_a_flaw_names_the_parameter_its_value_and_what_is_allowed():
    flaw = first_flaw((ANY_NUMBER, COUNT), (math.nan, math.inf))
    assert flaw == (2, "param2 is inf, not -1 or a whole number from 0 to 65535 (repeat count)")
