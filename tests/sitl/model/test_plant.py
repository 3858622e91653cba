"""The step of the plant: its order, what it conserves, and the same bits compiled or not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.plant import derivative, is_finite, step, step_in_air, step_in_swirl
from sitl.model.quaternions import from_euler, multiply, rotate, rotate_inverse
from sitl.model.vectors import Vector
from tests.support.flights.estimates import STILL, rotation, vector
from tests.support.flights.plant_flight import OFF, actuators, fly, plant

NOMINAL = load("nominal").parameters
VACUUM = NOMINAL._replace(rho=1e-12, k_f=1e-30, k_m=1e-30, S_ratio=1e-12)
J = np.array((NOMINAL.J1, NOMINAL.J2, NOMINAL.J3))

angles = st.tuples(st.floats(-3, 3), st.floats(-1.5, 1.5), st.floats(-3, 3))
vectors = st.builds(Vector, *[st.floats(-20, 20)] * 3)
spins = st.builds(Vector, *[st.floats(-6, 6)] * 3)
controls = st.tuples(st.floats(200, 1000), st.floats(200, 1000), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
heights = st.sampled_from([0.0, 0.1, 50.0])


def manoeuvre(steps):
    """A tenth of a second with all four actuators under way at their rate limits."""
    start = plant(v=(4, 1, -2), q=from_euler(0.1, -1.0, 0.4), w=(0.5, -1.0, 0.3), u=(500, 700, 0.3, -0.1))
    return np.concatenate(fly(start, NOMINAL, 0.1, (1000.0, 300.0, -0.5, 0.5), dt=0.1 / steps).body)


def test_the_step_is_of_fourth_order_with_the_actuators_moving():
    exact = manoeuvre(400)
    errors = [np.abs(manoeuvre(steps) - exact).max() for steps in (5, 10, 20)]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.3)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.3)


@settings(max_examples=40)
@given(heights, angles, vectors, spins, controls, st.booleans())
def test_a_compiled_step_equals_a_plain_one_to_the_bit(height, angle, v, w, u, armed):
    start = plant((1.0, -2.0, height), v, from_euler(*angle), w, u)
    command, plain = actuators((800.0, 300.0, 0.2, -0.6)), start
    for _ in range(2):
        plain = step(plain, command, vector(STILL), armed, NOMINAL, 1e-3)
    assert fly(start, NOMINAL, 2e-3, command, armed=armed) == plain


@settings(max_examples=40)
@given(angles, vectors, spins, controls)
def test_mechanical_energy_changes_by_the_power_of_the_forces_alone(angle, v, w, u):
    """Gyroscopic terms, the change of frame and gravity do no work."""
    x = plant(v=v, q=from_euler(*angle), w=w, u=u)
    none = vector(STILL)
    rate = derivative(x.body, x.actuators, none, none, none, NOMINAL)
    power = NOMINAL.m * (np.dot(v, rate.velocity) + NOMINAL.g * rate.position.z) + np.dot(J * w, rate.rates)
    v_b = rotate_inverse(x.body.attitude, v)
    F, M = wrench(v_b, w, x.actuators, NOMINAL)
    assert power == pytest.approx(np.dot(F, v_b) + np.dot(M, w), rel=1e-9, abs=1e-9)
    assert np.dot(x.body.attitude, rate.attitude) == pytest.approx(0.0, abs=1e-12)


def test_a_minute_of_tumbling_leaves_the_quaternion_a_unit():
    x = plant(q=from_euler(0.3, 0.2, 0.1), w=(5.0, -4.0, 3.0))
    for _ in range(60):
        x = x._replace(body=x.body._replace(position=Vector(1.0, -2.0, 50.0)))
        x = fly(x, NOMINAL, 1.0, armed=False, dt=1e-2)
        assert np.linalg.norm(x.body.attitude) == pytest.approx(1.0, abs=1e-15)


def test_free_fall_in_a_vacuum_is_exact():
    body = fly(plant(v=(1.0, 2.0, 3.0)), VACUUM, 1.0).body
    assert body.position == pytest.approx((1.0, 2.0, 53.0 - 0.5 * VACUUM.g), abs=1e-9)
    assert body.velocity.z == pytest.approx(3.0 - VACUUM.g, abs=1e-9)


@settings(max_examples=8)
@given(spins)
def test_a_torque_free_tumble_keeps_angular_momentum_and_energy(w):
    def kept(body):
        momentum = J * body.rates
        return (*rotate(body.attitude, vector(momentum)), 0.5 * np.dot(momentum, body.rates))

    x = plant(w=w)
    after = fly(x, VACUUM, 1.0).body
    assert kept(after) == pytest.approx(kept(x.body), abs=1e-9)
    assert np.linalg.norm(after.attitude) == pytest.approx(1.0, abs=1e-12)


@settings(max_examples=10)
@given(st.floats(-3, 3), vectors)
def test_turning_the_world_turns_the_flight(heading, v):
    q, turn, u = from_euler(0.1, -0.8, 0.3), rotation((0.0, 0.0, heading)), (650.0, 700.0, 0.1, -0.1)
    plain = fly(plant(v=v, q=q, u=u), NOMINAL, 0.2, u).body
    turned = fly(plant(v=rotate(turn, v), q=multiply(turn, q), u=u), NOMINAL, 0.2, u).body
    assert rotate(turn, plain.velocity) == pytest.approx(turned.velocity, rel=1e-6, abs=1e-6)
    assert plain.rates == pytest.approx(turned.rates, rel=1e-6, abs=1e-6)


@settings(max_examples=10)
@given(vectors)
def test_only_the_velocity_through_the_air_matters(wind):
    command = (650.0, 650.0, 0.0, 0.0)
    still = fly(plant(v=(3.0, 1.0, 0.0)), NOMINAL, 0.2, command).body
    moved = fly(plant(v=np.add((3.0, 1.0, 0.0), wind)), NOMINAL, 0.2, command, wind=wind).body
    assert np.subtract(moved.velocity, wind) == pytest.approx(np.array(still.velocity), abs=1e-9)
    assert moved.attitude + moved.rates == pytest.approx(still.attitude + still.rates, abs=1e-9)


def test_two_equal_flights_are_bit_identical():
    start = plant(v=(3.0, 0.0, 0.0), u=(600, 640, 0.1, 0.2))
    assert fly(start, NOMINAL, 0.5, (700, 690, 0.2, 0.1)) == fly(start, NOMINAL, 0.5, (700, 690, 0.2, 0.1))


@pytest.mark.parametrize("number", [math.nan, math.inf, -math.inf])
def test_a_number_that_is_none_is_seen_wherever_it_is(number):
    x = plant()
    assert is_finite(x)
    assert not is_finite(plant(p=(0.0, number, 0.0)))
    assert not is_finite(plant(v=(0.0, 0.0, number)))
    assert not is_finite(plant(q=(1.0, 0.0, number, 0.0)))
    assert not is_finite(plant(w=(number, 0.0, 0.0)))
    assert not is_finite(plant(u=(*OFF[:3], number)))


@settings(max_examples=20)
@given(angles, vectors, spins, controls)
def test_where_the_air_does_not_turn_a_step_through_swirl_is_one_through_air(angle, v, w, u):
    start, wanted, wind = (
        plant(v=v, q=from_euler(*angle), w=w, u=u),
        actuators((800.0, 300.0, 0.2, -0.3)),
        vector(STILL),
    )
    turning = step_in_swirl(start, wanted, wind, vector(STILL), NOMINAL, 0.01)
    assert turning == step_in_air(start, wanted, wind, NOMINAL, 0.01)


def test_air_that_turns_takes_the_vehicle_along():
    wind, rolling = vector(STILL), Vector(0.0, 0.0, 3.0)  # upright: about its nose
    x = plant(v=(0.0, 0.0, 8.0), u=(600.0, 600.0, 0.0, 0.0))
    after = step_in_swirl(x, x.actuators, wind, rolling, NOMINAL, 1e-3).body
    assert after.rates.x > step_in_air(x, x.actuators, wind, NOMINAL, 1e-3).body.rates.x + 1e-4
