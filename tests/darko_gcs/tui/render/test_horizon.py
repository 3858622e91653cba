"""Instruments in cells: artificial horizon, heading tape, vertical tapes, and bars in eighths of a cell."""

import math
import re
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.tui.render.horizon import DEGREES_PER_CELL, DIRECTION_NAMES, bar, heading_tape, horizon, tape
from protocol.frames import SHOW_PITCHED_DOWN, displayed, quaternion_from_euler
from tests.support.gcs.screens import line_text, lines_text, styled_text

any_number = st.floats(allow_nan=True, allow_infinity=True)


@settings(deadline=None, max_examples=60)
@given(st.one_of(st.none(), any_number), st.integers(1, 120), st.booleans(), st.one_of(st.none(), any_number))
def test_a_bar_has_the_width_asked_for(value, width, saturated, command):
    line = bar(value, -1.0, 1.0, width=width, command=command, saturated=saturated, centre=0.0)
    assert len(line_text(line)) == width


def test_a_bar_is_filled_from_its_beginning_or_its_centre():
    assert line_text(bar(0.5, 0.0, 1.0, width=8)) == "████    "
    assert line_text(bar(0.25, 0.0, 1.0, width=2)) == "▌ "
    assert line_text(bar(1.0, -1.0, 1.0, width=8, centre=0.0)) == "    ████"
    assert line_text(bar(-1.0, -1.0, 1.0, width=8, centre=0.0)) == "████    "
    assert line_text(bar(math.nan, 0.0, 1.0, width=4)) == "----"


def test_a_bar_shows_saturation_and_the_command():
    assert styled_text([bar(1.0, 0.0, 1.0, width=8, saturated=True)], "bad") == "████████"
    assert line_text(bar(0.0, 0.0, 1.0, width=8, command=0.5))[4] == "│"


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


def test_nothing_is_not_below_nothing():
    assert rows(-0.04)[5] == "▶    0.0 "
    assert rows(-0.06)[5] == "▶   -0.1 "


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


SETTINGS = settings(deadline=None, max_examples=60)
widths = st.integers(1, 120)
LEVEL = (1.0, 0.0, 0.0, 0.0)


@SETTINGS
@given(widths, st.integers(1, 40), st.tuples(any_number, any_number, any_number, any_number))
def test_a_horizon_has_the_size_asked_for_whatever_the_quaternion(width, height, q):
    lines = horizon(q, width=width, height=height)
    assert len(lines) == height
    assert all(len(line_text(line)) == width for line in lines)


def horizon_rows(q, width=41, height=21):
    """Row of the uppermost ground at the left and right edge."""
    rows = {}
    for row, line in enumerate(horizon(q, width=width, height=height)):
        styles = [style for part, style in line for _ in part]
        for edge in (0, width - 1):
            if styles[edge] != "sky":
                rows.setdefault(edge, row)
    return rows[0], rows[width - 1]


def test_rolling_right_raises_the_right_end_of_the_horizon():
    left, right = horizon_rows(quaternion_from_euler(math.radians(15), 0.0, 0.0))
    assert left > right
    level = horizon_rows(LEVEL)
    assert level[0] == level[1]


def test_pitching_up_lowers_the_horizon():
    up = horizon_rows(quaternion_from_euler(0.0, math.radians(10), 0.0))
    assert up[0] > horizon_rows(LEVEL)[0]


def ground_share(q, width=40, height=20):
    """Share of the view that is ground, and True if sky is in view, too."""
    lines = horizon(q, width=width, height=height)
    return len(styled_text(lines, "ground")) / (width * height), bool(styled_text(lines, "sky"))


def test_the_view_is_filled_and_ground_is_told_from_sky_without_colours():
    lines = horizon(LEVEL, width=40, height=20)
    assert styled_text(lines[:8], "sky") == " " * 320
    assert "·" in styled_text(lines[12:], "ground")
    assert not styled_text(lines[:8], "ground")
    assert not styled_text(lines[12:], "sky")


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0, -2.0])
@pytest.mark.parametrize("roll", [0.0, 0.5, -2.5, math.pi])
@pytest.mark.parametrize(("pitch", "low", "high"), [(-90, 0.85, 1), (-89.999, 0.85, 1), (90, 0, 0), (89.999, 0, 0)])
def test_straight_down_is_ground_and_straight_up_is_sky_at_any_roll_and_yaw(pitch, low, high, roll, yaw):
    share, _ = ground_share(quaternion_from_euler(roll, math.radians(pitch), yaw))
    assert low <= share <= high


def test_the_view_changes_little_where_euler_angles_jump():
    """A hover that wobbles about nose-up: roll and yaw swing by half a turn, the view hardly moves."""
    for tilt in ((0.0, 0.002), (0.002, 0.0), (-0.002, 0.0), (0.0, -0.002)):
        up = quaternion_from_euler(tilt[0], math.pi / 2 + tilt[1], 0.0)
        share, in_view = ground_share(displayed(up, SHOW_PITCHED_DOWN))
        assert share == pytest.approx(0.49, abs=0.06)
        assert in_view


def test_upside_down_has_the_ground_above():
    lines = horizon(quaternion_from_euler(math.pi, 0.0, 0.0), width=40, height=20)
    assert styled_text(lines[:8], "ground").strip()
    assert not styled_text(lines[12:], "ground").strip()


@pytest.mark.parametrize(
    ("roll", "pitch", "arrow", "words"),
    [
        (0, 60, "↓", "SKY"),
        (0, -60, "↑", "GROUND"),
        (180, 60, "↑", "SKY"),
        (90, 60, "→", "SKY"),
        (-90, 60, "←", "SKY"),
    ],
)
def test_without_a_horizon_in_view_an_arrow_points_to_it(roll, pitch, arrow, words):
    lines = horizon(quaternion_from_euler(math.radians(roll), math.radians(pitch), 0.3), width=40, height=20)
    assert words in line_text(lines[0])
    assert lines_text(lines).count(arrow) == 1


def test_a_sliver_of_the_other_side_is_a_horizon_in_view():
    slivers = 0
    for pitch in range(40):
        lines = horizon(quaternion_from_euler(0.0, math.radians(-pitch), 0.0), width=40, height=4)
        text = lines_text(lines)
        sky = bool(styled_text(lines, "sky") or styled_text(lines, "ground-on-sky"))
        assert ("GROUND" in text) == (not sky)
        slivers += not styled_text(lines, "sky") and sky
    assert slivers  # some of them have no whole cell of sky


@given(*[st.floats(-1, 1)] * 4)
def test_the_view_does_not_depend_on_sign_or_length_of_the_quaternion(w, x, y, z):
    q = (w, x, y, z)
    if sum(c * c for c in q) > 0.01:
        other = horizon(tuple(-2.0 * c for c in q), width=12, height=6)
        dots = zip(lines_text(horizon(q, width=12, height=6)), lines_text(other), strict=True)
        assert sum(a != b for a, b in dots) <= 2  # a dot on the edge may be drawn or not


@SETTINGS
@given(any_number, widths)
def test_a_heading_tape_has_the_width_asked_for(heading, width):
    assert len(line_text(heading_tape(heading, width))) == width


@pytest.mark.parametrize(("degrees", "words"), [(0, "[000°]"), (359.7, "[000°]"), (90, "[090°]"), (-90, "[270°]")])
def test_a_heading_tape_shows_the_heading_in_degrees(degrees, words):
    assert words in line_text(heading_tape(math.radians(degrees), 31))


@pytest.mark.parametrize("width", [9, 15, 24, 31, 46])
def test_a_direction_is_whole_on_the_tape_or_left_out(width):
    """Of NW, cut at an end or by the number, an N would be left."""
    for degrees in range(360):
        tape = line_text(heading_tape(math.radians(degrees), width))
        for shown in re.finditer("[NESW]+", tape):
            direction = next(at for at, name in DIRECTION_NAMES.items() if name == shown[0])
            off = (shown.start() - width // 2) * DEGREES_PER_CELL
            assert abs(math.remainder(degrees + off - direction, 360.0)) <= DEGREES_PER_CELL / 2 + 1e-6


def test_east_is_to_the_right_of_north_on_the_tape():
    tape = line_text(heading_tape(math.radians(45), 61))
    assert tape.index("N") < tape.index("[045°]") < tape.index("E")
