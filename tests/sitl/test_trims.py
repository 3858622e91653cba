"""Trims beyond level flight: braking, turning, and what of them the actuators can hold."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.trim import braking_limit, decelerating_trim, level_trim
from sitl.kernels.rigid_body import derivative
from sitl.kernels.state import ACTUATOR, SIZE, V, W

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
ALOFT = (0.0, 0.0, 500.0)


def rates(state, a):
    """Linear and angular acceleration of the plant, (6,)."""
    dx = np.empty(ACTUATOR)
    derivative(state, np.full(SIZE, math.nan), np.zeros(3), a, dx)
    return np.concatenate((dx[V : V + 3], dx[W:]))


def straight(trim):
    """The plant's state in a straight trim, heading north."""
    v = trim.speed * math.cos(trim.climb), 0.0, trim.speed * math.sin(trim.climb)
    q = math.cos(trim.theta / 2), 0.0, -math.sin(trim.theta / 2), 0.0
    return np.array((*ALOFT, *v, *q, 0.0, 0.0, 0.0, trim.omega, trim.omega, trim.delta, trim.delta))


# Braking


@settings(deadline=None, max_examples=60)
@given(st.floats(0, 25), st.floats(-5, 5), st.floats(-0.4, 0.9), st.sampled_from([NOMINAL, PUBLISHED]))
def test_the_plant_accelerates_along_the_path_as_asked_and_does_not_turn(speed, accel, climb, a):
    trim = decelerating_trim(a, speed, accel, climb)
    assume(trim.thrust >= 0.0 and math.isfinite(trim.delta))
    expected = accel * math.cos(climb), 0.0, accel * math.sin(climb), 0.0, 0.0, 0.0
    assert rates(straight(trim), a) == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize(
    ("speed", "degrees"),
    [
        (4, (22.3, 24.4, 26.3, 27.9)),
        (5, (26.8, 29.9, 33.2, 36.8)),
        (6, (27.1, 30.3, 34.1, 38.4)),
        (7, (24.8, 27.5, 30.7, 34.3)),
        (8, (21.5, 23.6, 25.9, 28.6)),
        (10, (15.5, 16.6, 17.7, 19.0)),
    ],
)
def test_braking_needs_elevon_and_most_of_all_in_the_pitch_corridor(speed, degrees):
    needed = [math.degrees(decelerating_trim(NOMINAL, speed, -accel).delta) for accel in range(4)]
    assert needed == pytest.approx(degrees, abs=0.06)


def test_accelerating_through_the_corridor_is_easy():
    assert math.degrees(decelerating_trim(NOMINAL, 6.0, 3.0).delta) == pytest.approx(19.7, abs=0.05)


def test_the_braking_limit_is_where_the_reserve_is_all_that_is_left():
    speeds, reserve = np.array([4.0, 5.5, 7.0, 9.0]), math.radians(1.0)
    limit = braking_limit(NOMINAL, speeds, 0.0, reserve)
    for speed, most in zip(speeds, limit.elevons, strict=True):
        assert decelerating_trim(NOMINAL, speed, -most).margin == pytest.approx(reserve, abs=1e-6)
    assert limit.elevons.argmin() == 1
    assert (limit.elevons < braking_limit(NOMINAL, speeds).elevons).all()


def test_fast_it_is_the_motors_that_limit_braking():
    limit = braking_limit(NOMINAL, 12.0)
    assert limit.held < limit.elevons
    assert decelerating_trim(NOMINAL, 12.0, -float(limit.held)).motor_margin == pytest.approx(0.0, abs=1e-5)


def test_climbing_helps_braking_and_descending_forbids_it():
    climbs = np.radians([-15.0, 0.0, 15.0])
    descending, level, climbing = braking_limit(NOMINAL, 6.0, climbs).held
    assert descending < 0.0 < level < climbing


def test_where_nothing_trims_the_limit_is_an_acceleration():
    """The published set cannot fly at 7 m/s; gaining speed it can pass it."""
    limit = braking_limit(PUBLISHED, 7.0).held
    assert limit < -1.0
    assert decelerating_trim(PUBLISHED, 7.0, -float(limit)).margin == pytest.approx(0.0, abs=1e-6)


def test_a_table_of_limits_is_its_entries():
    speeds, climbs = np.linspace(0.0, 25.0, 6), np.array([[0.0], [0.3]])
    table = braking_limit(NOMINAL, speeds, climbs, 0.02).held
    one = [[float(braking_limit(NOMINAL, v, float(g[0]), 0.02).held) for v in speeds] for g in climbs]
    assert table == pytest.approx(np.array(one), abs=1e-9)


def test_a_reserve_beyond_the_elevons_leaves_no_limit():
    assert math.isnan(braking_limit(NOMINAL, 10.0, 0.0, 1.0).held)
    assert level_trim(NOMINAL, 10.0).exists
