"""Off the ground straight up: where the reference leads until the vehicle is clear of it."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.reference import along, hover_at, leg
from sitl.guidance.landing import CLEAR_MARGIN, STRAIGHT_UP, LiftOff
from sitl.guidance.view import MIN_HOLD_HEIGHT, VehicleView

TICK, RATE = 0.02, 1.0
CLEAR = MIN_HOLD_HEIGHT - CLEAR_MARGIN


def view(time, p=(1.0, 2.0, 0.1), landed=False):
    return VehicleView(time, p, (0.0, 0.0, 0.0), 0.0, 0.0, landed, 1.0)


def stood(at=(1.0, 2.0, 0.1)):
    lift = LiftOff()
    here = hover_at(at, 0.0)
    assert lift.applied(here, view(0.0, at, landed=True), RATE, landing=False) == here
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
        given = lift.applied(reference, view(tick * TICK), RATE, landing=False)
        assert not given.forward
        assert given.position[:2] == (1.0, 2.0)
    assert given.position.z == pytest.approx(min(0.1 + RATE * 399 * TICK, max(reference.position.z, MIN_HOLD_HEIGHT)))
    clear = view(9.0, (1.0, 2.0, CLEAR))
    assert lift.applied(reference, clear, RATE, landing=False) == reference
    assert lift.applied(reference, view(9.1), RATE, landing=False) == reference  # a hold in gusts may be lower later


@given(
    north=st.floats(-500.0, 500.0), west=st.floats(-500.0, 500.0), up=st.floats(-50.0, 100.0), z=st.floats(0.0, CLEAR)
)
def test_nothing_moves_sideways_below_the_least_height(north, west, up, z):
    lift = stood()
    wanted = hover_at((north, west, up), 0.0)
    given = lift.applied(wanted, view(TICK, (1.0, 2.0, min(z, CLEAR - 1e-6))), RATE, landing=False)
    assert math.dist(given.position[:2], (1.0, 2.0)) < STRAIGHT_UP


def test_a_climb_on_the_spot_and_a_landing_are_left_alone():
    lift, climb, down = stood(), hover_at((1.0, 2.0, 0.7), 0.0), hover_at((5.0, 2.0, -1.0), 0.0)
    assert lift.applied(climb, view(TICK), RATE, landing=False) == climb
    assert lift.applied(down, view(2 * TICK), RATE, landing=True) == down
