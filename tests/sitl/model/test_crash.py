"""Severity of a contact with the ground, and the motion that is left after a crash."""

import math

import pytest
from numba import njit

from sitl.model.airframe_files import load
from sitl.model.ground import LEVEL_GROUND, SPIN_LEFT, crashed, impact_speed, is_touching, no_crash
from sitl.model.plant import step
from sitl.model.quaternions import from_euler, hover, x_axis
from tests.support.flights.estimates import STILL, vector
from tests.support.flights.plant_flight import actuators, plant

A = load("nominal").parameters
DT = 1e-3
NOSE_DOWN = from_euler(0.0, 0.5 * math.pi, 0.0)


@njit(error_model="numpy")
def impact(before, after, a):
    return impact_speed(before, after, LEVEL_GROUND, a)


@njit(error_model="numpy")
def lying(x, a):
    return crashed(x, LEVEL_GROUND, a)


def hit(x):
    """Speed of the hardest contact over the step from a state, motors off."""
    after = step(x, actuators((0.0, 0.0, 0.0, 0.0)), vector(STILL), False, A, DT)
    return impact(x.body, after.body, A)


@pytest.mark.long
@pytest.mark.parametrize("sink", [0.5, 4.0, 60.0])
@pytest.mark.parametrize(
    ("attitude", "reach"),
    [(hover(0.7), A.foot_x), (NOSE_DOWN, A.p_x), (from_euler(0.5 * math.pi, 0.0, 0.0), 0.5 * A.b)],
)
def test_the_speed_of_a_contact_is_that_at_which_it_meets_the_ground(sink, attitude, reach):
    assert hit(plant((0.0, 0.0, reach + 0.5 * sink * DT), (3.0, 0.0, -sink), attitude)) == pytest.approx(sink)
    assert hit(plant((0.0, 0.0, reach + 2.0 * sink * DT), (3.0, 0.0, -sink), attitude)) == 0.0


def test_a_wing_tip_that_swings_down_hits_faster_than_the_vehicle_sinks():
    half, roll = 0.5 * A.b, 0.6
    up = half * math.sin(roll) + 1e-3
    x = plant((0.0, 0.0, up), (0.0, 0.0, -1.0), from_euler(roll, 0.0, 0.0), (8.0, 0.0, 0.0))
    assert hit(x) == pytest.approx(1.0 + 8.0 * half * math.cos(roll), rel=0.02)


def test_standing_and_sliding_are_no_impact():
    standing = plant((0.0, 0.0, A.foot_x - 0.0015), (5.0, 0.0, 0.0), hover(0.0))
    assert abs(hit(standing)) < 0.02


@pytest.mark.long
def test_after_a_crash_it_lies_where_it_hit_and_hardly_turns():
    x = lying(plant((1.0, 2.0, -0.05), (9.0, 0.0, -60.0), NOSE_DOWN, (1.0, -2.0, 3.0)), A)
    assert x.body.position[:2] == (1.0, 2.0)
    assert x.body.velocity == (0.0, 0.0, 0.0)
    assert x.body.rates == pytest.approx((SPIN_LEFT, -2.0 * SPIN_LEFT, 3.0 * SPIN_LEFT))
    assert x.body.position.z == pytest.approx(A.p_x)  # the nose on the ground, not in it
    assert x_axis(x.body.attitude).z == pytest.approx(-1.0)
    assert not is_touching(x._replace(body=x.body._replace(position=vector((0.0, 0.0, A.p_x + 1e-6)))), LEVEL_GROUND, A)


def test_nothing_is_broken_to_begin_with():
    assert no_crash() == (0.0, (0.0, 0.0, 0.0))
