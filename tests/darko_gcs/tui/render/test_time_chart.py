"""Charts of curves over time: what is drawn where, axes of each unit, gaps, marks and the cursor."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from darko_gcs.tui.render.time_chart import Axis, TimeChart, TimeSpan, Trace, clock_text, covered, value_at
from tests.support.gcs.screens import lines_text, styled_text

TIMES = np.arange(0.0, 100.0, 0.1)


def trace(values, times=TIMES, **other):
    usual = {"unit": "m", "style": "hover", "letter": "a", "longest_step": 2.0}
    return Trace(times=times, values=np.broadcast_to(values, times.shape), **usual | other)


def drawn(*traces, width=60, height=12, end=100.0, window=60.0, **other):
    chart = TimeChart(traces=traces, **other)
    return chart.lines(TimeSpan.until(end, window, width), height, chart.axes_width())


def test_the_curve_of_a_ramp_rises_from_the_lower_left_to_the_upper_right():
    lines = lines_text(drawn(trace(TIMES))).splitlines()
    assert lines[10][9:15].strip()
    assert lines[0].rstrip().endswith("a")
    assert not lines[0][9:40].strip()


def test_a_column_holds_every_value_that_falls_into_it():
    times = np.arange(0.0, 10.0, 0.001)
    values = np.where(np.arange(len(times)) == 5432, 7.0, 0.0)
    low, high = covered(trace(values, times), TimeSpan.until(10.0, 10.0, 20))
    assert np.nanmax(high) == 7.0
    assert np.nanmin(low) == 0.0


@given(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=60), st.integers(2, 80))
def test_neighbouring_columns_of_a_curve_touch(values, cells):
    times = np.arange(len(values)) * 1.0
    low, high = covered(trace(np.array(values), times), TimeSpan.until(times[-1], times[-1] + 1.0, cells))
    for left in range(len(low) - 1):
        if np.isfinite(low[left]) and np.isfinite(low[left + 1]):
            slack = 1e-9 * (1.0 + abs(high[left]))
            assert low[left] <= high[left + 1] + slack
            assert low[left + 1] <= high[left] + slack


def test_a_gap_and_values_that_are_none_leave_holes():
    times = np.array([0.0, 1.0, 2.0, 30.0, 31.0, 32.0, 33.0])
    values = np.array([1.0, 1.0, 1.0, 1.0, np.nan, 1.0, 1.0])
    low, _ = covered(trace(values, times), TimeSpan.until(33.99, 34.0, 17))
    assert np.isfinite(low[[0, 1, 30, 32]]).all()
    assert np.isnan(low[[4, 15, 28, 31]]).all()


def test_each_unit_has_an_axis_with_its_unit_and_round_numbers():
    text = lines_text(drawn(trace(TIMES), trace(TIMES / 1000.0, unit="rad", letter="b")))
    assert "[m]" in text
    assert "[rad]" in text
    assert " 100 " in text
    assert "0.10" in text


def test_the_unit_stands_on_an_axis_that_has_a_number_in_every_row():
    angle = trace(199.0 * np.sin(TIMES), unit="deg")
    assert [line.split()[0] for line in lines_text(drawn(angle, height=6)).splitlines()[:5]] == [
        "200", "[deg]", "0", "-100", "-200",
    ]  # fmt: skip


@pytest.mark.parametrize("height", [3, 4, 5, 6, 9])
def test_each_of_two_axes_says_its_unit_also_in_few_rows(height):
    text = lines_text(drawn(trace(TIMES), trace(np.sin(TIMES), unit="rad", letter="b"), height=height))
    assert "[m]" in text
    assert "[rad]" in text


@given(st.floats(-1e5, 1e5), st.floats(1e-3, 1e5), st.integers(1, 60))
def test_an_axis_holds_its_range_and_has_a_number_in_it(low, spread, rows):
    axis = Axis.around(low, low + spread, rows)
    assert axis.low <= low + 1e-9 * abs(low) + 1e-9 * spread
    assert axis.high >= low + spread - 1e-9 * abs(low) - 1e-9 * spread
    assert math.floor(axis.high / axis.step + 1e-9) - math.ceil(axis.low / axis.step - 1e-9) >= 1
    assert any(axis.labels(max(rows, 3)))


@pytest.mark.parametrize("values", [(5.0, 5.0), (0.0, 0.0), (math.nan, math.nan), (-math.inf, math.inf)])
def test_a_constant_curve_and_no_curve_have_an_axis(values):
    axis = Axis.around(*values, 10)
    assert axis.low < axis.high


def test_marks_and_the_cursor_are_lines_and_words_behind_the_curves():
    lines = drawn(trace(0.0), marks=[(50.0, "hover"), (70.0, "far too long a word for the room that is left here")],
                  cursor=60.0)  # fmt: skip
    assert "hover" in styled_text(lines, "jump")
    assert "far too" not in lines_text(lines)
    assert styled_text(lines, "jump").count("┊") >= 16
    assert styled_text(lines, "now").count("│") >= 8


def test_marks_outside_the_window_are_not_drawn():
    assert "┊" not in lines_text(drawn(trace(0.0), marks=[(10.0, "early"), (200.0, "late")]))


def test_a_chart_that_moves_by_less_than_a_cell_stays_as_it_is():
    window = TimeSpan.until(100.0, 60.0, 60)
    assert TimeSpan.until(100.0 + 1.4 * window.width, 60.0, 60) == window
    assert TimeSpan.until(100.0 + 2.1 * window.width, 60.0, 60).first == window.first + 2


def test_times_stand_below_at_round_seconds():
    last = lines_text(drawn(trace(0.0), width=100)).splitlines()[-1]
    assert last.split() == ["'0:50", "'1:00", "'1:10", "'1:20", "'1:30"]
    assert (clock_text(83.25), clock_text(83.0, 5.0), clock_text(-2.0, 1.0)) == ("1:23.2", "1:23", "-0:02")


def test_no_time_before_the_vehicle_was_switched_on_stands_below():
    last = lines_text(drawn(trace(0.0), width=100, end=20.0)).splitlines()[-1]
    assert last.split() == ["'0:00", "'0:10"]


def test_the_value_at_a_time_is_the_newest_then_and_none_is_made_up():
    times, values = np.array([1.0, 2.0, 3.0]), np.array([10.0, 20.0, 30.0])
    assert value_at(times, values, 2.5, 2.0) == 20.0
    assert math.isnan(value_at(times, values, 0.5, 2.0))
    assert math.isnan(value_at(times, values, 9.0, 2.0))


@pytest.mark.parametrize(("width", "height"), [(1, 1), (4, 2), (10, 1), (3, 40)])
def test_the_smallest_charts_are_drawn(width, height):
    assert len(drawn(trace(TIMES), width=width, height=height)) == height
