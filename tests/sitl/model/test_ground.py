"""The ground: it carries, it grips, it never pulls, and whatever falls on it comes to lie."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.model.airframe_files import load
from sitl.model.ground import (
    CLEAR,
    DAMPING,
    FRICTION,
    LEVEL_GROUND,
    STIFFNESS,
    contact,
    foot,
    is_touching,
    point_motion,
)
from sitl.model.plant import step
from sitl.model.quaternions import from_euler, hover, x_axis
from tests.support.flights.estimates import STILL, vector
from tests.support.flights.plant_flight import actuators, fly, plant, standing_height

NOMINAL = load("nominal").parameters
HEIGHT = standing_height(NOMINAL)
IDLE = (NOMINAL.omega_min, NOMINAL.omega_min, 0.0, 0.0)


def standing(v=STILL, heading=0.0):
    return plant((1.0, -2.0, HEIGHT), v, hover(heading))


@pytest.mark.parametrize("armed", [False, True])
def test_it_stands_without_sinking_or_sliding(armed):
    settled = fly(standing(), NOMINAL, 2.0, IDLE, armed=armed)
    x = fly(settled, NOMINAL, 30.0, IDLE, armed=armed)
    assert x.body.position == pytest.approx(settled.body.position, abs=1e-4)
    assert x_axis(x.body.attitude).z == pytest.approx(1.0, abs=1e-6)
    assert is_touching(x, LEVEL_GROUND, NOMINAL)


def test_a_minute_on_the_ground_moves_it_less_than_a_millimetre():
    x = fly(standing(heading=0.7), NOMINAL, 60.0, IDLE)
    assert x.body.position == pytest.approx((1.0, -2.0, HEIGHT), abs=1e-3)
    assert np.abs(x.body.velocity).max() < 1e-6
    assert is_touching(x, LEVEL_GROUND, NOMINAL)


def test_a_light_wind_does_not_move_it():
    p = fly(standing(), NOMINAL, 10.0, wind=(1.5, 0.0, 0.0), armed=False).body.position
    assert np.hypot(p.x - 1.0, p.y + 2.0) < 2e-3


def test_it_slides_only_beyond_friction():
    held, pushed = (fly(standing((0.0, v, 0.0)), NOMINAL, 2.0, armed=False).body for v in (0.01, 1.0))
    assert abs(held.position.y + 2.0) < 2e-3
    assert 0.05 < abs(pushed.position.y + 2.0) < 0.3
    assert np.linalg.norm(pushed.velocity) < 0.05


def test_touching_down_at_half_a_metre_per_second_does_not_bounce_away():
    x, highest = plant((0.0, 0.0, HEIGHT + 0.05), (0.0, 0.0, -0.5)), 0.0
    for _ in range(15):
        x = fly(x, NOMINAL, 0.1, armed=False)
        highest = max(highest, x.body.position.z) if is_touching(x, LEVEL_GROUND, NOMINAL) else highest
    assert HEIGHT - 0.01 < highest < HEIGHT + 0.02
    assert np.linalg.norm(x.body.velocity) < 0.05


def test_tipped_over_it_lies_on_the_ground():
    body = fly(plant((0.0, 0.0, 0.2), q=from_euler(0.0, -0.4, 0.0)), NOMINAL, 6.0, armed=False).body
    assert -0.02 < body.position.z < 0.2
    assert np.linalg.norm(body.velocity) < 0.1


@pytest.mark.parametrize("angle", [(0.0, 0.0, 0.0), (0.0, 1.2, 0.0), (1.5, 0.3, 0.0), (3.1, -0.2, 0.0)])
def test_however_it_falls_it_comes_to_lie_on_the_ground(angle):
    """On its belly, nose or wing tip first, or on its back."""
    x = fly(plant((1.0, -2.0, 0.6), (2, 0, -5), from_euler(*angle), (1, 1, 0)), NOMINAL, 8.0, armed=False)
    assert 0.0 < x.body.position.z < NOMINAL.foot_x
    assert np.abs(x.body.velocity).max() < 1e-3
    assert is_touching(x, LEVEL_GROUND, NOMINAL)


def test_it_takes_off_and_leaves_the_ground_behind():
    touched = fly(standing(), NOMINAL, 0.1, IDLE)
    assert all(foot.grips for foot in touched.feet)
    x = fly(touched, NOMINAL, 1.0, (800.0, 800.0, 0.0, 0.0))
    assert x.body.position.z > 0.5
    assert not is_touching(x, LEVEL_GROUND, NOMINAL)
    assert not any(foot.grips for foot in x.feet)


@given(deep=st.floats(0.0, 0.05), rising=st.floats(0.0, 40.0))
def test_contacts_push_and_never_pull(deep, rising):
    """Four springs of the tail with their dampers; where these would pull harder than those push, nothing."""
    x = plant((0.0, 0.0, NOMINAL.foot_x - deep), (0.0, 0.0, rising))
    spring_and_damper = STIFFNESS * deep - DAMPING * rising
    force, _ = contact(x.body, x.feet, LEVEL_GROUND, NOMINAL)
    assert force.z == pytest.approx(4.0 * max(0.0, spring_and_damper), abs=1e-9)


def test_a_contact_that_would_pull_is_among_those_tried():
    x = plant((0.0, 0.0, NOMINAL.foot_x - 0.01), (0.0, 0.0, 30.0))
    p, v = point_motion(x.body, foot(1.0, 1.0, NOMINAL))
    assert -STIFFNESS * p.z - DAMPING * v.z < -100.0
    assert contact(x.body, x.feet, LEVEL_GROUND, NOMINAL)[0].z == 0.0


@given(deep=st.floats(1e-4, 0.02), north=st.floats(-3.0, 3.0), west=st.floats(-3.0, 3.0))
def test_friction_is_against_the_motion_and_within_coulomb_s_limit(deep, north, west):
    x = plant((0.0, 0.0, NOMINAL.foot_x - deep), (north, west, 0.0))
    force, _ = contact(x.body, x.feet, LEVEL_GROUND, NOMINAL)
    assert np.hypot(force.x, force.y) <= FRICTION * force.z * (1.0 + 1e-9)
    assert force.x * north + force.y * west <= 0.0
    assert force.x * west == pytest.approx(force.y * north, abs=1e-9)


@pytest.mark.parametrize("height", [0.5, CLEAR])
def test_both_forms_of_the_step_agree_where_nothing_touches(height):
    """A fall that is looked at for contacts, and one that is not."""
    near, far = (plant((0.0, 0.0, at), (3.0, 0.0, 0.0), w=(0.1, 0.2, 0.3)) for at in (height, 50.0))
    fallen = [step(x, actuators(IDLE), vector(STILL), True, NOMINAL, 1e-3).body for x in (near, far)]
    assert fallen[0].velocity == pytest.approx(fallen[1].velocity, abs=1e-12)
    assert fallen[0].rates == pytest.approx(fallen[1].rates, abs=1e-12)
