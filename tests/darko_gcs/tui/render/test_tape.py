"""The tapes beside the horizon."""

import math
from itertools import pairwise

import pytest

from darko_gcs.tui.render.horizon import tape
from tests.support.gcs.screens import line_text


def rows(value, **changed):
    return [
        line_text(line)
        for line in tape(value, **({"title": "air m/s", "per_row": 0.5, "width": 9, "height": 11} | changed))
    ]


def test_the_value_stands_in_the_middle_and_larger_ones_above():
    drawn = rows(7.0)
    assert drawn[5] == "▶    7.0 "
    assert drawn[3].endswith("8 ─")
    assert drawn[7].endswith("6 ─")
    assert drawn[0] == " air m/s "


@pytest.mark.parametrize("value", [0.26, 13.49, -4.2, 99.9, 123.4])
def test_round_numbers_are_four_rows_apart_and_every_row_is_as_wide_as_the_tape(value):
    drawn = rows(value, height=31)
    assert {len(row) for row in drawn} == {9}
    numbered = [row for row, text in enumerate(drawn) if text.endswith("─")]
    assert {b - a for a, b in pairwise(numbered)} <= {4, 8}  # one may be behind the value
    for row in numbered:
        assert float(drawn[row].removesuffix("─")) == pytest.approx(value + 0.5 * (15 - row), abs=0.25)


def test_an_airspeed_has_no_scale_below_nothing():
    assert not "".join(rows(0.0, least=0.0)[6:]).strip()


@pytest.mark.parametrize("value", [None, math.nan, math.inf, 1e9])
def test_what_is_no_value_gives_dashes(value):
    assert rows(value)[5].split() == ["▶", "--"]
    assert len(rows(value)) == 11
