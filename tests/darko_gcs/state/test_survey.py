"""A survey: parallel lines over an area."""

import math

import pytest

from darko_gcs.state.survey import MAX_WAYPOINTS, rectangle, survey_lines


def test_lines_of_a_rectangle_go_to_and_fro_and_lie_half_a_spacing_from_its_sides():
    places = survey_lines(rectangle((0.0, 0.0), 100.0, 40.0, 0.0), 20.0, 0.0)
    assert places == ((-50.0, -10.0), (50.0, -10.0), (50.0, 10.0), (-50.0, 10.0))


def test_lines_follow_the_heading_about_the_middle():
    places = survey_lines(rectangle((5.0, 7.0), 100.0, 40.0, math.pi / 2.0), 20.0, math.pi / 2.0)
    assert [tuple(round(part, 6) for part in place) for place in places[:2]] == [(15.0, -43.0), (15.0, 57.0)]


def test_lines_end_before_the_edge_of_a_polygon_by_the_inset_and_too_short_ones_are_left_out():
    triangle = ((0.0, 0.0), (100.0, 0.0), (0.0, 100.0))
    places = survey_lines(triangle, 20.0, 0.0, inset=10.0)
    assert len(places) == 2 * 4  # that at 90 m is 10 m long
    assert all(north >= 10.0 - 1e-9 and north + east <= 90.0 + 1e-9 for north, east in places)


@pytest.mark.parametrize(("spacing", "words"), [(1e-3, "no more than"), (500.0, "no line fits")])
def test_what_cannot_be_mown_says_why(spacing, words):
    with pytest.raises(ValueError, match=words):
        survey_lines(((0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (0.0, 10.0)), spacing, 0.0, inset=spacing / 2.0)


def test_a_survey_stays_within_the_waypoints_that_are_put_in_at_once():
    assert len(survey_lines(rectangle((0.0, 0.0), 100.0, 100.0, 0.0), 1.0, 0.0)) == MAX_WAYPOINTS
