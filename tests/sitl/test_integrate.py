"""The step of the plant: its order, its energy, and the same numbers compiled or not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.kernels import ground, integrate, rigid_body, state
from sitl.kernels.aerodynamics import wrench
from sitl.kernels.ground import on_ground
from sitl.kernels.hover_model import inertia
from sitl.kernels.quaternion import from_euler, hover, rotate, rotate_inverse
from sitl.kernels.wind import gust_step
from sitl.vehicle import standing_height

NOMINAL = load("nominal").parameters
STILL = np.zeros(3)
SETTINGS = settings(deadline=None, max_examples=40)

angles = st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3))
vectors = st.tuples(st.floats(-20, 20), st.floats(-20, 20), st.floats(-20, 20))
spins = st.tuples(st.floats(-6, 6), st.floats(-6, 6), st.floats(-6, 6))
controls = st.tuples(st.floats(200, 1000), st.floats(200, 1000), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
heights = st.sampled_from([0.0, 0.1, 50.0])


def plant(height, angle, v, w, u):
    x = np.full(state.SIZE, math.nan)
    x[: state.ANCHOR] = (1.0, -2.0, height, *v, *from_euler(*angle), *w, *u)
    return x


def step(x, command, dt, armed=True):
    integrate.plant_step(x, np.array(command, dtype=float), STILL, armed, NOMINAL, dt)


def manoeuvre(steps):
    """A tenth of a second with all four actuators under way at their rate limits."""
    x = plant(50.0, (0.1, -1.0, 0.4), (4.0, 1.0, -2.0), (0.5, -1.0, 0.3), (500.0, 700.0, 0.3, -0.1))
    for _ in range(steps):
        step(x, (1000.0, 300.0, -0.5, 0.5), 0.1 / steps)
    return x[: state.ACTUATOR]


def test_the_step_is_of_fourth_order_with_the_actuators_moving():
    exact = manoeuvre(400)
    errors = [np.abs(manoeuvre(steps) - exact).max() for steps in (5, 10, 20)]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.3)


@SETTINGS
@given(heights, angles, vectors, spins, controls, st.booleans())
def test_a_compiled_step_equals_a_plain_one(height, angle, v, w, u, armed):
    compiled, plain = plant(height, angle, v, w, u), plant(height, angle, v, w, u)
    command = np.array((800.0, 300.0, 0.2, -0.6))
    for _ in range(2):
        flags = integrate.plant_step(compiled, command, STILL, armed, NOMINAL, 1e-3)
        assert flags == integrate.plant_step.py_func(plain, command, STILL, armed, NOMINAL, 1e-3)
    np.testing.assert_allclose(compiled, plain, rtol=1e-12, atol=1e-12)


@SETTINGS
@given(heights, angles, vectors, spins, controls)
def test_the_compiled_equations_equal_the_plain_ones(height, angle, v, w, u):
    x = plant(height, angle, v, w, u)
    compiled, plain = np.empty(state.ACTUATOR), np.empty(state.ACTUATOR)
    rigid_body.derivative(x, x, STILL, NOMINAL, compiled)
    rigid_body.derivative.py_func(x, x, STILL, NOMINAL, plain)
    np.testing.assert_allclose(compiled, plain, rtol=1e-12, atol=1e-12)
    touched = ground.contact.py_func(x, x, NOMINAL)
    np.testing.assert_allclose(ground.contact(x, x, NOMINAL), touched, rtol=1e-12, atol=1e-12)


@SETTINGS
@given(angles, vectors, spins, controls)
def test_mechanical_energy_changes_by_the_power_of_the_forces_alone(angle, v, w, u):
    """Gyroscopic terms, the change of frame and gravity do no work."""
    x, dx = plant(50.0, angle, v, w, u), np.empty(state.ACTUATOR)
    rigid_body.derivative(x, x, STILL, NOMINAL, dx)
    q, v, w = x[6:10].copy(), x[3:6].copy(), x[10:13]
    rate = NOMINAL.m * (v @ dx[3:6] + NOMINAL.g * dx[2]) + (inertia(NOMINAL) * w) @ dx[10:13]
    v_b = rotate_inverse(q, v)
    acting = np.array(wrench(*v_b, *w, *u, NOMINAL))
    assert rate == pytest.approx(acting[:3] @ v_b + acting[3:] @ w, rel=1e-9, abs=1e-9)
    assert q @ dx[6:10] == pytest.approx(0.0, abs=1e-12)


def test_a_minute_of_tumbling_leaves_the_quaternion_a_unit():
    x = plant(50.0, (0.3, 0.2, 0.1), (0.0, 0.0, 0.0), (5.0, -4.0, 3.0), (0.0, 0.0, 0.0, 0.0))
    for _ in range(60):
        x[2] = 50.0
        for _ in range(100):
            step(x, (0.0, 0.0, 0.0, 0.0), 1e-2, armed=False)
        assert np.linalg.norm(x[6:10]) == pytest.approx(1.0, abs=1e-15)


# On the ground


def test_a_minute_on_the_ground_moves_it_less_than_a_millimetre():
    x = plant(standing_height(NOMINAL), (0.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3, (0.0,) * 4)
    x[6:10] = hover(0.7)
    for _ in range(60_000):
        step(x, (200.0, 200.0, 0.0, 0.0), 1e-3)
    assert np.abs(x[:3] - (1.0, -2.0, standing_height(NOMINAL))).max() < 1e-3
    assert np.abs(x[3:6]).max() < 1e-6
    assert on_ground(x, NOMINAL)


def test_it_takes_off_and_leaves_the_ground_behind():
    x = plant(standing_height(NOMINAL), (0.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3, (0.0,) * 4)
    x[6:10] = hover(0.0)
    for _ in range(1000):
        step(x, (800.0, 800.0, 0.0, 0.0), 1e-3)
    assert x[2] > 0.5
    assert not on_ground(x, NOMINAL)
    assert np.isnan(x[state.ANCHOR :]).all()


@pytest.mark.parametrize("angle", [(0.0, 0.0, 0.0), (0.0, 1.2, 0.0), (1.5, 0.3, 0.0), (3.1, -0.2, 0.0)])
def test_however_it_falls_it_comes_to_lie_on_the_ground(angle):
    """On its belly, nose or wing tip first, or on its back."""
    x = plant(0.6, angle, (2.0, 0.0, -5.0), (1.0, 1.0, 0.0), (0.0,) * 4)
    for _ in range(8000):
        step(x, (0.0, 0.0, 0.0, 0.0), 1e-3, armed=False)
    assert 0.0 < x[2] < NOMINAL.foot_x
    assert np.abs(x[3:6]).max() < 1e-3
    assert on_ground(x, NOMINAL)


def test_contacts_push_and_never_pull():
    x = plant(0.05, (0.0, 0.0, 0.0), (0.0, 0.0, 30.0), (0.0,) * 3, (0.0,) * 4)
    x[6:10] = hover(0.0)
    assert ground.contact(x, x, NOMINAL)[2] >= 0.0


def test_a_stopped_motor_is_at_no_limit():
    x = plant(50.0, (0.0, 0.0, 0.0), (0.0,) * 3, (0.0,) * 3, (0.0,) * 4)
    flags = integrate.plant_step(x, np.zeros(4), STILL, False, NOMINAL, 1e-3)
    assert flags == 0


# Gusts


def test_gusts_fade_over_the_time_it_takes_to_fly_through_them():
    """Without fresh noise e-folding takes length / airspeed; air at rest turns over slowly all the same."""
    gust = np.array([1.0, -2.0, 0.5])
    for _ in range(150):
        gust_step(gust, np.zeros(3), 1.0, 30.0, 20.0, 0.01)
    assert gust == pytest.approx(np.array([1.0, -2.0, 0.5]) / math.e)
    still = np.ones(3)
    gust_step(still, np.zeros(3), 1.0, 30.0, 0.0, 30.0)
    assert still == pytest.approx(np.full(3, 1.0 / math.e))


def test_nose_up_is_a_negative_rotation_about_y():
    nose = rotate(from_euler(0.0, -0.3, 0.0), np.array((1.0, 0.0, 0.0)))
    assert nose == pytest.approx([math.cos(0.3), 0.0, math.sin(0.3)])
