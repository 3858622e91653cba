"""The plain quadrotor: closed forms and invariants."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.control.allocation import Virtual
from sitl.lab.reproduction.equations.quadrotor import QUADROTOR as A
from sitl.lab.reproduction.equations.quadrotor import force_matrix, moment_matrix, quadrotor_gains, step
from sitl.model.quaternions import from_euler, rotate
from sitl.model.state import Body
from sitl.model.vectors import Vector
from tests.support.flights.estimates import STILL, vector

HOVER = Virtual(*[A.m * A.g / 4.0] * 4)
J = np.array((A.J1, A.J2, A.J3))
thrusts = st.builds(Virtual, *[st.floats(0.0, A.T_max)] * 4)


def state(attitude=STILL, w=STILL):
    return Body(vector(STILL), vector(STILL), from_euler(*attitude), vector(w))


def flown(body, u, steps, dt=0.001):
    for _ in range(steps):
        body, _ = step(body, u, A, dt)
    return body


def test_hover_thrust_holds_it_still():
    assert np.concatenate(flown(state(), HOVER, 100)) == pytest.approx(np.concatenate(state()), abs=1e-12)


def test_without_thrust_it_falls_by_the_parabola():
    body = flown(state((0.3, 0.2, 0.1)), Virtual(0.0, 0.0, 0.0, 0.0), 500)
    assert body.position == pytest.approx((0.0, 0.0, -0.5 * A.g * 0.25), abs=1e-9)


@settings(max_examples=30)
@given(u=thrusts)
def test_a_step_accelerates_by_the_input_matrices(u):
    body, dt = state((0.2, -0.3, 0.9)), 1e-6
    force = vector(force_matrix() @ u)
    after, _ = step(body, u, A, dt)
    expected = np.array(rotate(body.attitude, force)) / A.m - (0.0, 0.0, A.g)
    assert np.array(after.velocity) / dt == pytest.approx(expected, abs=1e-4)
    assert np.array(after.rates) / dt == pytest.approx(moment_matrix(A) @ u / J, abs=1e-3)


def test_tumbling_without_moments_keeps_energy_and_angular_momentum():
    def kept(body):
        momentum = J * body.rates
        return momentum @ body.rates, rotate(body.attitude, vector(momentum))

    before = state(w=(3.0, -4.0, 2.0))
    after = flown(before, HOVER, 1000)
    assert kept(after)[0] == pytest.approx(kept(before)[0], rel=1e-9)
    assert kept(after)[1] == pytest.approx(kept(before)[1], rel=1e-7)
    assert np.linalg.norm(after.attitude) == pytest.approx(1.0, abs=1e-12)


def test_thrusts_are_limited_and_the_step_reports_it():
    beyond, was_limited = step(state(), Virtual(-1.0, 9.0, 1.0, 1.0), A, 0.01)
    at, was_not = step(state(), Virtual(0.0, A.T_max, 1.0, 1.0), A, 0.01)
    assert (was_limited, was_not) == (True, False)
    assert beyond == at


def test_the_law_s_allocation_is_the_pseudo_inverse_and_a_unit_force():
    gains = quadrotor_gains()
    assert np.array(gains.M_pinv) == pytest.approx(np.linalg.pinv(moment_matrix(A)))
    assert force_matrix() @ gains.u_bar == pytest.approx([0.0, 0.0, 1.0])
    assert gains.d == Vector(0.0, 0.0, 1.0)


@pytest.mark.long
def test_compiled_equals_python():
    u, body = Virtual(1.0, 1.3, 0.9, 1.6), state((0.1, 0.2, 0.3), (1.0, 2.0, 3.0))
    assert entry(_stepped)(body, u) == _stepped(body, u)


def _stepped(body, u):
    return step(body, u, A, 0.01)
