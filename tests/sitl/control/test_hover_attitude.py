"""The attitude law: reference, loop and Lyapunov value; its flights are in tests/sitl/flights/test_attitude.py."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.control import handover
from sitl.control import hover_attitude as law
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.estimate import air_ahead
from sitl.control.hover_attitude import Steering
from sitl.control.hover_zero_moment import AttitudeTarget, attitude_torque, axial_force
from sitl.control.reference import AttitudeReference, steer
from sitl.design.gains import attitude_gains, zero_moment_gains
from sitl.model.aerodynamics import force_matrix
from sitl.model.airframe_files import load
from sitl.model.quaternions import conjugate, hover, multiply, rotate, rotate_inverse
from sitl.model.vectors import Vector
from tests.support.flights.estimates import STILL, estimate, reference, rotation, turned, vector

A = load("nominal").parameters
LOOP = zero_moment_gains(A)
GAINS = attitude_gains(LOOP)
DT = 0.002
J = np.array(LOOP.J)
vectors = st.builds(Vector, *[st.floats(-3.0, 3.0)] * 3)


def wanted(q, rates=STILL, thrust=0.5):
    return steer(reference(), AttitudeReference(q, vector(rates), thrust))


def stepped(seen, asked, steering, seconds):
    for _ in range(round(seconds / DT)):
        state = law.AttitudeState(steering, handover.none())
        command, saturation, (steering, _) = law.step(seen, asked, GAINS, A, state, DT)
    return command, saturation, steering


def angle(q, other):
    return 2.0 * math.acos(min(1.0, abs(multiply(conjugate(q), other).w)))


def test_the_attitude_loop_takes_v_away_whenever_it_turns():
    """V' = -2 zeta / lambda |omega_e|^2 along the rigid body, whatever the attitudes, rates and reference's path."""
    rng, h = np.random.default_rng(3), 1e-6
    for _ in range(200):
        w_r, w_r_dot, w = rng.normal(size=(3, 3))
        q, q_r = rotation(rng.normal(size=3)), rotation(rng.normal(size=3))
        steering = Steering(q_r, vector(w_r), 5.0, vector(STILL))
        before = law.lyapunov(estimate(q=q, w=w), GAINS, steering)
        target = AttitudeTarget(q_r, vector(w_r), vector(w_r_dot))
        torque = np.array(attitude_torque(q, vector(w), target, LOOP, NOT_CHOSEN))
        w_e = w - np.array(rotate_inverse(multiply(conjugate(q_r), q), vector(w_r)))
        after = estimate(q=turned(q, h * w), w=w + h * (torque - np.cross(w, J * w)) / J)
        moved = Steering(turned(q_r, h * w_r), vector(w_r + h * w_r_dot), 5.0, vector(STILL))
        fall = (law.lyapunov(after, GAINS, moved) - before) / h
        assert fall == pytest.approx(-2.0 * LOOP.zeta / LOOP.lam * w_e @ w_e, abs=5e-4)


@given(theta=vectors, w=vectors)
def test_v_of_a_small_error_is_half_of_its_squares(theta, w):
    small, slow = [1e-3 * x for x in theta], [1e-2 * x for x in w]
    steering = Steering(hover(0.4), Vector(0.0, 0.0, 0.0), 5.0, Vector(0.0, 0.0, 0.0))
    V = law.lyapunov(estimate(q=turned(hover(0.4), small), w=slow), GAINS, steering)
    assert pytest.approx(0.5 * (np.dot(small, small) + np.dot(slow, slow) / LOOP.lam**2), rel=1e-4, abs=1e-12) == V


@settings(max_examples=30)
@given(phi=vectors, w=vectors, omega=st.floats(200.0, 1000.0))
def test_it_begins_where_the_vehicle_is(phi, w, omega):
    seen = estimate(q=rotation(phi), w=w, actuators=(omega, omega, 0.0, 0.0))
    steering = law.start(seen, GAINS, A)
    assert (steering.attitude, steering.rates) == (seen.attitude, seen.rates)
    assert steering.force == min(max(axial_force(seen.actuators, air_ahead(seen), A), LOOP.f_min), LOOP.f_max)
    assert law.lyapunov(seen, GAINS, steering) == pytest.approx(0.0, abs=1e-12)


@settings(max_examples=15)
@given(phi=vectors, rates=vectors, w=vectors, thrust=st.floats(0.0, 1.0))
def test_the_reference_keeps_its_limits_whatever_is_asked_for(phi, rates, w, thrust):
    asked, steering = wanted(rotation(phi), rates, thrust), Steering(hover(0.0), w, 5.0, Vector(0.0, 0.0, 0.0))
    for _ in range(50):
        _, _, after = stepped(estimate(), asked, steering, DT)
        assert np.linalg.norm(after.rates) <= GAINS.max_rate * (1.0 + 1e-12)
        if np.linalg.norm(steering.rates) <= GAINS.max_rate:
            change = np.subtract(after.rates, steering.rates)
            assert np.linalg.norm(change) <= DT * GAINS.max_acceleration * (1.0 + 1e-9)
        assert np.linalg.norm(after.attitude) == pytest.approx(1.0, abs=1e-12)
        assert LOOP.f_min <= after.force <= LOOP.f_max
        steering = after


@pytest.mark.parametrize("phi", [(0.5, 0.0, 0.0), (0.0, -0.7, 0.2), (0.3, 0.3, -0.6)])
def test_the_reference_comes_to_the_command_without_overshoot(phi):
    steering, target = law.start(estimate(), GAINS, A), turned(hover(0.0), phi)
    left = []
    for _ in range(750):
        _, _, steering = stepped(estimate(), wanted(target), steering, DT)
        left.append(angle(steering.attitude, target))
    assert left[-1] < 0.01
    assert max(np.diff(left)) < 1e-6


def test_the_reference_turns_with_a_command_that_turns():
    rate = Vector(1.0, 0.0, 0.0)
    steering = Steering(hover(0.0), rate, 5.0, Vector(0.0, 0.0, 0.0))
    for k in range(500):
        _, _, steering = stepped(estimate(), wanted(turned(hover(0.0), (k * DT, 0.0, 0.0)), rate), steering, DT)
    assert steering.rates == pytest.approx(rate, abs=1e-3)
    assert angle(steering.attitude, turned(hover(0.0), (500 * DT, 0.0, 0.0))) < 1e-3


def test_the_shortest_way_is_taken_whatever_the_signs():
    target = turned(hover(0.0), (0.5, 0.0, 0.0))
    for asked in (target, type(target)(*(-x for x in target))):
        _, _, steering = stepped(estimate(), wanted(asked), law.start(estimate(), GAINS, A), 0.1)
        assert steering.rates.x > 0.1


def test_the_whole_thrust_is_both_motors_at_their_limit():
    F = force_matrix(A) @ (A.k_f * A.omega_max**2 * np.array((1.0, 1.0, 0.0, 0.0)))
    assert pytest.approx(law.full_force(A)) == F[0]
    _, _, steering = stepped(estimate(), wanted(hover(0.0), thrust=0.6), law.start(estimate(), GAINS, A), 0.5)
    assert steering.force == pytest.approx(0.6 * law.full_force(A), rel=1e-3)


def test_a_tilt_that_is_held_is_commanded_with_its_force_and_no_moment():
    q = turned(hover(0.0), (0.0, 0.4, 0.0))
    lift = A.m * A.g / rotate(q, Vector(1.0, 0.0, 0.0)).z
    T = 0.5 * lift / float(force_matrix(A)[0, 0])
    omega = math.sqrt(T / A.k_f)
    seen = estimate(q=q, actuators=(omega, omega, 0.0, 0.0))
    command, saturation, _ = stepped(seen, wanted(q, thrust=lift / law.full_force(A)), law.start(seen, GAINS, A), DT)
    assert command == pytest.approx((omega, omega, 0.0, 0.0), abs=1e-9)
    assert saturation == 0


@pytest.mark.long
def test_compiled_equals_python():
    seen = estimate((1, 2, 3), (0.3, 0.1, 0.2), turned(hover(0.3), (0.1, -0.2, 0.3)), (0.3, 0.2, 0.1), (1, 0, 0))
    steering = Steering(hover(0.2), Vector(0.1, 0.2, 0.3), 5.0, Vector(1e-3, 2e-3, 3e-3))
    asked = wanted(turned(hover(0.0), (0.4, 0.5, 0.6)), (0.1, 0.0, 0.0))
    state = seen, asked, GAINS, A, steering, handover.requested()
    assert entry(_ticked)(*state) == _ticked(*state)


def _ticked(seen, asked, gains, a, steering, transfer):
    state = law.AttitudeState(steering, transfer)
    return law.step(seen, asked, gains, a, state, DT), law.lyapunov(seen, gains, steering)
