"""The descent to the ground: when it begins, how it sinks, and where it leads."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.reference import along, hover_at, leg
from sitl.guidance.landing import (
    BLIND_DESCENT_RATE,
    BLIND_PATIENCE,
    BLIND_TIME,
    CLEAR_MARGIN,
    KNOWN_HEIGHT,
    LANDING_DISTANCE,
    LANDING_PATIENCE,
    LANDING_SPEED,
    LANDING_TILT,
    LEANING_TILT,
    LEANT_PATIENCE,
    MAX_DESCENT_LEAD,
    MAX_TOUCHING_TILT,
    STEADY_TIME,
    STRAIGHT_UP,
    TOUCHING_HEIGHT,
    TOUCHING_PATIENCE,
    TOUCHING_SPEED,
    WAITING_HEIGHT,
    LandingDescent,
    LiftOff,
)
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView

ABOVE = hover_at((3.0, 4.0, 20.0), 0.5)
OVER = (3.0, 4.0, 20.0)
TICK = 0.02


def view(time=0.0, p=OVER, v=(0.0, 0.0, 0.0), tilt=0.0):
    return VehicleView(time, p, v, 0.0, tilt, False, 1.0)


@pytest.mark.parametrize(
    "seen",
    [
        view(v=(1.5 * LANDING_SPEED, 0.0, 0.0)),
        view(tilt=1.5 * LANDING_TILT),
        view(p=(3.0 + 1.5 * LANDING_DISTANCE, 4.0, 20.0)),
    ],
)
def test_a_vehicle_that_moves_leans_or_is_elsewhere_does_not_sink(seen):
    landing = LandingDescent(ABOVE, 0.5)
    for tick in range(100):
        assert landing.update(seen._replace(time=tick * TICK)) == ABOVE
    assert not landing.landing


@given(
    speed=st.floats(LANDING_SPEED * 2.0, 30.0),
    tilt=st.floats(LANDING_TILT * 2.0, math.pi),
    seconds=st.floats(0.0, LANDING_PATIENCE),
)
def test_no_passage_in_forward_flight_begins_a_descent(speed, tilt, seconds):
    landing = LandingDescent(ABOVE, 0.5)
    for tick in range(round(seconds / TICK)):
        assert landing.update(view(tick * TICK, v=(speed, 0.0, 0.0), tilt=tilt)).position == OVER
    assert not landing.landing


def test_it_sinks_from_where_it_stands_fast_above_five_metres_and_then_at_its_rate():
    landing = LandingDescent(ABOVE, 0.5)
    heights, z = [], 20.0
    for tick in range(1201):
        z = landing.update(view(tick * TICK, (3.0, 4.0, z))).position.z
        heights.append(z)
    assert landing.landing
    assert not landing.done(view())
    assert [heights[k] for k in (0, 250, 500, 550)] == pytest.approx([20.0, 12.5, 5.0, 4.5], abs=0.04)


def test_below_any_ground_the_reference_keeps_so_near_that_the_motors_are_let_go_softly():
    for ground in (-30.0, 0.0, 2.0):
        landing = LandingDescent(ABOVE, 0.5)
        for tick in range(1500):
            reference = landing.update(view(tick * TICK, (3.0, 4.0, ground)))
        assert reference.position == pytest.approx((3.0, 4.0, ground - MAX_DESCENT_LEAD))


def test_where_it_comes_to_stand_will_do_if_it_lands_anywhere():
    landing = LandingDescent(ABOVE, 0.5, anywhere=True)
    there = (40.0, -7.0, 18.0)
    assert landing.update(view(0.0, there, v=(9.0, 0.0, 0.0))) == ABOVE
    assert landing.update(view(0.1, there)).position == there
    assert landing.landing


def test_a_wind_that_never_lets_it_stand_still_keeps_it_waiting_for_a_while_only():
    landing, seen = LandingDescent(ABOVE, 0.5), view(v=(1.5 * LANDING_SPEED, 0.0, 0.0))
    began = next(
        tick * TICK for tick in range(5000) if landing.update(seen._replace(time=tick * TICK)) and landing.sinks
    )
    assert began == pytest.approx(0.5 * LANDING_PATIENCE, abs=3.0 * TICK)


def test_the_last_way_down_is_straight_down_from_where_it_was_steady():
    landing, tick = LandingDescent(ABOVE, 0.5), 0
    while not landing.sinks:
        landing.update(view(tick * TICK))
        tick += 1
    there = (3.4, 3.7, TOUCHING_HEIGHT)
    drifting = landing.update(view(tick * TICK, there, v=(3.0 * TOUCHING_SPEED, 0.0, 0.0)))
    assert drifting.position == (*OVER[:2], WAITING_HEIGHT)
    waited = round(STEADY_TIME / TICK)
    for _ in range(waited + 1):
        tick += 1
        steady = landing.update(view(tick * TICK, there))
    assert steady.position[:2] == there[:2]
    assert steady.position[2] < there[2]
    assert landing.update(view((tick + 1) * TICK, (3.9, 3.7, 0.5))).position[:2] == there[:2]


def test_a_moment_of_steadiness_near_the_ground_is_not_enough():
    landing, tick = LandingDescent(ABOVE, 0.5), 0
    while not landing.sinks:
        landing.update(view(tick * TICK))
        tick += 1
    there = (3.4, 3.7, TOUCHING_HEIGHT)
    for look in range(round(3.0 / TICK)):
        gust = look % round(0.5 * STEADY_TIME / TICK) == 0
        landing.update(view((tick + look) * TICK, there, v=(10.0 * TOUCHING_SPEED * gust, 0.0, 0.0)))
        assert not landing.is_low


@pytest.mark.parametrize(("wind", "rate"), [(0.0, 1.5), (2.0, 1.5), (4.0, 1.0), (6.0, 2.0 / 3.0), (20.0, 0.5)])
def test_high_up_it_sinks_slower_in_a_wind_which_would_turn_it_over(wind, rate):
    landing, z = LandingDescent(hover_at((3.0, 4.0, 60.0), 0.5), 0.5), 60.0
    for tick in range(251):
        z = landing.update(view(tick * TICK, (3.0, 4.0, z))._replace(wind=(0.6 * wind, -0.8 * wind, 0.0))).position.z
    assert (60.0 - z) / (250 * TICK) == pytest.approx(rate, abs=0.01)


def test_what_leans_near_the_ground_sinks_no_further_for_a_while():
    landing = LandingDescent(hover_at((3.0, 4.0, 4.0), 0.5), 0.5)
    upright = view(p=(3.0, 4.0, 4.0))
    landing.update(upright)
    leaning = upright._replace(tilt=1.5 * LEANING_TILT)
    heights = [landing.update(leaning._replace(time=k * TICK)).position[2] for k in range(2000)]
    waited = next(k for k, z in enumerate(heights) if z < 4.0) * TICK
    assert waited == pytest.approx(0.5 * LEANT_PATIENCE, abs=3 * TICK)  # then half as much again is allowed


def test_what_leans_on_the_last_way_down_goes_up_again_and_waits_anew():
    landing, tick = LandingDescent(ABOVE, 0.5), 0
    while not landing.is_low:
        landing.update(view(tick * TICK, (3.0, 4.0, TOUCHING_HEIGHT if landing.sinks else 20.0)))
        tick += 1
    low = view(tick * TICK, (3.0, 4.0, 0.4))
    assert landing.update(low).position[2] < 0.4
    leaning = low._replace(time=(tick + 1) * TICK, tilt=1.2 * LEANING_TILT)
    assert landing.update(leaning).position[2] == WAITING_HEIGHT
    assert landing.update(low._replace(time=(tick + 2) * TICK)).position[2] == WAITING_HEIGHT
    ended = [landing.update(low._replace(time=(tick + 3 + k) * TICK)).position[2] for k in range(30)]
    assert ended[-1] < 0.4


@pytest.mark.parametrize("seconds", [0.0, 10.0, 60.0, 600.0])
def test_however_long_it_waited_what_leans_by_more_than_the_ground_forgives_goes_up_again(seconds):
    landing, tick = LandingDescent(ABOVE, 0.5), 0
    while not landing.is_low:
        landing.update(view(tick * TICK, (3.0, 4.0, TOUCHING_HEIGHT if landing.sinks else 20.0)))
        tick += 1
    landing.waited = landing.leant = seconds
    low = view((tick + 1) * TICK, (3.0, 4.0, 0.3))
    assert landing.update(low._replace(tilt=0.9 * LEANING_TILT)).position[2] < WAITING_HEIGHT
    assert landing.update(low._replace(tilt=1.05 * MAX_TOUCHING_TILT)).position[2] == WAITING_HEIGHT


@pytest.mark.parametrize(("age", "rate"), [(BLIND_TIME, 1.5), (BLIND_TIME + 0.01, BLIND_DESCENT_RATE)])
def test_without_a_position_it_sinks_faster_for_it_drifts_meanwhile(age, rate):
    landing = LandingDescent(ABOVE, 0.5)
    for tick in range(51):
        reference = landing.update(view(tick * TICK)._replace(position_age=age))
    assert 20.0 - reference.position[2] == pytest.approx(rate, abs=0.05)


@pytest.mark.parametrize(
    ("height", "doubt", "rate"),
    [
        (4.0, KNOWN_HEIGHT, 0.5),
        (4.0, KNOWN_HEIGHT + 0.01, BLIND_DESCENT_RATE),
        (0.5, KNOWN_HEIGHT + 0.01, BLIND_DESCENT_RATE),
        (-4.0, KNOWN_HEIGHT + 0.01, 1.2 * BLIND_DESCENT_RATE),
        (-30.0, KNOWN_HEIGHT + 0.01, 1.4 * BLIND_DESCENT_RATE),
    ],
)
def test_without_a_height_either_it_sinks_as_fast_and_faster_where_the_ground_is_late(height, doubt, rate):
    landing = LandingDescent(ABOVE, 0.5)
    for tick in range(51):
        seen = view(tick * TICK, p=(3.0, 4.0, height))._replace(position_age=BLIND_TIME + 0.01, height_deviation=doubt)
        reference = landing.update(seen)
    assert height - reference.position[2] == pytest.approx(rate, abs=0.05)


@pytest.mark.parametrize(
    ("age", "waits"), [(BLIND_TIME, TOUCHING_PATIENCE + STEADY_TIME), (BLIND_TIME + 0.01, BLIND_PATIENCE)]
)
def test_without_a_position_it_does_not_wait_long_above_the_ground(age, waits):
    landing, tick = LandingDescent(ABOVE, 0.5), 0
    landing.update(view())
    drifts = view(p=(3.0, 4.0, 0.8), v=(2.0 * TOUCHING_SPEED, 0.0, 0.0))._replace(position_age=age)
    while not landing.is_low:
        tick += 1
        landing.update(drifts._replace(time=tick * TICK))
    assert tick * TICK == pytest.approx(waits, abs=3.0 * TICK)


# Off the ground straight up: where the reference leads until the vehicle is clear of it.


RATE = 1.0
CLEAR = MIN_HOLD_HEIGHT - CLEAR_MARGIN


def risen(time, p=(1.0, 2.0, 0.1), landed=False):
    return VehicleView(time, p, (0.0, 0.0, 0.0), 0.0, 0.0, landed, 1.0)


def stood(at=(1.0, 2.0, 0.1)):
    lift = LiftOff()
    here = hover_at(at, 0.0)
    assert lift.applied(here, risen(0.0, at, landed=True), RATE, landing=False) == here
    return lift


@pytest.mark.parametrize(
    "reference",
    [
        hover_at((30.0, 2.0, 0.0), 0.3),
        hover_at((30.0, 2.0, 9.0), 0.3),
        along(hover_at((200.0, 0.0, 20.0), 0.3), leg((1.0, 2.0, 0.1), (200.0, 0.0, 20.0), 15.0), 0.3),
    ],
)
def test_a_way_elsewhere_begins_straight_up(reference):
    lift = stood()
    for tick in range(1, 400):
        given = lift.applied(reference, risen(tick * TICK), RATE, landing=False)
        assert not given.forward
        assert given.position[:2] == (1.0, 2.0)
    assert given.position.z == pytest.approx(min(0.1 + RATE * 399 * TICK, max(reference.position.z, MIN_HOLD_HEIGHT)))
    clear = risen(9.0, (1.0, 2.0, CLEAR))
    assert lift.applied(reference, clear, RATE, landing=False) == reference
    assert lift.applied(reference, risen(9.1), RATE, landing=False) == reference  # a hold in gusts may be lower later


@given(
    north=st.floats(-500.0, 500.0), west=st.floats(-500.0, 500.0), up=st.floats(-50.0, 100.0), z=st.floats(0.0, CLEAR)
)
def test_nothing_moves_sideways_below_the_least_height(north, west, up, z):
    lift = stood()
    wanted = hover_at((north, west, up), 0.0)
    given = lift.applied(wanted, risen(TICK, (1.0, 2.0, min(z, CLEAR - 1e-6))), RATE, landing=False)
    assert math.dist(given.position[:2], (1.0, 2.0)) < STRAIGHT_UP


def test_a_climb_on_the_spot_and_a_landing_are_left_alone():
    lift, climb, down = stood(), hover_at((1.0, 2.0, 0.7), 0.0), hover_at((5.0, 2.0, -1.0), 0.0)
    assert lift.applied(climb, risen(TICK), RATE, landing=False) == climb
    assert lift.applied(down, risen(2 * TICK), RATE, landing=True) == down
