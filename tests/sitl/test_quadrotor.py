"""The plain quadrotor: closed forms and invariants."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.kernels.quadrotor import force_matrix, moment_matrix, quadrotor_step
from sitl.kernels.quaternion import from_euler, rotate
from sitl.kernels.state import ACTUATOR, P, Q, V, W
from tests.support.quadrotor_flight import QUADROTOR as A

HOVER = np.full(4, A.m * A.g / 4.0)
thrusts = st.tuples(*[st.floats(0.0, A.T_max)] * 4).map(np.array)


def state(attitude=(0.0, 0.0, 0.0), w=(0.0, 0.0, 0.0)):
    x = np.zeros(ACTUATOR)
    x[Q : Q + 4], x[W : W + 3] = from_euler(*attitude), w
    return x


def flown(x, u, steps, dt=0.001):
    for _ in range(steps):
        quadrotor_step(x, u, A, dt)
    return x


def test_hover_thrust_holds_it_still():
    assert flown(state(), HOVER, 100) == pytest.approx(state(), abs=1e-12)


def test_without_thrust_it_falls_by_the_parabola():
    x = flown(state((0.3, 0.2, 0.1)), np.zeros(4), 500)
    assert x[P : P + 3] == pytest.approx([0.0, 0.0, -0.5 * A.g * 0.25], abs=1e-9)


@settings(deadline=None, max_examples=30)
@given(u=thrusts)
def test_a_step_accelerates_by_the_input_matrices(u):
    x, dt = state((0.2, -0.3, 0.9)), 1e-6
    expected = rotate(x[Q : Q + 4].copy(), force_matrix() @ u) / A.m - (0.0, 0.0, A.g)
    quadrotor_step(x, u, A, dt)
    assert x[V : V + 3] / dt == pytest.approx(expected, abs=1e-4)
    assert x[W : W + 3] / dt == pytest.approx(moment_matrix(A) @ u / (A.J1, A.J2, A.J3), abs=1e-3)


def test_tumbling_without_moments_keeps_energy_and_angular_momentum():
    x = state(w=(3.0, -4.0, 2.0))
    J = np.array((A.J1, A.J2, A.J3))
    before = J @ x[W : W + 3] ** 2, rotate(x[Q : Q + 4].copy(), J * x[W : W + 3])
    flown(x, HOVER, 1000)
    assert J @ x[W : W + 3] ** 2 == pytest.approx(before[0], rel=1e-9)
    assert rotate(x[Q : Q + 4].copy(), J * x[W : W + 3]) == pytest.approx(before[1], rel=1e-7)
    assert np.linalg.norm(x[Q : Q + 4]) == pytest.approx(1.0, abs=1e-12)


def test_thrusts_are_cut_at_their_limits_and_that_is_told():
    beyond, at = state(), state()
    assert quadrotor_step(beyond, np.array((-1.0, 9.0, 1.0, 1.0)), A, 0.01)
    assert not quadrotor_step(at, np.array((0.0, A.T_max, 1.0, 1.0)), A, 0.01)
    assert (beyond == at).all()


def test_compiled_equals_python():
    u, compiled, python = np.array((1.0, 1.3, 0.9, 1.6)), state((0.1, 0.2, 0.3)), state((0.1, 0.2, 0.3))
    quadrotor_step(compiled, u, A, 0.01)
    getattr(quadrotor_step, "py_func", quadrotor_step)(python, u, A, 0.01)
    assert compiled == pytest.approx(python, rel=1e-12, abs=1e-15)
    assert math.isfinite(compiled.sum())
