"""Verdicts follow from numbers alone."""

import math

import pytest

from sitl.lab.reproduction.experiment import (
    OPEN_DIFFERENCES,
    Conditions,
    Kind,
    OpenDifference,
    Recomputation,
    Statement,
    Verdict,
    above,
    all_of,
    below,
    failures,
    printed,
    printed_to_ten,
)
from sitl.model.airframe_files import load

# Agreement of numbers with those that the report prints.


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


@pytest.mark.parametrize(
    ("value", "with_the_change", "verdict"),
    [
        (2.178, None, Verdict.REPRODUCED),
        (2.178, 9.0, Verdict.REPRODUCED),
        (2.23, 2.179, Verdict.CAUSE_COMPUTED),
        (2.23, 2.186, Verdict.UNEXPLAINED),
        (2.23, None, Verdict.UNEXPLAINED),
        (math.nan, math.nan, Verdict.UNEXPLAINED),
    ],
)
def test_the_verdict_compares_the_printed_number_with_the_computed_ones(value, with_the_change, verdict):
    cause = None if with_the_change is None else Recomputation("a slip", with_the_change)
    statement = Statement("4.1", "thrust", printed("2.18"), value, "N", cause)
    assert statement.verdict is verdict
    assert failures([statement]) == ([statement] if verdict is Verdict.UNEXPLAINED else [])


@pytest.mark.parametrize("name", OPEN_DIFFERENCES)
def test_an_open_difference_is_open_only_with_the_number_it_is_listed_with(name):
    found = OPEN_DIFFERENCES[name].found
    middle = 0.5 * (found.low + found.high)
    assert Statement("1", name, printed("9999"), middle).verdict is Verdict.OPEN
    assert Statement("1", name, printed("9999"), 1.1 * middle).verdict is Verdict.UNEXPLAINED
    assert Statement("1", f"another {name}", printed("9999"), middle).verdict is Verdict.UNEXPLAINED


def test_conditions_alter_every_set_by_the_same_factors():
    altered = Conditions(factors=(("m", 1.1), ("C_lp", 0.0)))
    for name in ("nominal", "published"):
        a, plain = altered.airframe(name), load(name).parameters
        assert a.m == pytest.approx(1.1 * plain.m)
        assert a.C_lp == 0.0
        assert a._replace(m=plain.m, C_lp=plain.C_lp) == plain
    assert Conditions().airframe("nominal") == load("nominal").parameters


def test_a_row_is_a_number_words_or_an_input():
    number = Statement("1", "a", printed("62.67"), 62.67)
    assert number.kind is Kind.NUMBER
    assert Statement("1", "a", above(0.0, "leans"), 1.0).kind is Kind.CLAIM
    assert Statement("1", "a", printed("0"), 0.0, is_claim=True).kind is Kind.CLAIM
    assert Statement("1", "a", printed("30"), 30.0, is_input=True).kind is Kind.INPUT


def test_a_difference_is_open_only_while_it_is_the_one_listed_with_its_row():
    listed = OpenDifference(printed("8.0"), "why")
    assert Statement("1", "a", printed("1"), 8.0, open=listed).verdict is Verdict.OPEN
    assert Statement("1", "a", printed("1"), 8.1, open=listed).verdict is Verdict.UNEXPLAINED
