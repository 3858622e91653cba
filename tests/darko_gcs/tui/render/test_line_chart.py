"""Values on a linear axis."""

import math

from darko_gcs.tui.render.chart import NUMBER_WIDTH, line_chart


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
