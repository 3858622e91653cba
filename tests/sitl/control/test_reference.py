"""Paths of forward flight: where their line of sight points, how far off them and how high a place is."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.control.reference import (
    MIN_AHEAD,
    TIME_AHEAD,
    along,
    at,
    circle,
    cross_track,
    height,
    hover_at,
    leg,
    line_of_sight,
    progress,
    upright,
)
from sitl.model.vectors import Vector, add_scaled, level_norm, norm, subtract

coordinates = st.floats(-300.0, 300.0)
places = st.builds(Vector, coordinates, coordinates, st.floats(5.0, 80.0))
speeds = st.floats(0.0, 22.0)
ABOVE = Vector(0.0, 0.0, 30.0)


@st.composite
def legs(draw):
    """A leg of 10 to 300 m in any direction."""
    start, azimuth = draw(places), draw(st.floats(-math.pi, math.pi))
    length, climb = draw(st.floats(10.0, 300.0)), draw(st.floats(-20.0, 20.0))
    end = add_scaled(start, Vector(length * math.cos(azimuth), length * math.sin(azimuth), climb), 1.0)
    return leg(start, end, 15.0, level=draw(st.floats(0.0, 0.5)) * length)


def along_and_left(path):
    """Level unit vectors of a leg, and its length."""
    length = level_norm(path.end.x - path.start.x, path.end.y - path.start.y)
    forward = np.array(((path.end.x - path.start.x) / length, (path.end.y - path.start.y) / length))
    return forward, np.array((-forward[1], forward[0])), length


def beside(path, along, left=0.0):
    """The place so far along a leg and to its left, at sea level."""
    forward, side, _ = along_and_left(path)
    return Vector(*(path.start[:2] + along * forward + left * side).tolist(), 0.0)


@given(path=legs(), p=places, speed=speeds)
def test_the_line_of_sight_of_a_leg_is_a_unit_vector_that_never_points_back(path, p, speed):
    sight = np.array(line_of_sight(path, p, speed))
    forward, left, _ = along_and_left(path)
    assert np.linalg.norm(sight) == pytest.approx(1.0)
    assert sight @ forward > 0.0
    assert (sight @ left) * cross_track(path, p) <= 0.0  # towards the leg, from either side


@given(path=legs(), p=places, speed=speeds, north=st.floats(-1, 1), west=st.floats(-1, 1))
def test_the_line_of_sight_of_a_leg_turns_no_faster_than_the_distance_ahead_allows(path, p, speed, north, west):
    """So it never jumps: before the start, abeam of any part of the leg, and beyond its end."""
    moved = Vector(p.x + north, p.y + west, p.z)
    turned = np.linalg.norm(np.subtract(line_of_sight(path, moved, speed), line_of_sight(path, p, speed)))
    assert turned <= math.hypot(north, west) / max(TIME_AHEAD * speed, MIN_AHEAD) + 1e-9


@pytest.mark.parametrize(("speed", "ahead"), [(0.0, 8.0), (4.0, 8.0), (10.0, 20.0)])
def test_the_line_of_sight_meets_the_leg_two_seconds_ahead_and_eight_metres_at_least(speed, ahead):
    path = leg((0.0, 0.0, 5.0), (300.0, 0.0, 5.0), 12.0)
    north, west = line_of_sight(path, Vector(50.0, 3.0, 5.0), speed)
    assert (north, west) == pytest.approx((ahead / math.hypot(ahead, 3.0), -3.0 / math.hypot(ahead, 3.0)))


def test_a_leg_without_length_has_no_line_of_sight_where_it_ends():
    path = hover_at((3.0, 4.0, 5.0), 0.0).path
    assert line_of_sight(path, path.end, 10.0) == (0.0, 0.0)
    assert line_of_sight(path, Vector(3.0, 0.0, 5.0), 10.0) == pytest.approx((0.0, 1.0))
    assert progress(path, ABOVE) == (0.0, 0.0, 0.0)
    assert height(path, ABOVE) == (5.0, 0.0)


@given(path=legs(), off=st.floats(-50.0, 50.0), share=st.floats(-0.5, 1.5))
def test_cross_track_is_the_distance_to_the_left_of_a_leg(path, off, share):
    length = along_and_left(path)[2]
    p = beside(path, share * length, off)
    assert cross_track(path, p) == pytest.approx(off, abs=1e-9)
    assert progress(path, p) == pytest.approx((share * length, length, off), abs=1e-9)


@given(path=legs(), share=st.floats(-0.5, 1.5))
def test_the_height_of_a_leg_is_continuous_and_its_slope_is_its_derivative(path, share):
    x = share * along_and_left(path)[2]
    z, slope = height(path, beside(path, x))
    ahead, slope_ahead = height(path, beside(path, x + 1e-3))
    assert abs(ahead - z) <= 1e-3 * max(abs(slope), abs(slope_ahead)) + 1e-9
    if slope == slope_ahead:
        assert (ahead - z) / 1e-3 == pytest.approx(slope, abs=1e-6)
    assert min(path.start.z, path.end.z) - 1e-9 <= z <= max(path.start.z, path.end.z) + 1e-9


def test_a_leg_that_ends_low_is_level_before_its_end_and_so_far_below_it():
    path = leg((0, 0, 20), (100, 0, 30), 15, level=40, low=1.2)
    assert height(path, Vector(0.0, 0.0, 0.0)) == pytest.approx((20.0, 0.0))
    assert height(path, Vector(30.0, 0.0, 0.0)) == pytest.approx((24.4, 8.8 / 60.0))
    for x in (60.1, 80.0, 100.0, 130.0):
        assert height(path, Vector(x, 0.0, 0.0)) == pytest.approx((28.8, 0.0))


@given(radius=st.floats(15.0, 100.0), turn=st.sampled_from((1.0, -1.0)), p=places, speed=speeds)
def test_the_line_of_sight_of_a_circle_is_a_unit_vector_in_its_sense(radius, turn, p, speed):
    path = circle((10.0, -20.0, 30.0), turn * radius, 15.0)
    away = subtract(p, path.start)
    assume(level_norm(away.x, away.y) > 1.0)  # at the very centre every bearing is as good
    north, west = line_of_sight(path, p, speed)
    assert math.hypot(north, west) == pytest.approx(1.0)
    assert turn * (away.x * west - away.y * north) > 0.0


@given(
    radius=st.floats(15.0, 100.0), turn=st.sampled_from((1.0, -1.0)), bearing=st.floats(-3.1, 3.1), r=st.floats(1, 200)
)
def test_cross_track_of_a_circle_is_positive_inside_a_left_turn_and_outside_a_right_one(radius, turn, bearing, r):
    path = circle((10.0, -20.0, 30.0), turn * radius, 15.0)
    p = add_scaled(path.start, Vector(r * math.cos(bearing), r * math.sin(bearing), 0.0), 1.0)
    assert cross_track(path, p) == pytest.approx(turn * (radius - r), abs=1e-9)


@given(radius=st.floats(15.0, 100.0), p=places, speed=speeds)
def test_a_right_circle_is_the_mirror_of_a_left_one(radius, p, speed):
    assume(level_norm(p.x, p.y) > 1.0)
    left, right, mirrored = circle(ABOVE, radius, 15.0), circle(ABOVE, -radius, 15.0), Vector(p.x, -p.y, p.z)
    north, west = line_of_sight(left, p, speed)
    assert (north, -west) == pytest.approx(line_of_sight(right, mirrored, speed), abs=1e-9)
    assert cross_track(left, p) == pytest.approx(-cross_track(right, mirrored))


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("start", [(0.0, 5.0), (0.0, 38.0), (0.0, 150.0)])
def test_a_point_that_follows_the_line_of_sight_settles_on_the_circle(turn, start):
    path, p, speed, dt = circle(ABOVE, turn * 40.0, 12.0), Vector(*start, 30.0), 12.0, 0.02
    for _ in range(3000):
        north, west = line_of_sight(path, p, speed)
        p = add_scaled(p, Vector(north, west, 0.0), speed * dt)
    assert abs(cross_track(path, p)) < 0.05 * 40.0


def test_upright_the_path_is_the_point_itself_whatever_was_flown_before():
    """The transition to the hover brakes to the end of the path, and levels its last metres."""
    flown = along(hover_at((1, 2, 3), 0.7, 2.5), leg((1, 2, 3), (100, 0, 40), 15, level=20, low=1.2), 0.1)
    assert (flown.position, flown.forward, flown.heading) == ((100.0, 0.0, 40.0), True, 0.1)
    for stands, end in ((upright(flown), (100.0, 0.0, 40.0)), (at(flown, (7, 8, 9)), (7.0, 8.0, 9.0))):
        assert stands == hover_at(end, 0.1, 2.5)
        assert stands.path.start == stands.path.end == end


def test_numbers_of_any_kind_make_the_same_reference():
    """Compiled code tells whole numbers from others."""
    made = hover_at(np.array((1, 2, 3)), 0), leg((1, 2, 3), np.array((4, 5, 6)), 15, level=2), circle((1, 2, 3), 4, 5)
    for path in (made[0].path, *made[1:]):
        assert all(type(x) is float for x in (*path.start, *path.end, *path[3:4], *path[5:]))
    assert all(type(x) is float for x in (*made[0].position, made[0].heading, made[0].speed))
    assert norm(subtract(made[1].end, Vector(4.0, 5.0, 6.0))) == 0.0


def test_the_line_of_sight_of_a_place_leads_to_it_from_however_near():
    path = hover_at((3.0, 4.0, 5.0), 0.0).path
    for distance in (1e-3, 0.5, 1.0):
        assert line_of_sight(path, Vector(3.0 + distance, 4.0, 0.0), 0.0) == pytest.approx((-1.0, 0.0))


def test_at_its_very_ends_a_leg_is_level():
    path = leg((0.0, 0.0, 50.0), (128.0, 0.0, 60.0), 15.0)
    assert height(path, Vector(0.0, 9.0, 0.0)) == (50.0, 0.0)
    assert height(path, Vector(128.0, 9.0, 0.0)) == (60.0, 0.0)
    assert height(path, Vector(64.0, 9.0, 0.0)) == (55.0, 10.0 / 128.0)


@pytest.mark.parametrize("radius", [0.5, 40.0])
def test_the_centre_is_to_the_left_of_a_left_circle_however_small(radius):
    centre = Vector(0.0, 0.0, 50.0)
    assert cross_track(circle(centre, radius, 15.0), centre) == radius
    assert cross_track(circle(centre, -radius, 15.0), centre) == -radius


def test_a_circle_is_level_and_a_hover_asks_for_no_rates_and_no_thrust():
    path, hover = circle((1.0, 2.0, 30.0), 20.0, 15.0), hover_at((1.0, 2.0, 3.0), 0.5)
    assert (path.level, path.low, path.stop) == (0.0, 0.0, False)
    assert hover.attitude == ((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0)
