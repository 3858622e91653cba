"""Drawing as text: every line as wide as asked, nothing raises, and the pictures say what they should."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.render.attitude import attitude, compass
from darko_gcs.render.bars import bar
from darko_gcs.render.canvas import Braille
from darko_gcs.render.chart import log_chart
from darko_gcs.render.map import draw_map
from protocol.frames import HOVER_DISPLAY, displayed, quaternion_from_euler

SETTINGS = settings(deadline=None, max_examples=60)
widths, heights = st.integers(1, 120), st.integers(1, 40)
anything = st.floats(allow_nan=True, allow_infinity=True)
LEVEL = (1.0, 0.0, 0.0, 0.0)


def text(line):
    return "".join(part for part, _ in line)


def shown(lines):
    return "\n".join(text(line) for line in lines)


def styled(lines, style):
    return "".join(part for line in lines for part, name in line if name == style)


@SETTINGS
@given(widths, heights, st.lists(st.tuples(st.floats(0, 100), anything), max_size=40), st.lists(anything, max_size=3))
def test_a_chart_keeps_its_size_whatever_is_in_it(width, height, points, thresholds):
    points.sort(key=lambda point: point[0])
    lines = log_chart(
        [t for t, _ in points], ([v for _, v in points], "track"), width=width, height=height, window=60.0,
        thresholds=[(v, "x") for v in thresholds if v > 0.0], jumps=[(50.0, "j")], now=100.0,
    )  # fmt: skip
    assert len(lines) <= max(height, 1)
    assert all(len(text(line)) <= width for line in lines)


def test_a_chart_names_its_decades_thresholds_and_jumps():
    times = [t / 10 for t in range(600)]
    lines = log_chart(
        times, ([10.0 ** (2 - t / 20) for t in times], "track"), width=60, height=16, window=60.0,
        thresholds=((100.0, "leave 100"), (50.0, "enter 50")), jumps=((30.0, "enter"),), now=60.0,
    )  # fmt: skip
    for words in ("100", "0.1", "leave 100", "enter 50", "-60 s", "now"):
        assert words in shown(lines)
    assert len(styled(lines, "mark")) >= 10


def test_an_empty_chart_says_so():
    assert "no data yet" in shown(log_chart([], ([], "track"), width=60, height=10, window=60.0, now=0.0))


def test_a_chart_falls_where_the_value_falls():
    lines = log_chart([0.0, 60.0], ([1000.0, 1.0], "track"), width=45, height=10, window=60.0, now=60.0)
    columns = [
        min(text(line)[5:].find(c) for c in text(line)[5:] if c > "⠀")
        for line in lines[:-1]
        if any(c > "⠀" for c in text(line)[5:])
    ]
    assert columns == sorted(columns)


@SETTINGS
@given(st.one_of(st.none(), anything), widths, st.booleans(), st.one_of(st.none(), anything))
def test_a_bar_keeps_its_width(value, width, saturated, command):
    assert len(text(bar(value, -1.0, 1.0, width=width, command=command, saturated=saturated, centre=0.0))) == width


def test_a_bar_fills_from_its_beginning_or_its_centre():
    assert text(bar(0.5, 0.0, 1.0, width=8)) == "████    "
    assert text(bar(0.25, 0.0, 1.0, width=2)) == "▌ "
    assert text(bar(1.0, -1.0, 1.0, width=8, centre=0.0)) == "    ████"
    assert text(bar(-1.0, -1.0, 1.0, width=8, centre=0.0)) == "████    "
    assert text(bar(math.nan, 0.0, 1.0, width=4)) == "----"


def test_a_bar_shows_saturation_and_the_command():
    assert styled([bar(1.0, 0.0, 1.0, width=8, saturated=True)], "bad") == "████████"
    assert text(bar(0.0, 0.0, 1.0, width=8, command=0.5))[4] == "│"


@SETTINGS
@given(widths, heights, st.tuples(anything, anything, anything, anything))
def test_a_horizon_keeps_its_size_for_any_quaternion(width, height, q):
    lines = attitude(q, width=width, height=height)
    assert len(lines) == height
    assert all(len(text(line)) == width for line in lines)


def horizon_rows(q, width=41, height=21):
    """Row of the horizon line at the left and right edge."""
    lines = attitude(q, width=width, height=height)
    rows = {}
    for edge in (0, width - 1):
        for row, line in enumerate(lines):
            at = 0
            for part, style in line:
                if at <= edge < at + len(part) and style == "accent":
                    rows.setdefault(edge, row)
                at += len(part)
    return rows[0], rows[width - 1]


def test_rolling_right_tilts_the_horizon_up_on_the_right():
    left, right = horizon_rows(quaternion_from_euler(math.radians(15), 0.0, 0.0))
    assert left > right
    level = horizon_rows(LEVEL)
    assert level[0] == level[1]


def test_pitching_up_lowers_the_horizon():
    up = horizon_rows(quaternion_from_euler(0.0, math.radians(10), 0.0))
    assert up[0] > horizon_rows(LEVEL)[0]


def ground_of(q, width=40, height=20):
    """Share of the view that is ground, and whether the horizon is in it."""
    lines = attitude(q, width=width, height=height)
    ground = sum(
        len(text(line)) - text(line).count(" ") for line in [[p for p in line if p[1] == "plan"] for line in lines]
    )
    return ground / (width * height), bool(styled(lines, "accent"))


@pytest.mark.parametrize("yaw", [0.0, 1.0, 3.0, -2.0])
@pytest.mark.parametrize("roll", [0.0, 0.5, -2.5, math.pi])
@pytest.mark.parametrize(("pitch", "least", "most"), [(-90, 0.85, 1), (-89.999, 0.85, 1), (90, 0, 0), (89.999, 0, 0)])
def test_straight_down_is_ground_and_straight_up_is_sky_whatever_roll_and_yaw(pitch, least, most, roll, yaw):
    share, _ = ground_of(quaternion_from_euler(roll, math.radians(pitch), yaw))
    assert least <= share <= most


def test_the_picture_changes_little_where_euler_angles_jump():
    """A hover that wobbles about nose-up: roll and yaw swing by half a turn, the picture hardly moves."""
    for tilt in ((0.0, 0.002), (0.002, 0.0), (-0.002, 0.0), (0.0, -0.002)):
        up = quaternion_from_euler(tilt[0], math.pi / 2 + tilt[1], 0.0)
        share, horizon = ground_of(displayed(up, HOVER_DISPLAY))
        assert share == pytest.approx(0.47, abs=0.06)
        assert horizon


def test_upside_down_has_the_ground_above():
    lines = attitude(quaternion_from_euler(math.pi, 0.0, 0.0), width=40, height=20)
    assert styled(lines[:8], "plan").strip()
    assert not styled(lines[12:], "plan").strip()


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
    lines = attitude(quaternion_from_euler(math.radians(roll), math.radians(pitch), 0.3), width=40, height=20)
    assert words in text(lines[0])
    assert styled(lines, "accent") == arrow


@given(*[st.floats(-1, 1)] * 4)
def test_a_picture_does_not_depend_on_the_quaternions_sign_or_length(w, x, y, z):
    q = (w, x, y, z)
    if sum(c * c for c in q) > 0.01:
        turned = attitude(tuple(-2.0 * c for c in q), width=12, height=6)
        dots = zip(shown(attitude(q, width=12, height=6)), shown(turned), strict=True)
        assert sum(a != b for a, b in dots) <= 2  # a dot on the edge may fall either way


@SETTINGS
@given(anything, widths)
def test_a_compass_keeps_its_width(heading, width):
    assert len(text(compass(heading, width))) == width


@pytest.mark.parametrize(("degrees", "words"), [(0, "[000°]"), (359.7, "[000°]"), (90, "[090°]"), (-90, "[270°]")])
def test_a_compass_says_its_heading(degrees, words):
    assert words in text(compass(math.radians(degrees), 31))


def test_east_is_to_the_right_of_north_on_the_tape():
    tape = text(compass(math.radians(45), 61))
    assert tape.index("N") < tape.index("[045°]") < tape.index("E")


points = st.tuples(anything, anything)


@SETTINGS
@given(widths, heights, st.lists(points, max_size=8), st.one_of(st.none(), st.tuples(anything, anything, anything)))
def test_a_map_keeps_its_size_whatever_is_on_it(width, height, track, vehicle):
    lines, scale = draw_map(
        width=width, height=height, scale=None, centre=None, home=(0.0, 0.0), track=track, waypoints=[],
        vehicle=vehicle, target=None,
    )  # fmt: skip
    assert len(lines) == height
    assert all(len(text(line)) == width for line in lines)
    assert scale > 0.0


def test_a_map_has_one_scale_for_both_directions():
    waypoints = [(1, 0.0, 0.0, "todo"), (2, 20.0, 0.0, "current"), (3, 0.0, 20.0, "done")]
    lines, scale = draw_map(
        width=80, height=30, scale=2.0, centre=(10.0, 10.0), home=None, track=(), waypoints=waypoints, vehicle=None,
        target=None,
    )  # fmt: skip
    where = {c: (row, text(line).index(c)) for row, line in enumerate(lines) for c in "123" if c in text(line)[:79]}
    assert scale == 2.0
    assert where["1"][0] - where["2"][0] == 10  # 20 m north at 2 m a cell
    assert where["3"][1] - where["1"][1] == 20  # 20 m east at 1 m a cell


def test_a_map_fits_everything_and_points_the_vehicle():
    lines, _ = draw_map(
        width=60, height=20, scale=None, centre=None, home=(0.0, 0.0), track=((0.0, 0.0), (300.0, 40.0)),
        waypoints=[(7, 300.0, 40.0, "todo")], vehicle=(150.0, 20.0, math.pi / 2), target=(0.0, 40.0),
    )  # fmt: skip
    for words in ("H", "7", "→", "+", "N↑", " m"):
        assert words in shown(lines)


def test_a_circle_is_as_wide_as_its_radius_and_fits():
    lines, scale = draw_map(
        width=60, height=30, scale=None, centre=None, home=None, track=(), waypoints=[], vehicle=None, target=None,
        circles=[(0.0, 0.0, 25.0, "current")],
    )  # fmt: skip
    rows = [row for row, line in enumerate(lines) if styled([line], "warn")]
    assert (rows[-1] - rows[0] + 1) * scale == pytest.approx(50.0, abs=2 * scale)
    assert len(rows) < 30


@SETTINGS
@given(st.tuples(anything, anything, anything), st.tuples(anything, anything))
def test_no_circle_or_course_breaks_a_map(circle, course):
    lines, _ = draw_map(
        width=20, height=8, scale=None, centre=None, home=None, track=(), waypoints=[], vehicle=(0.0, 0.0, 0.0),
        target=None, circles=[(*circle, "todo")], course=course,
    )  # fmt: skip
    assert [len(text(line)) for line in lines] == [20] * 8


def test_the_leg_being_flown_and_the_course_stand_out():
    waypoints = [(1, 0.0, 0.0, "done"), (2, 40.0, 0.0, "current"), (3, 40.0, 40.0, "todo")]
    lines, _ = draw_map(
        width=40, height=20, scale=4.0, centre=(20.0, 20.0), home=None, track=(), waypoints=waypoints,
        vehicle=(10.0, 0.0, 0.0), target=None, course=(10.0, 30.0),
    )  # fmt: skip
    assert len(styled(lines, "warn")) > 5
    assert len(styled(lines, "plan")) > 5
    assert len(styled(lines, "bad")) > 5


@given(st.lists(st.tuples(anything, anything), max_size=20))
def test_dots_outside_a_canvas_are_left_out(dots):
    canvas = Braille(3, 2)
    for x, y in dots:
        canvas.plot(x, y)
        canvas.line(x, y, 1.0, 1.0)
    assert [len(text(line)) for line in canvas.lines()] == [3, 3]


def test_dots_stand_where_they_are_put():
    canvas = Braille(1, 1)
    canvas.plot(0, 0)
    canvas.plot(1, 3)
    assert shown(canvas.lines()) == "⢁"
