"""Guidance of forward flight: its limits in cruise, planned stops against the trims' limits, and when they are due."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from sitl.control.braking import Stop, brake, braking_speed
from sitl.control.forward_flight.forward_guidance import (
    SLOW,
    MotionInAir,
    air_course,
    at_airspeed,
    cruise,
    due_to_stop,
    ground_speed,
    stop_within,
    stopping_distance,
)
from sitl.control.reference import circle, hover_at, leg, line_of_sight
from sitl.design.gains import BRAKE_AIR, BRAKE_CLIMB, BRAKE_RATE, line_of_sight_gains
from sitl.design.trim import braking_limit
from sitl.model.airframe_files import load
from sitl.model.vectors import Vector, add_scaled, level_norm, norm, scaled
from tests.support.flights.estimates import estimate

NOMINAL = load("nominal").parameters
GAINS = line_of_sight_gains().guidance
RESERVE = math.radians(4.0)  # of the elevons' travel, left over the planned braking
ORIGIN = Vector(0.0, 0.0, 0.0)
DT = 0.002

angles = st.floats(-3.1, 3.1)
winds = st.floats(-5.0, 5.0)
level_winds = st.builds(Vector, winds, winds, st.just(0.0))
velocities = st.builds(Vector, st.floats(-20.0, 20.0), st.floats(-20.0, 20.0), st.floats(-6.0, 6.0))
places = st.builds(Vector, st.floats(-300.0, 300.0), st.floats(-300.0, 300.0), st.floats(5.0, 80.0))
NORTH = leg((0, 0, 50), (500, 0, 50), 15.0)
HOVER_SPEED = 3.0  # horizontal limit of the hover [m/s]


def towards(azimuth, size=1.0):
    return Vector(size * math.cos(azimuth), size * math.sin(azimuth), 0.0)


# Cruise


@given(p=places, v=velocities, wind=level_winds, integral=st.builds(Vector, *[st.floats(-2.0, 2.0)] * 3))
def test_the_acceleration_of_the_cruise_stays_within_its_limits(p, v, wind, integral):
    asked, after = cruise(MotionInAir(p, v, wind), NORTH, integral, DT, GAINS)
    added = norm(after) if level_norm(v.x, v.y) >= SLOW else 0.0
    fastest = 1.4 * max(BRAKE_RATE)
    assert level_norm(asked.x, asked.y) <= math.hypot(fastest, GAINS.max_turn) + added + 1e-9
    rise = v.z + (asked.z - added) / GAINS.k_vz, v.z + (asked.z + added) / GAINS.k_vz
    assert rise[0] <= GAINS.max_rise + 1e-9
    assert rise[1] >= -GAINS.max_sink - 1e-9
    assert norm(after) <= max(GAINS.max_integral, norm(integral)) + 1e-9


@given(wind=level_winds, share=st.floats(0.1, 0.9))
def test_on_its_leg_at_its_speed_the_cruise_asks_for_nothing(wind, share):
    speed = ground_speed(1.0, 0.0, wind, NORTH.airspeed)
    p, v = Vector(500.0 * share, 0.0, 50.0), Vector(speed, 0.0, 0.0)
    asked, integral = cruise(MotionInAir(p, v, wind), NORTH, ORIGIN, DT, GAINS)
    assert norm(asked) < 1e-9
    assert norm(integral) < 1e-9


@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_on_a_circle_the_cruise_asks_for_the_centripetal_acceleration(turn):
    path = circle((0, 0, 50), turn * 60.0, 15.0)
    p, v = Vector(60.0, 0.0, 50.0), Vector(0.0, turn * 15.0, 0.0)
    asked, _ = cruise(MotionInAir(p, v, ORIGIN), path, ORIGIN, DT, GAINS)
    assert asked.x == pytest.approx(-15.0 * 15.0 / 60.0)
    assert (asked.y, asked.z) == pytest.approx((0.0, 0.0), abs=1e-9)


def test_a_slow_vehicle_speeds_up_along_the_line_of_sight_and_learns_nothing():
    asked, integral = cruise(
        MotionInAir(Vector(0.0, 0.0, 50.0), ORIGIN, ORIGIN), NORTH, Vector(0.1, 0.2, 0.3), DT, GAINS
    )
    assert asked == pytest.approx((GAINS.max_forward, 0.0, 0.0))
    assert integral == (0.1, 0.2, 0.3)


def test_the_integral_grows_with_a_small_error_holds_at_a_large_one_and_is_forgotten_in_a_turn():
    p, learnt = Vector(100.0, 0.0, 50.0), Vector(0.5, 0.5, 0.5)
    _, grown = cruise(MotionInAir(p, Vector(14.0, 0.0, 0.0), ORIGIN), NORTH, learnt, DT, GAINS)
    assert grown.x == pytest.approx(0.5 + DT * GAINS.k_i)
    _, held = cruise(MotionInAir(p, Vector(10.0, 0.0, 0.0), ORIGIN), NORTH, learnt, DT, GAINS)
    assert held == learnt
    _, forgotten = cruise(MotionInAir(p, Vector(0.0, 15.0, 0.0), ORIGIN), NORTH, learnt, DT, GAINS)
    assert forgotten == ORIGIN
    _, full = cruise(MotionInAir(p, Vector(14.0, 0.0, 0.0), ORIGIN), NORTH, Vector(50.0, 0.0, 0.0), DT, GAINS)
    assert norm(full) == pytest.approx(GAINS.max_integral)


@given(p=places, v=velocities, wind=level_winds, airspeed=st.floats(9.0, 20.0))
def test_the_air_course_flies_along_the_line_of_sight(p, v, wind, airspeed):
    path = NORTH._replace(airspeed=airspeed)
    seen = estimate(p, v, wind=wind)
    azimuth = air_course(seen, hover_at(p, 0.0)._replace(path=path), 0.3)
    ground = add_scaled(wind, towards(azimuth), airspeed)
    north, west = line_of_sight(path, p, level_norm(v.x, v.y))
    assert ground.x * west - ground.y * north == pytest.approx(0.0, abs=1e-7)
    assert ground.x * north + ground.y * west == pytest.approx(ground_speed(north, west, wind, airspeed))


def test_the_air_course_stays_where_the_line_of_sight_has_no_direction():
    seen = estimate((1, 2, 3), (0, 0, 0), wind=(3, 0, 0))
    assert air_course(seen, hover_at((1, 2, 3), 0.0), 0.7) == 0.7


# The braking profile


def test_the_even_tables_of_the_braking_are_its_knots_joined():
    for x in np.arange(-1.0, 30.0, 0.01):
        assert at_airspeed(float(x), GAINS.brake_rate) == pytest.approx(np.interp(x, BRAKE_AIR, BRAKE_RATE), rel=1e-12)
        assert at_airspeed(float(x), GAINS.brake_climb) == pytest.approx(
            np.interp(x, BRAKE_AIR, BRAKE_CLIMB), abs=3e-12
        )
    assert GAINS.min_brake_rate == GAINS.brake_rate.min()


def test_an_airspeed_that_is_no_number_has_a_place_in_the_tables():
    assert at_airspeed(math.nan, GAINS.brake_rate) == BRAKE_RATE[0]
    assert at_airspeed(math.inf, GAINS.brake_rate) == BRAKE_RATE[-1]


@given(speed=st.floats(0.5, 20.0), tail=winds, cross=winds)
def test_the_speed_that_stops_within_a_distance_is_the_inverse_of_the_stopping_distance(speed, tail, cross):
    distance = stopping_distance(speed, tail, cross, GAINS)
    assert braking_speed(distance, 25.0, tail, cross, GAINS) == pytest.approx(speed, rel=0.03, abs=0.05)


@given(distance=st.floats(0.1, 200.0), farther=st.floats(1.0, 50.0), tail=winds, limit=st.floats(4.0, 22.0))
def test_more_room_never_means_less_speed_and_never_more_than_the_cruise(distance, farther, tail, limit):
    near, far = (braking_speed(d, limit, tail, 0.0, GAINS) for d in (distance, distance + farther))
    assert 0.0 <= near <= far + 1e-9
    assert far <= limit + 1e-9


@given(speed=st.floats(0.0, 30.0), tail=winds, cross=winds)
def test_braking_is_never_gentler_than_the_smallest_rate_and_the_last_metres(speed, tail, cross):
    """Farther than this bound from the end, the guidance does not integrate the braking."""
    bound = speed * speed / (2.0 * GAINS.min_brake_rate) + speed / GAINS.near
    assert stopping_distance(speed, tail, cross, GAINS) <= bound


@pytest.mark.long
def test_the_planned_braking_stays_within_what_trims_allow_with_elevons_to_spare():
    """At every speed with the climb that goes with it: 4 deg of elevon are left, and the motors above idle."""
    speed = np.arange(0.5, 22.01, 0.25)
    rate, climb = (
        np.array([at_airspeed(float(v), column) for v in speed]) for column in (GAINS.brake_rate, GAINS.brake_climb)
    )
    angle = np.arcsin(climb / np.maximum(speed, climb + 1e-9))
    assert (rate <= braking_limit(NOMINAL, speed, angle, RESERVE).held).all()


@pytest.mark.long
def test_level_braking_as_planned_is_more_than_the_elevons_give_in_the_corridor():
    """Braking climbs for this reason: without the climb the plan is beyond the limit between 5 and 7 m/s."""
    speed = np.array((5.0, 6.0, 7.0))
    rate = np.array([at_airspeed(float(v), GAINS.brake_rate) for v in speed])
    assert (rate > braking_limit(NOMINAL, speed).elevons).all()


# When a stop is due


@given(speed=st.floats(1.0, 20.0), tail=winds, share=st.floats(0.2, 3.0), azimuth=angles)
def test_a_stop_is_due_where_what_is_left_is_what_braking_takes(speed, tail, share, azimuth):
    ahead = towards(azimuth)
    needed = stopping_distance(speed, tail, 0.0, GAINS)
    assume(abs(share - 1.0) > 0.01)
    path = leg(scaled(ahead, -400.0), scaled(ahead, share * needed), 15.0)
    v, wind = scaled(ahead, speed), scaled(ahead, tail)
    assert stop_within(MotionInAir(ORIGIN, v, wind), path, 1.0, GAINS) == (share < 1.0)
    assert stop_within(MotionInAir(ORIGIN, v, wind), path, share * 1.01, GAINS)
    assert due_to_stop(estimate(v=v, wind=wind), path, 1.0, GAINS) == (share < 1.0)


@given(start=places, p=places, azimuth=angles, length=st.floats(10.0, 300.0))
def test_a_leg_that_goes_on_and_a_circle_are_never_stopped_and_one_overflown_always(start, p, azimuth, length):
    v, ahead = Vector(15.0, 0.0, 0.0), towards(azimuth)
    path = leg(start, add_scaled(start, ahead, length), 15.0)
    assert not stop_within(MotionInAir(p, v, ORIGIN), path._replace(stop=False), 10.0, GAINS)
    assert not stop_within(MotionInAir(p, v, ORIGIN), circle(p, 40.0, 15.0), 10.0, GAINS)
    beyond = add_scaled(add_scaled(path.end, ahead, 3.0), Vector(-ahead.y, ahead.x, 0.0), 20.0)
    assert stop_within(MotionInAir(beyond, ORIGIN, ORIGIN), path, 1.0, GAINS)


# The stop


@given(p=places, v=velocities, wind=level_winds, travel=st.floats(0.0, 1.0))
def test_the_acceleration_of_the_stop_stays_within_its_limits(p, v, wind, travel):
    asked, integral = brake(MotionInAir(p, v, wind), Stop(NORTH, HOVER_SPEED), travel, ORIGIN, DT, GAINS)
    assert level_norm(asked.x, asked.y) <= math.hypot(1.4 * max(BRAKE_RATE), GAINS.min_turn) + 1e-9
    assert -3.0 <= asked.z <= 5.0
    assert abs(integral.z) <= GAINS.max_integral
    assert (integral.x, integral.y) == (0.0, 0.0)


def test_the_stop_climbs_in_the_corridor_and_more_where_the_elevons_need_it_but_not_beyond_its_height():
    def rise(travel, above=0.0, speed=6.0):
        p, v = Vector(480.0, 0.0, 50.0 + above), Vector(speed, 0.0, 0.0)
        return brake(MotionInAir(p, v, ORIGIN), Stop(NORTH, HOVER_SPEED), travel, ORIGIN, DT, GAINS)[0].z / 1.5

    assert rise(0.3) == pytest.approx(0.3 * 2.4, rel=1e-3)
    assert rise(0.9) == pytest.approx(2.4, rel=1e-3)
    assert rise(0.9, above=7.0) < rise(0.9, above=6.5)
    assert rise(0.9, above=GAINS.max_climb) == pytest.approx(0.0)
    assert rise(1.0, above=GAINS.max_climb) > 0.5  # elevons at their stops are worth more than the height
    assert rise(0.9, speed=0.0) == pytest.approx(0.0)


@pytest.mark.long
@given(speed=st.floats(0.2, 0.99 * GAINS.creep), left=st.floats(8.0, 100.0), azimuth=angles)
def test_a_hover_is_crept_no_faster_than_its_limit_and_without_a_jump_in_what_is_asked(speed, left, azimuth):
    """A jump at some speed keeps the elevons going from stop to stop there."""
    ahead = towards(azimuth)
    p = add_scaled(NORTH.end, ahead, -left)

    def asked(closing):
        wanted, _ = brake(MotionInAir(p, scaled(ahead, closing), ORIGIN), Stop(NORTH, speed), 0.0, ORIGIN, DT, GAINS)
        return wanted.x * ahead.x + wanted.y * ahead.y

    crept = min(0.5 * GAINS.creep, speed)
    assert asked(crept) == pytest.approx(0.0, abs=1e-9)
    assert asked(0.99 * crept) > 0.0 > asked(1.01 * crept)
    steps = [asked(0.01 * k * crept) - asked(0.01 * (k + 1) * crept) for k in range(140)]
    assert max(map(abs, steps)) < 0.3 * max(crept, 0.3)


def test_the_end_of_a_leg_is_crept_no_faster_than_the_limit_of_the_hover():
    p = Vector(480.0, 0.0, 50.0)
    for speed, closing in ((0.5, 0.6), (1.0, 1.1)):
        slow, _ = brake(MotionInAir(p, Vector(closing, 0.0, 0.0), ORIGIN), Stop(NORTH, speed), 0.0, ORIGIN, DT, GAINS)
        free, _ = brake(
            MotionInAir(p, Vector(closing, 0.0, 0.0), ORIGIN), Stop(NORTH, HOVER_SPEED), 0.0, ORIGIN, DT, GAINS
        )
        assert slow.x < 0.0 < free.x


def test_at_the_end_the_stop_asks_for_rest():
    asked, _ = brake(MotionInAir(NORTH.end, ORIGIN, ORIGIN), Stop(NORTH, HOVER_SPEED), 0.0, ORIGIN, DT, GAINS)
    assert norm(asked) < 1e-9
