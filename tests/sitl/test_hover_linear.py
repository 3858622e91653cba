"""The linear hover law: its frame, its Lyapunov value, its integral."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.design.lqr import hover_gains
from sitl.kernels.quaternion import from_euler, from_rotation_vector, hover, multiply, rotate
from sitl.kernels.state import SIZE, P, Q, V, W
from sitl.laws import hover_linear as law

A = load("nominal").parameters
LQI = hover_gains(A)
headings = st.floats(-math.pi, math.pi)
offsets = st.tuples(*[st.floats(-8.0, 8.0)] * 3).map(np.array)
tilts = st.tuples(*[st.floats(-0.8, 0.8)] * 3).map(np.array)


def plant(p, v, q, w):
    x = np.zeros(SIZE)
    x[P : P + 3], x[V : V + 3], x[Q : Q + 4], x[W : W + 3] = p, v, q, w
    return x


def error(x, target, heading):
    dx = np.empty(12)
    law.error(x, np.array(target, dtype=float), heading, dx)
    return dx


def control(dx, integral=(0.0, 0.0, 0.0), heading=0.0, gains=LQI):
    u = np.empty(4)
    law.control(dx, np.array(integral), heading, gains, u)
    return u


def integrated(x, target, seconds, gains=LQI, integral=(0.0, 0.0, 0.0)):
    kept = np.array(integral)
    for _ in range(round(seconds / 0.002)):
        law.integrate(x, np.array(target, dtype=float), kept, gains, 0.002)
    return kept


@settings(deadline=None)
@given(heading=headings, target=offsets)
def test_hovering_at_the_target_is_no_error_and_needs_the_hover_thrust(heading, target):
    dx = error(plant(target, (0, 0, 0), hover(heading), (0, 0, 0)), target, heading)
    assert dx == pytest.approx(np.zeros(12), abs=1e-12)
    assert control(dx, heading=heading) == pytest.approx(LQI.u_bar)


@settings(deadline=None)
@given(turn=headings, heading=headings, p=offsets, tilt=tilts, integral=offsets)
def test_the_law_knows_no_north(turn, heading, p, tilt, integral):
    """Everything turned about the vertical: the same error and the same commands."""
    q_z, q, v = from_euler(0.0, 0.0, turn), multiply(hover(heading), from_rotation_vector(tilt)), 0.3 * p
    dx = error(plant(p, v, q, (0.1, 0.2, 0.3)), (0, 0, 0), heading)
    turned = plant(rotate(q_z, p), rotate(q_z, v), multiply(q_z, q), (0.1, 0.2, 0.3))
    assert error(turned, (0, 0, 0), heading + turn) == pytest.approx(dx, abs=1e-9)
    u = control(dx, integral, heading)
    assert control(dx, rotate(q_z, integral), heading + turn) == pytest.approx(u, abs=1e-6)


@settings(deadline=None)
@given(heading=headings, tilt=tilts)
def test_the_sign_of_the_quaternion_does_not_matter(heading, tilt):
    q = multiply(hover(heading), from_rotation_vector(tilt))
    either = [error(plant((1, 2, 3), (0, 0, 0), s * q, (0, 0, 0)), (0, 0, 0), heading) for s in (1.0, -1.0)]
    assert either[0] == pytest.approx(either[1], abs=1e-12)


@settings(deadline=None)
@given(p=offsets, tilt=tilts)
def test_v_is_the_quadratic_form_and_positive(p, tilt):
    dx = error(plant(p, -0.2 * p, multiply(hover(0.0), from_rotation_vector(tilt)), tilt), (0, 0, 0), 0.0)
    V = law.lyapunov(dx, LQI)
    assert pytest.approx(dx @ LQI.S @ dx, rel=1e-9, abs=1e-12) == V
    assert V >= 0.0
    assert law.lyapunov(np.zeros(12), LQI) == 0.0


@settings(deadline=None)
@given(direction=tilts, distance=st.floats(0.0, 100.0))
def test_the_law_is_linear_within_reach_and_constant_beyond(direction, distance):
    unit = np.array((1.0, 0.0, 0.0)) + direction
    unit /= np.linalg.norm(unit)
    dx = np.zeros(12)
    dx[:3] = distance * unit
    seen = dx * min(1.0, LQI.reach / max(distance, 1e-9))
    assert control(dx) == pytest.approx(LQI.u_bar - LQI.K @ seen, rel=1e-9, abs=1e-9)
    assert control(dx, gains=LQI._replace(reach=math.inf)) == pytest.approx(LQI.u_bar - LQI.K @ dx, rel=1e-9, abs=1e-9)


def test_the_integral_holds_against_what_pushes():
    """Ahead of the target for a while: the law tips the nose back more than without the integral."""
    x = plant((0.5, 0, 0), (0, 0, 0), hover(0.0), (0, 0, 0))
    dx, kept = error(x, (0, 0, 0), 0.0), integrated(x, (0, 0, 0), 2.0)
    assert kept == pytest.approx([1.0, 0.0, 0.0])
    assert (control(dx, kept)[2:] > control(dx)[2:]).all()


def test_approaching_at_the_lead_s_speed_does_not_wind_it_up():
    x = plant((-1.3, 0, 0), (1.3 / LQI.lead, 0, 0), hover(0.0), (0, 0, 0))
    assert integrated(x, (0, 0, 0), 5.0) == pytest.approx([0.0, 0.0, 0.0], abs=1e-9)


@settings(deadline=None, max_examples=20)
@given(p=offsets, integral=offsets)
def test_the_integral_and_its_rate_are_bounded(p, integral):
    x = plant(100.0 * p, (0, 0, 0), hover(0.0), (0, 0, 0))
    once = integrated(x, (0, 0, 0), 0.002, integral=integral)
    assert np.abs(once - integral).max() <= 0.002 * LQI.integral_limit + 1e-12
    small = LQI._replace(bound=0.5)
    assert np.abs(integrated(x, (0, 0, 0), 2.0, small, np.clip(integral, -0.5, 0.5))).max() <= 0.5


def test_without_integral_gain_the_integral_says_nothing():
    lqr = hover_gains(A, integral=False)
    dx = error(plant((1, 2, 3), (0, 0, 0), hover(0.0), (0, 0, 0)), (0, 0, 0), 0.0)
    assert (control(dx, (5.0, 5.0, 5.0), gains=lqr) == control(dx, gains=lqr)).all()


def test_compiled_equals_python():
    x = plant((1, -2, 3), (0.1, 0.2, 0.3), multiply(hover(0.4), from_euler(0.1, 0.2, 0.3)), (1, 2, 3))
    dx, u, python_dx, python_u = error(x, (0, 0, 1), 0.4), np.empty(4), np.empty(12), np.empty(4)
    getattr(law.error, "py_func", law.error)(x, np.array((0.0, 0.0, 1.0)), 0.4, python_dx)
    getattr(law.control, "py_func", law.control)(dx, np.array((1.0, 2.0, 3.0)), 0.4, LQI, python_u)
    law.control(dx, np.array((1.0, 2.0, 3.0)), 0.4, LQI, u)
    assert dx == pytest.approx(python_dx, rel=1e-12)
    assert u == pytest.approx(python_u, rel=1e-9)
    python = getattr(law.lyapunov, "py_func", law.lyapunov)
    assert law.lyapunov(dx, LQI) == pytest.approx(python(dx, LQI), rel=1e-12)
