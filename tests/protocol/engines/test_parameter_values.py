"""Parameters and their values on the wire."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.engines.table_values import Parameter, ValueEncoding, decode_value, encode_value
from protocol.errors import LocalProtocolError

REAL32, INT32, INT8, UINT16 = 9, 6, 2, 3


LIMITS = {
    1: (0, 255),
    INT8: (-128, 127),
    UINT16: (0, 65535),
    4: (-(2**15), 2**15 - 1),
    5: (0, 10**6),
    INT32: (0, 10**6),
}


@given(st.sampled_from(sorted(LIMITS)).flatmap(lambda k: st.tuples(st.just(k), st.integers(*LIMITS[k]))))
def test_integers_survive_as_bytes(case):
    kind, number = case
    assert decode_value(encode_value(number, kind), kind) == number


@given(st.sampled_from(sorted(LIMITS)).flatmap(lambda k: st.tuples(st.just(k), st.integers(*LIMITS[k]))))
def test_integers_travel_as_floats_of_the_same_value(case):
    kind, number = case
    carried = encode_value(number, kind, ValueEncoding.C_CAST)
    assert carried == number
    assert decode_value(carried, kind, ValueEncoding.C_CAST) == number


@given(st.floats(width=32, allow_nan=False))
def test_floats_survive_as_floats(number):
    assert decode_value(encode_value(number, REAL32), REAL32) == number


@pytest.mark.parametrize(
    ("value", "kind"), [(300, INT8), (1.5, INT32), (-1, UINT16), (1, 7), (1e39, REAL32), (math.nan, 6)]
)
@pytest.mark.parametrize("encoding", ValueEncoding)
def test_a_value_that_does_not_fit_its_type_is_refused(value, kind, encoding):
    with pytest.raises(LocalProtocolError):
        encode_value(value, kind, encoding)


def test_an_integer_whose_bytes_are_a_signalling_nan_is_refused():
    with pytest.raises(LocalProtocolError):
        encode_value(-5_000_000, INT32)


@pytest.mark.parametrize(
    "row",
    [
        {"name": "A_NAME_OF_17_CHAR"},
        {"name": ""},
        {"name": "HÖHE"},
        {"value": 2.0, "maximum": 1.0},
        {"value": math.inf},
        {"type": INT8, "value": 0.5},
    ],
)
def test_a_row_that_does_not_fit_the_wire_is_refused(row):
    with pytest.raises(LocalProtocolError):
        Parameter(**{"name": "P", "type": REAL32, "value": 0.0} | row)
