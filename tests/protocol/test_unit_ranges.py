"""The greatest and the smallest value that each field of the wire holds, and the first ones that it does not."""

import math

import pytest

from protocol import units
from protocol.errors import LocalProtocolError

# The unit's scaling, what one on the wire is worth, and the smallest and greatest number of the field.
FIELDS = {
    "int32 degE7": (units.to_e7, 1e-7, -(2**31), 2**31 - 1),
    "int32 1e-4 m": (units.local_e4, 1e-4, -(2**31), 2**31 - 1),
    "int32 mm": (units.millimetres, 1e-3, -(2**31), 2**31 - 1),
    "int16 cm/s": (units.centimetres_per_second, 1e-2, -(2**15), 2**15 - 1),
    "uint16 mV": (units.millivolts, 1e-3, 0, 2**16 - 2),
    "int16 cA": (units.centiamperes, 1e-2, 0, 2**15 - 1),
    "int8 %": (units.percent, 1e-2, 0, 100),
}


@pytest.mark.parametrize(("scale", "unit", "least", "most"), FIELDS.values(), ids=FIELDS)
def test_the_ends_of_a_field_fit_and_one_more_does_not(scale, unit, least, most):
    assert [scale(number * unit) for number in (least, 1, most)] == [least, 1, most]
    for beyond in (least - 1, most + 1):
        with pytest.raises(LocalProtocolError, match=f"does not fit {least}..{most}"):
            scale(beyond * unit)


@pytest.mark.parametrize(("scale", "unit"), [(units.milliseconds, 1e-3), (units.microseconds, 1e-6)])
def test_times_begin_at_zero_and_fit_64_bits(scale, unit):
    assert [scale(number * unit) for number in (0, 1, 2**31)] == [0, 1, 2**31]
    almost = 2.0**64 * (1.0 - 2.0**-52)
    assert scale(almost * unit) == int(almost) % (2**32 if scale is units.milliseconds else 2**64)
    for beyond in (-1, 2**64):
        with pytest.raises(LocalProtocolError, match="does not fit"):
            scale(beyond * unit)


def test_headings_are_hundredths_of_a_degree_below_a_whole_turn():
    assert [units.centidegrees(math.radians(degrees)) for degrees in (0.0, 0.01, 359.99, 360.0, -0.01)] == [
        0, 1, 35999, 0, 35999,
    ]  # fmt: skip
    assert units.from_centidegrees(9000) == pytest.approx(math.pi / 2)


def test_x_and_y_may_each_be_left_to_their_default():
    x, y = units.coordinates(3, units.UNKNOWN_INT32, 15_000_000)
    assert math.isnan(x)
    assert y == 1.5
    assert units.UNKNOWN_INT32 == 2**31 - 1
