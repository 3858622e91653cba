"""Trims of steady turns."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.design.trim import level_trim
from sitl.design.turn import banked_trim, turning_trim
from sitl.model.airframe_files import load
from sitl.model.ground import feet_aloft
from sitl.model.plant import step_in_air
from sitl.model.quaternions import Quaternion, from_euler, multiply, rotate, rotate_inverse
from sitl.model.state import Plant
from tests.support.flights.trimmed import NOTHING, accelerations, turning, velocity

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
TURNS = [
    (0.0, 60.0, 0.0), (1.0, -30.0, 0.0), (5.5, 45.0, 0.0), (8.0, 30.0, 20.0), (8.0, 20.0, -20.0),
    (12.0, -45.0, 45.0), (20.0, 60.0, 0.0), (25.0, 10.0, -5.0),
]  # fmt: skip


@pytest.mark.parametrize(("speed", "turn", "climb"), TURNS)
def test_in_a_turn_the_plant_only_follows_the_circle(speed, turn, climb):
    trim = turning_trim(NOMINAL, speed, math.radians(turn), math.radians(climb))
    sideways = trim.turn_rate * speed * math.cos(trim.climb)
    assert accelerations(*turning(trim), NOMINAL) == pytest.approx((0.0, sideways, 0.0, 0.0, 0.0, 0.0), abs=1e-8)
    assert rotate_inverse(Quaternion(*trim.q), velocity(trim)).y == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(("speed", "turn", "climb"), TURNS)
def test_flown_open_loop_a_turn_keeps_its_speed_climb_and_rates(speed, turn, climb):
    trim = turning_trim(NOMINAL, speed, math.radians(turn), math.radians(climb))
    body, actuators = turning(trim)
    plant = Plant(body, actuators, feet_aloft())
    for _ in range(200):
        plant = step_in_air(plant, actuators, NOTHING, NOMINAL, 0.001)
    turned = from_euler(0.0, 0.0, 0.2 * trim.turn_rate)
    assert plant.body.velocity == pytest.approx(rotate(turned, velocity(trim)), abs=1e-7)
    assert plant.body.attitude == pytest.approx(multiply(turned, body.attitude), abs=1e-7)
    assert plant.body.rates == pytest.approx(body.rates, abs=1e-7)


@settings(deadline=None, max_examples=15)
@given(st.floats(0, 25), st.floats(0.05, 0.8), st.floats(-0.2, 0.7))
def test_right_is_left_seen_in_the_mirror(speed, turn_rate, climb):
    left, right = (turning_trim(NOMINAL, speed, sign * turn_rate, climb) for sign in (1.0, -1.0))
    assert right.delta == pytest.approx(left.delta[::-1], abs=1e-7, nan_ok=True)
    assert right.omega == pytest.approx(left.omega[::-1], abs=1e-5, nan_ok=True)
    assert (right.margin, right.bank) == pytest.approx((left.margin, -left.bank), abs=1e-7, nan_ok=True)


@pytest.mark.parametrize("climb", [0.0, 0.5])
def test_not_turning_is_flying_straight(climb):
    straight_on, turn = level_trim(NOMINAL, 9.0, climb), turning_trim(NOMINAL, 9.0, 0.0, climb)
    assert turn.theta == pytest.approx(straight_on.theta)
    assert (*turn.omega, *turn.delta) == pytest.approx(2 * (straight_on.omega,) + 2 * (straight_on.delta,))
    assert (turn.margin, turn.motor_margin) == pytest.approx((straight_on.margin, straight_on.motor_margin))


def test_a_bank_and_its_turn_rate_are_the_same_turn():
    rate = turning_trim(NOMINAL, 12.0, 0.5, 0.1)
    bank = banked_trim(NOMINAL, 12.0, rate.bank, 0.1)
    assert bank.turn_rate == pytest.approx(0.5)
    assert bank.delta == pytest.approx(rate.delta)
    assert math.tan(rate.bank) == pytest.approx(0.5 * 12.0 * math.cos(0.1) / 9.81, rel=0.1)  # nearly any aeroplane's


def test_the_margin_of_a_turn_is_that_of_its_worse_side():
    """Turning left the right wing is faster: its elevon and its motor do more."""
    trim = turning_trim(NOMINAL, 5.5, 0.8)
    assert trim.exists
    assert trim.delta[1] > trim.delta[0]
    assert trim.omega[1] > trim.omega[0]
    assert trim.margin == NOMINAL.delta_max - trim.delta[1]


def test_what_the_elevons_or_the_motors_cannot_hold_does_not_exist():
    assert banked_trim(PUBLISHED, 7.0, math.radians(30.0)).margin < 0.0
    tight = banked_trim(NOMINAL, 15.0, math.radians(75.0))
    assert tight.motor_margin < 0.0 < tight.margin
    assert not tight.exists
    dive = turning_trim(NOMINAL, 20.0, 0.3, -0.4)  # the propellers would have to push
    assert math.isnan(dive.margin)
    assert not dive.exists
