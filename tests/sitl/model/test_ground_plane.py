"""The ground as a plane: level it is to the bit what z = 0 was, tilted it is the same turned, and it carries."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.model.airframe_files import load
from sitl.model.ground import (
    DAMPING,
    FRICTION,
    LEVEL_GROUND,
    STIFFNESS,
    GroundPlane,
    clearance,
    contact,
    crashed,
    feet_aloft,
    foot,
    ground_plane,
    height_over,
    impact_speed,
    is_clear,
    is_touching,
    leaning,
    nose,
    point_motion,
    wing_tip,
)
from sitl.model.plant import step_near_ground
from sitl.model.quaternions import Quaternion, from_euler, hover, multiply, rotate, rotate_inverse, x_axis
from sitl.model.state import Body, Foot, Plant
from sitl.model.vectors import Vector, add, cross, level_norm
from sitl.simulation.start import Start
from tests.support.flights.estimates import vector
from tests.support.flights.plant_flight import actuators, plant

A = load("nominal").parameters
RISES_TO = math.radians(130.0)
SLOPE = ground_plane(2.0, math.radians(5.0), RISES_TO)
OFF = actuators((0.0, 0.0, 0.0, 0.0))
small = st.floats(-1.0, 1.0)


def lowest_clearance(body, ground):
    points = [nose(A), *(wing_tip(side, A) for side in (1.0, -1.0))]
    points += [foot(side, upper, A) for side in (1.0, -1.0) for upper in (1.0, -1.0)]
    return min(clearance(ground, point_motion(body, at)[0]) for at in points)


@entry
def _stood(x, ground, a, steps):
    for _ in range(steps):
        x = step_near_ground(x, OFF, Vector(0.0, 0.0, 0.0), ground, a, 1e-3)
    return x


def level_press(body, at, grip):
    """A contact with the ground z <= 0, written without a plane."""
    p, u = point_motion(body, at)
    if p.z >= 0.0:
        return Vector(0.0, 0.0, 0.0), Vector(0.0, 0.0, 0.0)
    normal = max(0.0, -STIFFNESS * p.z - DAMPING * u.z)
    tx = -DAMPING * u.x - STIFFNESS * (p.x - grip.north)
    ty = -DAMPING * u.y - STIFFNESS * (p.y - grip.west)
    pull = level_norm(tx, ty)
    if pull > FRICTION * normal:
        tx, ty = tx * FRICTION * normal / pull, ty * FRICTION * normal / pull
    force = Vector(tx, ty, normal)
    return force, cross(at, rotate_inverse(body.attitude, force))


@given(deep=st.floats(-0.01, 0.03), tilt=st.tuples(small, small), v=st.tuples(small, small, small))
def test_level_ground_presses_to_the_bit_as_the_ground_at_zero_does(deep, tilt, v):
    q = multiply(from_euler(0.05 * tilt[0], 0.05 * tilt[1], 0.3), hover(0.4))
    body = Body(Vector(1.0, -2.0, A.foot_x - deep), vector(v), q, Vector(0.5, -0.7, 0.2))
    grip = Foot(True, 1.001, -2.002)
    presses = [level_press(body, foot(left, upper, A), grip) for left in (1.0, -1.0) for upper in (1.0, -1.0)]
    forces, moments = zip(*presses, strict=True)
    feet = feet_aloft()._replace(left_upper=grip, left_lower=grip, right_upper=grip, right_lower=grip)
    force, moment = contact(body, feet, LEVEL_GROUND, A)
    nothing = Vector(0.0, 0.0, 0.0)
    assert force == add(add(add(forces[0], forces[1]), add(forces[2], forces[3])), nothing)
    assert moment == add(add(add(moments[0], moments[1]), add(moments[2], moments[3])), nothing)


def turned(ground, v):
    """A vector of level ground, turned with the plane."""
    return rotate(leaning(ground, Quaternion(1.0, 0.0, 0.0, 0.0)), v)


@given(v=st.tuples(small, small, small), w=st.tuples(small, small, small), deep=st.floats(1e-4, 0.03))
def test_a_tilted_plane_presses_as_level_ground_does_seen_along_it(v, w, deep):
    level = Body(Vector(0.01, -0.02, A.foot_x - deep), vector(v), hover(0.4), vector(w))
    here = Vector(0.0, 0.0, SLOPE.height)
    place, motion = add(here, turned(SLOPE, level.position)), turned(SLOPE, level.velocity)
    tilted = Body(place, motion, leaning(SLOPE, level.attitude), level.rates)
    force, moment = contact(level, feet_aloft(), LEVEL_GROUND, A)
    seen, felt = contact(tilted, feet_aloft(), SLOPE, A)
    assert seen == pytest.approx(turned(SLOPE, force), abs=1e-8)
    assert felt == pytest.approx(moment, abs=1e-8)


def test_the_plane_rises_to_where_it_is_said():
    uphill = Vector(10.0 * math.cos(RISES_TO), -10.0 * math.sin(RISES_TO), 0.0)  # world NWU, clockwise from north
    assert height_over(SLOPE, uphill) == pytest.approx(-2.0 - 10.0 * math.tan(math.radians(5.0)))
    assert height_over(SLOPE, Vector(0.0, 0.0, 2.0)) == 0.0
    assert clearance(SLOPE, Vector(0.0, 0.0, 3.0)) == pytest.approx(math.cos(math.radians(5.0)))
    assert ground_plane(0.0, 0.0, 1.0) == LEVEL_GROUND
    assert not is_clear(plant((0.0, 0.0, 2.5)).body, SLOPE)
    assert is_clear(plant((0.0, 0.0, 2.5)).body, LEVEL_GROUND)


@pytest.mark.long
@pytest.mark.parametrize("heading", [0.0, 0.8, -2.5])
def test_it_stands_on_a_slope_leaning_with_it_and_does_not_slide(heading):
    x = _stood(Start(north=3.0, west=-4.0, heading=heading).plant(SLOPE, A), SLOPE, A, 1000)
    settled = x.body.position
    x = _stood(x, SLOPE, A, 20000)
    assert x.body.position == pytest.approx(settled, abs=1e-4)
    assert np.abs(x.body.velocity).max() < 1e-6
    assert x_axis(x.body.attitude).z == pytest.approx(math.cos(math.radians(5.0)), abs=2e-3)
    force, _ = contact(x.body, x.feet, SLOPE, A)
    assert force == pytest.approx((0.0, 0.0, A.m * A.g), abs=1e-3)  # friction and load together carry it
    assert is_touching(x, SLOPE, A)
    assert all(one.grips for one in x.feet)


def test_set_down_upright_on_a_slope_it_comes_to_lean_with_it():
    ground = GroundPlane(0.0, SLOPE.normal)
    x = _stood(plant((0.0, 0.0, A.foot_x + 0.03), (0.0, 0.0, -0.4)), ground, A, 4000)
    assert x_axis(x.body.attitude) == pytest.approx(SLOPE.normal, abs=5e-3)


def test_where_friction_is_too_little_it_does_not_stay():
    steep = ground_plane(0.0, math.radians(40.0), 0.0)
    x = _stood(Start().plant(steep, A), steep, A, 2000)
    assert np.linalg.norm(x.body.velocity) > 0.5


def test_an_impact_counts_towards_the_plane_and_what_crashed_lies_on_it():
    wall = ground_plane(0.0, math.radians(30.0), 0.0)  # rises to the north
    x = Start().plant(wall, A).body._replace(velocity=Vector(10.0, 0.0, 0.0))
    assert impact_speed(x, x, wall, A) == pytest.approx(5.0)
    broken = crashed(plant((5.0, 0.0, 0.0)), wall, A)
    assert is_touching(Plant(x, broken.actuators, broken.feet), wall, A)
    assert abs(lowest_clearance(broken.body, wall)) < 1e-9
