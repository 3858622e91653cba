"""A flight plan: waypoints, sectors, variables, exceptions and blocks with their stages, as its file holds them."""

import pytest

from protocol.flight_plans.flight_plan import inside_polygon

TRIANGLE = [(0.0, 0.0), (4.0, 0.0), (0.0, 4.0)]
DIAMOND = [(0.0, -2.0), (2.0, 0.0), (0.0, 2.0), (-2.0, 0.0)]
HORSESHOE = [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (4.0, 4.0), (4.0, 2.0), (2.0, 2.0), (2.0, 4.0), (0.0, 4.0)]


@pytest.mark.parametrize(
    ("corners", "east", "north", "is_inside"),
    [
        (TRIANGLE, 2.9, 1.0, True),
        (TRIANGLE, 3.1, 1.0, False),
        (TRIANGLE, 0.9, 3.0, True),
        (TRIANGLE, 1.1, 3.0, False),
        (TRIANGLE, -0.1, 1.0, False),
        (TRIANGLE, 1.0, -0.1, False),
        (HORSESHOE, 1.0, 3.0, True),
        (HORSESHOE, 3.0, 3.0, False),
        (HORSESHOE, 5.0, 3.0, True),
        (HORSESHOE, 3.0, 1.0, True),
    ],
)
def test_a_point_is_inside_or_outside(corners, east, north, is_inside):
    assert inside_polygon(corners, east, north) is is_inside
    assert inside_polygon(corners[::-1], east, north) is is_inside


@pytest.mark.parametrize(("east", "is_inside"), [(-3.0, False), (-1.0, True), (1.0, True), (3.0, False)])
def test_a_point_level_with_corners_crosses_them_once(east, is_inside):
    assert inside_polygon(DIAMOND, east, 0.0) is is_inside
