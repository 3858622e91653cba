"""Paths of forward flight and the braking that ends them: geometry, and planned stops against the trims' limits."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.forward import sight_gains
from sitl.design.trim import braking_limit
from sitl.laws.forward_guidance import braking_speed, due_to_stop, stopping_distance, table
from sitl.laws.path import CIRCLE, LEAST_AHEAD, LEG, TIME_AHEAD, Path, aim, cross_track, height, progress

NOMINAL = load("nominal").parameters
GAINS = sight_gains().guidance
RESERVE = math.radians(4.0)  # of the elevons' travel, left over the planned braking
STILL = np.zeros(3)

coordinates = st.floats(-300.0, 300.0)
places = st.tuples(coordinates, coordinates, st.floats(5.0, 80.0)).map(np.array)
speeds = st.floats(0.0, 22.0)
winds = st.floats(-5.0, 5.0)


@st.composite
def legs(draw):
    """A leg of 10 to 300 m in any direction, and the place and unit direction it was made of."""
    start, azimuth = draw(places), draw(st.floats(-math.pi, math.pi))
    length, climb = draw(st.floats(10.0, 300.0)), draw(st.floats(-20.0, 20.0))
    end = start + np.array((length * math.cos(azimuth), length * math.sin(azimuth), climb))
    return leg(start, end, level=draw(st.floats(0.0, 0.5)) * length)


def leg(start, end, *, stop=True, airspeed=15.0, level=0.0, low=0.0):
    ends = np.array(start, dtype=float), np.array(end, dtype=float)
    return Path(LEG, *ends, 0.0, airspeed, stop=stop, level=level, low=low)


def circle(centre, radius):
    middle = np.array(centre, dtype=float)
    return Path(CIRCLE, middle, middle, radius, 15.0, stop=False, level=0.0, low=0.0)


def along_and_left(path):
    forward = (path.end - path.start)[:2]
    forward = forward / np.linalg.norm(forward)
    return forward, np.array((-forward[1], forward[0]))


@given(path=legs(), p=places, speed=speeds)
def test_the_line_of_sight_of_a_leg_is_a_unit_vector_that_never_points_back(path, p, speed):
    sight = np.array(aim(path, p, speed))
    forward, left = along_and_left(path)
    assert np.linalg.norm(sight) == pytest.approx(1.0)
    assert sight @ forward > 0.0
    assert (sight @ left) * cross_track(path, p) <= 0.0  # towards the leg, from either side


@given(path=legs(), p=places, speed=speeds, step=st.tuples(st.floats(-1, 1), st.floats(-1, 1)))
def test_the_line_of_sight_of_a_leg_turns_no_faster_than_the_distance_ahead_allows(path, p, speed, step):
    """So it never jumps: before the start, abeam of any part of the leg, and beyond its end."""
    moved = p + np.array((*step, 0.0))
    turned = np.linalg.norm(np.subtract(aim(path, moved, speed), aim(path, p, speed)))
    assert turned <= math.hypot(*step) / max(TIME_AHEAD * speed, LEAST_AHEAD) + 1e-9


@given(path=legs(), off=st.floats(-50.0, 50.0), share=st.floats(-0.5, 1.5))
def test_cross_track_is_the_distance_to_the_left_of_a_leg(path, off, share):
    forward, left = along_and_left(path)
    length = np.linalg.norm((path.end - path.start)[:2])
    p = np.array((*(path.start[:2] + share * length * forward + off * left), 0.0))
    assert cross_track(path, p) == pytest.approx(off, abs=1e-9)
    assert progress(path, p) == pytest.approx((share * length, length, off), abs=1e-9)


@given(path=legs(), share=st.floats(-0.5, 1.5))
def test_the_height_of_a_leg_is_continuous_and_its_slope_is_its_derivative(path, share):
    forward, _ = along_and_left(path)
    length = np.linalg.norm((path.end - path.start)[:2])

    def beside(x):
        return np.array((*(path.start[:2] + x * forward), 0.0))

    x = share * length
    z, slope = height(path, beside(x))
    ahead, slope_ahead = height(path, beside(x + 1e-3))
    assert abs(ahead - z) <= 1e-3 * max(abs(slope), abs(slope_ahead)) + 1e-9
    if slope == slope_ahead:
        assert (ahead - z) / 1e-3 == pytest.approx(slope, abs=1e-6)
    assert min(path.start[2], path.end[2]) - 1e-9 <= z <= max(path.start[2], path.end[2]) + 1e-9


def test_a_leg_that_ends_low_is_level_before_its_end_and_so_far_below_it():
    path = leg((0, 0, 20), (100, 0, 30), level=40.0, low=1.2)
    assert height(path, np.zeros(3)) == pytest.approx((20.0, 0.0))
    assert height(path, np.array((30.0, 0.0, 0.0))) == pytest.approx((24.4, 8.8 / 60.0))
    for x in (60.1, 80.0, 100.0, 130.0):
        assert height(path, np.array((x, 0.0, 0.0))) == pytest.approx((28.8, 0.0))


@given(radius=st.floats(15.0, 100.0), turn=st.sampled_from((1.0, -1.0)), p=places, speed=speeds)
def test_the_line_of_sight_of_a_circle_is_a_unit_vector_in_its_sense(radius, turn, p, speed):
    path = circle((10.0, -20.0, 30.0), turn * radius)
    away = (p - path.start)[:2]
    assume(np.linalg.norm(away) > 1.0)  # at the very centre every bearing is as good
    sight = np.array(aim(path, p, speed))
    assert np.linalg.norm(sight) == pytest.approx(1.0)
    assert turn * (away[0] * sight[1] - away[1] * sight[0]) > 0.0


@given(
    radius=st.floats(15.0, 100.0), turn=st.sampled_from((1.0, -1.0)), bearing=st.floats(-3.1, 3.1), r=st.floats(1, 200)
)
def test_cross_track_of_a_circle_is_positive_inside_a_left_turn_and_outside_a_right_one(radius, turn, bearing, r):
    path = circle((10.0, -20.0, 30.0), turn * radius)
    p = path.start + np.array((r * math.cos(bearing), r * math.sin(bearing), 0.0))
    assert cross_track(path, p) == pytest.approx(turn * (radius - r), abs=1e-9)


@given(radius=st.floats(15.0, 100.0), p=places, speed=speeds)
def test_a_right_circle_is_the_mirror_of_a_left_one(radius, p, speed):
    mirror = np.array((1.0, -1.0, 1.0))
    left, right = circle((0, 0, 30), radius), circle((0, 0, 30), -radius)
    assume(np.linalg.norm(p[:2]) > 1.0)
    assert np.array(aim(left, p, speed)) * mirror[:2] == pytest.approx(aim(right, p * mirror, speed), abs=1e-9)
    assert cross_track(left, p) == pytest.approx(-cross_track(right, p * mirror))


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize("start", [(0.0, 5.0), (0.0, 38.0), (0.0, 150.0)])
def test_a_point_that_follows_the_line_of_sight_settles_on_the_circle(turn, start):
    path, p, speed, dt = circle((0, 0, 30), turn * 40.0), np.array((*start, 30.0)), 12.0, 0.02
    for _ in range(3000):
        p[:2] += speed * dt * np.array(aim(path, p, speed))
    assert abs(cross_track(path, p)) < 0.05 * 40.0


@given(speed=st.floats(0.5, 20.0), tail=winds, cross=winds)
def test_the_speed_that_stops_within_a_distance_is_the_inverse_of_the_stopping_distance(speed, tail, cross):
    distance = stopping_distance(speed, tail, cross, GAINS)
    assert braking_speed(distance, 25.0, tail, cross, GAINS) == pytest.approx(speed, rel=0.03, abs=0.05)


@given(distance=st.floats(0.1, 200.0), farther=st.floats(1.0, 50.0), tail=winds, most=st.floats(4.0, 22.0))
def test_more_room_never_means_less_speed_and_never_more_than_the_cruise(distance, farther, tail, most):
    near, far = (braking_speed(d, most, tail, 0.0, GAINS) for d in (distance, distance + farther))
    assert 0.0 <= near <= far + 1e-9
    assert far <= most + 1e-9


@given(speed=st.floats(1.0, 20.0), tail=winds, share=st.floats(0.2, 3.0), azimuth=st.floats(-3.1, 3.1))
def test_a_stop_is_due_where_what_is_left_is_what_braking_takes(speed, tail, share, azimuth):
    ahead = np.array((math.cos(azimuth), math.sin(azimuth), 0.0))
    needed = stopping_distance(speed, tail, 0.0, GAINS)
    assume(abs(share - 1.0) > 0.01)
    path = leg(-400.0 * ahead, share * needed * ahead)
    assert due_to_stop(STILL, speed * ahead, tail * ahead, path, 1.0, GAINS) == (share < 1.0)
    assert due_to_stop(STILL, speed * ahead, tail * ahead, path, share * 1.01, GAINS)


@given(path=legs(), p=places)
def test_a_leg_that_goes_on_and_a_circle_are_never_stopped_and_one_overflown_always(path, p):
    v = np.array((15.0, 0.0, 0.0))
    assert not due_to_stop(p, v, STILL, path._replace(stop=False), 10.0, GAINS)
    assert not due_to_stop(p, v, STILL, circle(p, 40.0), 10.0, GAINS)
    forward, left = along_and_left(path)
    beyond = np.array((*(path.end[:2] + 3.0 * forward + 20.0 * left), 0.0))
    assert due_to_stop(beyond, STILL, STILL, path, 1.0, GAINS)


def test_the_planned_braking_stays_within_what_trims_allow_with_elevons_to_spare():
    """At every speed with the climb that goes with it: 4 deg of elevon are left, and the motors above idle."""
    speed = np.arange(0.5, 22.01, 0.25)
    rate, climb = (
        np.array([table(v, GAINS.brake_air, column) for v in speed]) for column in (GAINS.brake_rate, GAINS.brake_climb)
    )
    angle = np.arcsin(climb / np.maximum(speed, climb + 1e-9))
    assert (rate <= braking_limit(NOMINAL, speed, angle, RESERVE).held).all()


def test_level_braking_as_planned_is_more_than_the_elevons_give_in_the_corridor():
    """Which is why braking climbs: without the climb the plan is beyond the limit between 5 and 7 m/s."""
    speed = np.array((5.0, 6.0, 7.0))
    rate = np.array([table(v, GAINS.brake_air, GAINS.brake_rate) for v in speed])
    assert (rate > braking_limit(NOMINAL, speed).elevons).all()
