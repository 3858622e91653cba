"""Values over time: on a logarithmic axis with thresholds and marks, or on a linear one."""

import math
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.tui.render.chart import NUMBER_WIDTH, line_chart, log_chart
from tests.support.gcs.screens import line_text, lines_text, styled_text

LABELS = 5  # cells at the left
any_number = st.floats(allow_nan=True, allow_infinity=True)


@settings(deadline=None, max_examples=60)
@given(
    st.integers(1, 120), st.integers(1, 40), st.lists(st.tuples(st.floats(0, 100), any_number), max_size=40),
    st.lists(any_number, max_size=3),
)  # fmt: skip
def test_a_chart_has_the_size_asked_for_whatever_its_values(width, height, points, thresholds):
    points.sort(key=lambda point: point[0])
    lines = log_chart(
        [t for t, _ in points], ([v for _, v in points], "track", "v"), width=width, height=height, window=60.0,
        thresholds=[(v, "x", "hover") for v in thresholds if v > 0.0], jumps=[(50.0, "j")], now=100.0,
    )  # fmt: skip
    assert len(lines) <= max(height, 1)
    assert all(len(line_text(line)) <= width for line in lines)


def test_a_chart_shows_its_decades_thresholds_and_jumps():
    times = [t / 10 for t in range(600)]
    lines = log_chart(
        times, ([10.0 ** (2 - t / 20) for t in times], "track", "v"), width=60, height=16, window=60.0,
        thresholds=((100.0, "hover leave 100", "hover"), (50.0, "hover enter 50", "hover")), jumps=((30.0, "calm"),),
        now=60.0,
    )  # fmt: skip
    for words in ("100", "0.1", "hover leave 100", "hover enter 50", "-60 s", "now", "calm", "v"):
        assert words in lines_text(lines)
    assert len(styled_text(lines, "jump")) >= 10


def test_an_empty_chart_is_labelled():
    assert "no data" in lines_text(log_chart([], ([], "track", "v"), width=60, height=10, window=60.0, now=0.0))


def test_a_chart_falls_where_the_value_falls():
    lines = log_chart([0.0, 60.0], ([1000.0, 1.0], "track", "v"), width=45, height=10, window=60.0, now=60.0)
    rows = [line_text(line)[LABELS:] for line in lines[:-1]]
    first_dots = [min(row.find(c) for c in row if c > "⠀") for row in rows if any(c > "⠀" for c in row)]
    assert first_dots == sorted(first_dots)


def test_labels_jumps_and_the_want_of_data_do_not_lie_on_one_another():
    """In one row, or in a few, there is no room for all of them."""
    thresholds = ((120.0, "hover leave 120", "hover"), (1.0, "hover enter 1", "hover"))
    jumps = ((35.0, "enter_linear"),)
    for height in (2, 3, 4, 6):
        drawn = log_chart([], ([], "hover", "h"), width=37, height=height, window=60.0, thresholds=thresholds,
                          jumps=jumps, now=60.0)  # fmt: skip
        rows = [line_text(line)[LABELS:] for line in drawn]
        assert any("hover leave 120" in row for row in rows)
        for row in rows:
            left = row.replace("hover leave 120", "").replace("hover enter 1", "")
            left = left.replace("enter_linear", "").replace("no data", "").replace("-60 s", "").replace("now", "")
            assert not any(character.isalpha() for character in left), row


def test_two_thresholds_in_one_row_have_their_labels_at_its_two_ends_or_the_second_none():
    thresholds = ((100.0, "hover leave 100", "hover"), (50.0, "hover enter 50", "hover"))
    cases = ((45, "hover enter 50"), (33, "enter 50"), (24, "⠂"))
    for width, begins in cases:
        drawn = log_chart([], width=width, height=2, window=60.0, thresholds=thresholds, now=60.0)
        row = next(line_text(line)[LABELS:] for line in drawn if "leave" in line_text(line))
        assert row.endswith("hover leave 100")
        assert row.startswith(begins)
        assert ("enter" in row) == (begins != "⠂")


def text(lines):
    return ["".join(segment for segment, _ in line) for line in lines]


def test_traces_fill_the_chart_from_edge_to_edge_with_their_letters():
    rows = text(line_chart(([0.0, 10.0], "hover", "A"), ([5.0, 5.0], "forward", "B"), width=26, height=6))
    assert all(len(row) == 26 for row in rows)
    assert rows[0].startswith(" 10.0 ")
    assert rows[-1].startswith("  0.0 ")
    assert rows[0].endswith("A")
    assert rows[2].endswith("B")


def test_a_gap_is_left_where_there_is_no_number():
    rows = text(line_chart(([1.0, math.nan, math.nan, 1.0], "hover", "A"), width=NUMBER_WIDTH + 12, height=1))
    assert rows[0][NUMBER_WIDTH] != " "
    assert rows[0][NUMBER_WIDTH + 2 : -1].strip() == ""


def test_without_numbers_it_says_so():
    rows = text(line_chart(([math.nan] * 3, "hover", "A"), width=40, height=3))
    assert "no data here" in rows[1]


def test_a_level_trace_has_a_range_of_one():
    rows = text(line_chart(([3.0, 3.0], "hover", "A"), width=30, height=5))
    assert (rows[0][:6], rows[-1][:6]) == ("  3.5 ", "  2.5 ")


@pytest.mark.parametrize("width", range(6, 40))
def test_no_label_of_a_chart_is_cut(width):
    thresholds = ((2.5, "hover leave 2.5", "hover"), (1.0, "hover enter 1", "hover"))
    chart = log_chart(
        [0.0, 1.0], ([1.0, 2.0], "hover", "h"), width=width, height=6, window=60.0, thresholds=thresholds, now=1.0
    )
    lines = ["".join(text for text, _ in line) for line in chart]
    words = {word for line in lines for word in re.findall(r"[a-z]+ ?[a-z]*|-60 s", line)}
    assert words <= {"hover leave ", "hover enter ", "now", "h", "-60 s", "s", "s now", "hover leave", "hover enter"}


def test_a_large_number_at_a_linear_axis_is_shortened_not_cut():
    chart = line_chart(([123456.0, 1234567.0], "hover", "h"), width=20, height=3)
    assert [chart[0][0][0].strip(), chart[-1][0][0].strip()] == ["1e6", "1e5"]
