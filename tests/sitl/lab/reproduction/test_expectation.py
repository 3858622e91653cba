"""Agreement of numbers with those that the report prints."""

import math

import pytest

from sitl.lab.reproduction.experiment import above, all_of, below, printed, printed_to_ten


@pytest.mark.parametrize(
    ("text", "inside", "outside"),
    [
        ("62.67", (62.665, 62.67, 62.675), (62.677, 62.66, math.nan)),
        ("661", (660.5, 661.49), (660.4, 661.6, math.inf)),
        ("-0.05", (-0.0451, -0.055), (-0.0449, 0.05)),
        ("1000", (999.6,), (1001.0,)),
        ("0", (0.49, -0.5), (0.51,)),
    ],
)
def test_a_printed_number_is_meant_to_half_a_unit_of_its_last_digit(text, inside, outside):
    assert all(printed(text).holds(value) for value in inside)
    assert not any(printed(text).holds(value) for value in outside)


def test_the_page_says_how_a_text_is_read():
    assert printed("2.18").reading == "± 0.005"
    assert printed_to_ten("60").reading == "± 5: read to the ten"
    assert printed_to_ten("60").holds(55.0)
    assert not printed_to_ten("60").holds(65.8)


def test_a_text_without_a_number_is_no_printed_number():
    with pytest.raises(ValueError, match="about"):
        printed("about 5")


def test_statements_without_a_number_have_a_side():
    assert below(0.0, "slower").holds(-1e-9)
    assert not below(0.0, "slower").holds(0.0)
    assert above(1e14, "> 1e14").holds(math.inf)
    assert not above(1e14, "> 1e14").holds(1e14)
    assert not above(1.0, "more").holds(math.nan)


def test_all_entries_means_all():
    assert all_of(140).holds(140.0)
    assert not all_of(140).holds(139.0)
