"""Wire scalings are exact, or raise an error."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol import units
from protocol.errors import LocalProtocolError


@given(st.integers(-(2**31), 2**31 - 1))
def test_wire_integers_survive_a_round_trip(number):
    assert units.to_e7(units.from_e7(number)) == number
    assert units.local_e4(units.from_local_e4(number)) == number
    assert units.millimetres(units.from_millimetres(number)) == number


def test_ties_round_to_even():
    assert [units.centimetres_per_second(v) for v in (0.005, 0.015, 0.025, -0.005)] == [0, 2, 2, 0]
    assert [units.millimetres(v) for v in (0.0005, 0.0015, 0.0025)] == [0, 2, 2]


@pytest.mark.parametrize(
    ("scale", "value"),
    [
        (units.to_e7, 215.0),
        (units.to_e7, math.nan),
        (units.millimetres, 3e6),
        (units.millimetres, -math.inf),
        (units.centimetres_per_second, 327.68),
        (units.centidegrees, math.inf),
        (units.milliseconds, -0.001),
        (units.milliseconds, math.inf),
        (units.microseconds, -1.0),
        (units.millivolts, 65.535),
        (units.centiamperes, 400.0),
        (units.percent, 1.01),
        (units.percent, -0.5),
    ],
)
def test_a_value_that_does_not_fit_its_field_raises(scale, value):
    with pytest.raises(LocalProtocolError):
        scale(value)


@pytest.mark.parametrize(
    ("scale", "word"),
    [(units.centidegrees, 65535), (units.millivolts, 65535), (units.centiamperes, -1), (units.percent, -1)],
)
def test_nan_becomes_the_wire_value_for_unknown(scale, word):
    assert scale(math.nan) == word


@given(st.floats(-100.0, 100.0))
def test_headings_stay_within_one_turn(heading):
    wire = units.centidegrees(heading)
    assert 0 <= wire < 36000
    assert abs(math.remainder(units.from_centidegrees(wire) - heading, 2 * math.pi)) <= math.radians(0.005) + 1e-9


def test_an_unknown_heading_survives_a_round_trip():
    assert math.isnan(units.from_centidegrees(65535))


def test_coordinates_are_degrees_in_global_frames_metres_in_local_ones_and_nan_by_default():
    assert units.coordinates(3, 435648000, 14811000) == (43.5648, 1.4811)
    assert units.coordinates(1, 25000, -15000) == (2.5, -1.5)
    assert all(map(math.isnan, units.coordinates(0, units.UNKNOWN_INT32, units.UNKNOWN_INT32)))


def test_milliseconds_since_boot_wrap_after_32_bits():
    assert units.milliseconds(4294967.295) == 2**32 - 1
    assert units.milliseconds(4294967.296) == 0
