"""Verdicts follow from numbers alone."""

import math

import pytest

from sitl.lab.reproduction.experiment import (
    OPEN_DIFFERENCES,
    Conditions,
    Recomputation,
    Statement,
    Verdict,
    failures,
    printed,
)
from sitl.model.airframe_files import load


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
