"""Maps in braille: home, fence, rally points, legs, circles, tracks, vehicles; north up, one scale for both axes."""

import math
import random
import re

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from darko_gcs.tui.render.map_drawing import MapBackground, MapFlight, draw_pair_map
from tests.support.gcs.maps import drawn_map
from tests.support.gcs.screens import line_text, lines_text, styled_text

AREAS = [(((-20.0, -20.0), (60.0, -20.0), (60.0, 60.0)), "fence")]
WAYPOINTS = [(1, 10.0, 10.0, "done"), (2, 50.0, 40.0, "current")]


def drawing(track, background=None, **other):
    vehicle = (*track[-1], 1.0) if track else None
    given = {"home": (0.0, 0.0), "waypoints": WAYPOINTS, "areas": AREAS}
    given |= {"labels": [("P1", (30.0, 30.0), "plan")], "predicted": ((50.0, 50.0), (70.0, 70.0))} | other
    return drawn_map(width=40, height=20, track=track, vehicle=vehicle, background=background, **given)


def test_a_track_that_grows_is_drawn_as_at_once():
    source, track, background = random.Random(3), [(0.0, 0.0)], MapBackground()
    for _ in range(60):
        north, east = track[-1]
        track += [(north + source.uniform(-1, 4), east + source.uniform(-3, 6)) for _ in range(source.randrange(4))]
        assert drawing(track, background) == drawing(track)


def test_another_track_scale_or_plan_is_drawn_anew():
    background, track = MapBackground(), [(float(k), float(k * k) / 9) for k in range(30)]
    for shown, other in (
        (track, {}), (track[5:], {}), (track[5:20], {}), ([(9.0, 1.0), *track[6:20]], {}), (track, {"scale": 4.0}),
        (track, {"scale": 4.0, "centre": (3.0, 3.0)}), (track, {"waypoints": WAYPOINTS[:1]}), ([], {}), (track, {}),
        ([*track, (math.nan, 1.0), (math.inf, 0.0), (40.0, 99.0)], {}), (track, {"areas": []}),
    ):  # fmt: skip
        assert drawing(shown, background, **other) == drawing(shown, **other)


def test_the_vehicle_leaves_nothing_behind():
    background = MapBackground()
    drawing([(0.0, 0.0), (0.0, 20.0)], background)
    lines, _ = drawing([(0.0, 0.0), (0.0, 20.0), (30.0, 20.0)], background)
    assert sum(lines_text(lines).count(arrow) for arrow in "↑↗→↘↓↙←↖") == 2  # the vehicle's, and that of "N↑"


SETTINGS = settings(deadline=None, max_examples=60)
any_number = st.floats(allow_nan=True, allow_infinity=True)
points = st.tuples(any_number, any_number)


@SETTINGS
@given(
    st.integers(1, 120), st.integers(1, 40), st.lists(points, max_size=8),
    st.one_of(st.none(), st.tuples(any_number, any_number, any_number)),
)  # fmt: skip
def test_a_map_has_the_size_asked_for_whatever_is_on_it(width, height, track, vehicle):
    drawn = {"home": (0.0, 0.0), "track": track, "vehicle": vehicle}
    lines, (scale, _) = drawn_map(width=width, height=height, **drawn)
    assert len(lines) == height
    assert all(len(line_text(line)) == width for line in lines)
    assert scale > 0.0


def test_a_map_has_one_scale_for_both_directions():
    waypoints = [(1, 0.0, 0.0, "todo"), (2, 20.0, 0.0, "current"), (3, 0.0, 20.0, "done")]
    drawn = {"scale": 2.0, "centre": (10.0, 10.0), "waypoints": waypoints}
    lines, (scale, _) = drawn_map(width=80, height=30, **drawn)
    texts = [line_text(line) for line in lines]
    at = {c: (row, text.index(c)) for row, text in enumerate(texts) for c in "123" if c in text[:79]}
    assert scale == 2.0
    assert at["1"][0] - at["2"][0] == 10  # 20 m north at 2 m a cell
    assert at["3"][1] - at["1"][1] == 20  # 20 m east at 1 m a cell


def test_a_map_fits_everything_and_points_the_vehicle():
    drawn = {
        "home": (0.0, 0.0), "track": ((0.0, 0.0), (300.0, 40.0)), "waypoints": [(7, 300.0, 40.0, "todo")],
        "vehicle": (150.0, 20.0, math.pi / 2), "target": (0.0, 40.0),
    }  # fmt: skip
    lines, _ = drawn_map(width=60, height=20, **drawn)
    for words in ("H", "7", "→", "+", "N↑", " m"):
        assert words in lines_text(lines)


def test_a_circle_is_as_wide_as_its_radius_and_fits():
    lines, (scale, _) = drawn_map(width=60, height=30, circles=[(0.0, 0.0, 25.0, "current")])
    rows = [row for row, line in enumerate(lines) if styled_text([line], "now")]
    assert (rows[-1] - rows[0] + 1) * scale == pytest.approx(50.0, abs=2 * scale)
    assert len(rows) < 30


@SETTINGS
@given(st.tuples(any_number, any_number, any_number), points, points)
def test_no_circle_prediction_or_wind_breaks_a_map(circle, place, wind):
    drawn = {"vehicle": (0.0, 0.0, 0.0), "predicted": [(0.0, 0.0), place], "wind": wind}
    drawn["overlay"] = [("a", (place, (1.0, 1.0)), "label")]
    lines, _ = drawn_map(width=20, height=8, circles=[(*circle, "todo")], **drawn)
    assert [len(line_text(line)) for line in lines] == [20] * 8


def test_the_leg_being_flown_and_the_predicted_path_stand_out():
    waypoints = [(1, 0.0, 0.0, "done"), (2, 40.0, 0.0, "current"), (3, 40.0, 40.0, "todo")]
    drawn = {"scale": 4.0, "centre": (20.0, 20.0), "waypoints": waypoints, "vehicle": (10.0, 0.0, 0.0)}
    lines, _ = drawn_map(
        width=40, height=20, track=[(0.0, 0.0), (10.0, 0.0)], predicted=[(10.0, 0.0), (10.0, 60.0)], **drawn
    )
    assert len(styled_text(lines, "now")) > 5
    assert len(styled_text(lines, "plan")) > 5
    dots = [bin(ord(cell) - 0x2800).count("1") for cell in styled_text(lines, "accent") if "\u2800" <= cell <= "\u28ff"]
    assert len(dots) > 5
    assert max(dots) == 1  # dotted: a line has two in each cell
    assert line_text(lines[-1]).endswith("planned flown predicted")
    assert "flown" in styled_text(lines[-1:], "track")


def test_the_legend_names_what_is_drawn_where_there_is_room():
    flown = {"track": [(0.0, 0.0), (9.0, 9.0)]}
    assert line_text(drawn_map(width=40, height=10, **flown)[0][-1]).endswith("  flown")
    assert "flown" not in line_text(drawn_map(width=15, height=10, **flown)[0][-1])


def test_no_label_shows_between_the_words_of_the_legend():
    drawn = {"scale": 1.0, "centre": (0.0, 0.0), "labels": [("x" * 40, (-4.5, -9.75), "plan")]}
    waypoints = [(1, 0.0, 0.0, "todo"), (2, 3.0, 3.0, "todo")]
    lines, _ = drawn_map(width=40, height=10, track=[(0.0, 0.0), (2.0, 2.0)], waypoints=waypoints, **drawn)
    assert line_text(lines[-1]).endswith("  planned flown")
    assert "x" not in lines_text(lines)


def test_wind_and_the_pilots_shapes_are_drawn_and_do_not_change_the_scale():
    shapes = [
        ("Hangar", ((0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 0.0)), "mark"),
        ("Pilot", ((5.0, -5.0),), "label"),
    ]
    drawn = {"home": (0.0, 0.0), "rally": [(10.0, 10.0)]}
    lines, view = drawn_map(width=60, height=20, overlay=shapes, wind=(0.0, 4.0), **drawn)
    text = lines_text(lines)
    assert line_text(lines[0]).startswith("→ wind 4.0 m/s")
    assert "•Pilot" in text
    assert len(styled_text(lines, "mark")) > 5
    assert view == drawn_map(width=60, height=20, **drawn)[1]


def test_a_map_of_one_place_shows_what_is_about_it():
    assert drawn_map(width=60, height=20, vehicle=(3.0, 3.0, 0.0))[1].scale == pytest.approx(5.0)  # 60 m of 20 rows
    assert drawn_map(width=60, height=20, vehicle=(3.0, 3.0, 0.0), home=(0.0, 0.0))[1].scale < 0.6


def test_a_label_does_not_write_over_another_one():
    """The last one is whole; of one that it would lie on the mark is left, and of one in its very place nothing."""
    labels = [("·under", (0.0, 0.0), "plan"), ("·before", (0.0, -2.0), "plan"), ("◆here", (0.0, 0.0), "warn")]
    drawn = {"scale": 1.0, "centre": (0.0, 0.0)}
    text = lines_text(drawn_map(width=60, height=10, labels=labels, **drawn)[0])
    assert "·   ◆here" in text


def test_no_text_on_the_map_runs_into_another_one():
    """Home keeps its place and an item's label stands beside it; a neighbour's label shrinks, none reads "05 541"."""
    waypoints = [(0, 0.0, 0.0, "todo"), (5, 0.0, 6.0, "current"), (12, 4.0, 9.0, "todo"), (13, 4.0, 10.5, "todo")]
    labels = [(f"{n} 41m", (north, east), "dim") for n, north, east, _ in waypoints]
    drawn = {"scale": 1.0, "centre": (0.0, 0.0), "home": (0.0, 0.0), "waypoints": waypoints, "labels": labels}
    lines, _ = drawn_map(width=60, height=16, rally=[(0.0, 0.5)], **drawn)
    words = "".join(" " if "\u2800" <= c <= "\u28ff" else c for c in lines_text(lines)).split()
    assert words == ["N↑", "12", "13", "41m", "H", "0", "41m", "5", "41m", "├──┤", "2", "m", "planned"]


@pytest.mark.parametrize(("scale", "bar"), [(1.0, " 2 m"), (600.0, " 1 km"), (10_000.0, " 20 km")])
def test_long_scales_are_in_kilometres(scale, bar):
    lines, _ = drawn_map(width=40, height=10, scale=scale, centre=(0.0, 0.0))
    assert line_text(lines[-1]).rstrip().endswith(f"┤{bar}")


def text(flights, width=40, height=10):
    return ["".join(segment for segment, _ in line) for line in draw_pair_map(flights, width, height)]


def test_each_vehicle_is_an_arrow_with_its_letter_where_it_is():
    a = MapFlight("A", "hover", [(0.0, 0.0), (0.0, 50.0)], (0.0, 50.0, math.radians(90.0)))
    b = MapFlight("B", "forward", [(0.0, 0.0), (30.0, 0.0)], (30.0, 0.0, 0.0))
    rows = text([a, b])
    (row_a,) = (number for number, row in enumerate(rows) if "→A" in row)
    (row_b,) = (number for number, row in enumerate(rows) if "↑B" in row)
    assert row_b < row_a
    assert rows[row_b].index("↑B") < rows[row_a].index("→A")
    assert "m a row" in rows[-1]


def test_places_that_are_no_numbers_are_left_out():
    a = MapFlight("A", "hover", [(math.nan, 0.0), (0.0, 0.0)], (math.inf, 0.0, 0.0))
    rows = text([a, MapFlight("B", "forward", [], None)])
    assert not any("A" in row or "B" in row for row in rows)


def test_the_legend_leaves_out_whole_names_where_there_is_no_room():
    shown = {}
    for width in (40, 20, 17, 12):
        lines = drawn_map(width, 8, track=[(0.0, 0.0), (1.0, 1.0)], waypoints=WAYPOINTS)[0]
        shown[width] = line_text(lines[-1])
    assert "planned flown" in shown[40]
    assert all(word in {"planned", "flown"} for line in shown.values() for word in re.findall("[a-z]{3,}", line))
