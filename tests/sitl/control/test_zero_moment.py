"""The zero-moment law against appendix D, and its laws on any plant."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.control import hover_zero_moment as law
from sitl.control.governor import ERROR, LINEAR, QUASI_OPTIMAL_NORM, VELOCITY
from sitl.control.hover_zero_moment import Pointing
from sitl.design.gains import moment_inverse, zero_moment_gains
from sitl.lab.reproduction.equations.quadrotor import quadrotor_gains
from sitl.model.aerodynamics import force_matrix, moment_matrix
from sitl.model.airframe_files import load
from sitl.model.quaternions import conjugate, from_euler, hover, multiply, rotate, z_axis
from sitl.model.state import Body
from sitl.model.vectors import Vector, add_scaled
from tests.support.flights import appendix_d
from tests.support.flights.estimates import estimate, negated, quaternion, rotation, turned, vector
from tests.support.flights.quadrotor_flight import fly

A = load("nominal").parameters
SPEED, DT = 3.0, 0.002
ZERO = Vector(0.0, 0.0, 0.0)
headings = st.floats(-math.pi, math.pi)


def gains(**choice):
    return zero_moment_gains(A, **({"governor": LINEAR} | choice))


def matrix(q):
    return np.column_stack([rotate(q, vector(axis)) for axis in np.eye(3)])


def random_states(count):
    random = np.random.default_rng(7)
    for _ in range(count):
        q = turned(hover(random.uniform(-3, 3)), random.normal(0, 0.3, 3))
        q_d = turned(q, random.normal(0, 0.2, 3))
        e, v, w = (vector(random.normal(0, size, 3)) for size in (2, 1, 1))
        yield Body(e, v, q, w), Pointing(q_d, random.uniform(4.0, 7.0))


def at_rest(q, e=ZERO, v=ZERO):
    return Body(e, v, q, ZERO)


def nu(body, pointing, g):
    later = law.ahead(body, pointing, g)
    return law.nu(law.wanted_force(body, SPEED, g), law.wanted_force(later, SPEED, g), pointing, g)


def steered(body, pointing, q_ref, g):
    return law.steer(nu(body, pointing, g), pointing, q_ref, g)


def of_appendix_d(body, pointing):
    e, v, q, w = body
    return appendix_d.State(np.array(e), np.array(v), matrix(q), matrix(pointing.attitude), np.array(w), pointing.force)


@pytest.mark.parametrize("nu_prime", [False, True])
def test_nu_and_its_derivative_are_those_of_appendix_d(nu_prime):
    """Along the flow of the simplified model, central difference against the corrected expansion."""
    g, h = gains(nu_prime=nu_prime, k_q=0.0), 1e-5
    for body, pointing in random_states(20):
        x = of_appendix_d(body, pointing)
        a = vector(x.R @ g.d * pointing.force / g.m - (0.0, 0.0, g.g))
        w_d, f_dot = steered(body, pointing, hover(0.0), g)

        def along(t, body=body, pointing=pointing, a=a, w_d=w_d, f_dot=f_dot):
            e, v, q, w = body
            there = Body(add_scaled(e, v, t), add_scaled(v, a, t), turned(q, [t * rate for rate in w]), w)
            moved = Pointing(turned(pointing.attitude, [t * rate for rate in w_d]), pointing.force + t * f_dot)
            return np.array(nu(there, moved, g))

        assert along(0.0) == pytest.approx(appendix_d.nu(x, g), rel=1e-9, abs=1e-9)
        assert np.array(w_d) == pytest.approx(appendix_d.w_d(x, g), rel=1e-9, abs=1e-9)
        assert f_dot == pytest.approx(appendix_d.f_dot(x, g), rel=1e-9, abs=1e-9)
        rate = (along(h) - along(-h)) / (2.0 * h)
        assert rate == pytest.approx(appendix_d.nu_dot(x, g), rel=1e-5, abs=1e-4)


def test_the_feed_forward_of_nu_prime_is_appendix_d_s():
    g = gains(nu_prime=True, k_q=0.0)
    for body, pointing in random_states(20):
        w_d, w_d_dot, f_dot = law.desired_motion(body, hover(0.0), SPEED, g, pointing)
        assert (w_d, f_dot) == steered(body, pointing, hover(0.0), g)
        expected = appendix_d.w_d_dot(of_appendix_d(body, pointing), g)
        assert np.array(w_d_dot) == pytest.approx(expected, abs=0.01 * np.linalg.norm(expected) + 0.05)


@settings(max_examples=30)
@given(heading=headings, twist=st.floats(-2.5, 2.5))
def test_the_heading_term_turns_about_the_thrust_alone_towards_the_reference(heading, twist):
    g = gains()
    pointing = Pointing(turned(hover(heading), (twist, 0.0, 0.0)), A.m * A.g)
    w_d, f_dot = steered(at_rest(pointing.attitude), pointing, hover(heading), g)
    assert w_d == pytest.approx((-math.sin(0.5 * twist), 0.0, 0.0), abs=1e-9)
    assert f_dot == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("governor", [LINEAR, QUASI_OPTIMAL_NORM, VELOCITY])
@settings(max_examples=20)
@given(turn=headings)
def test_the_law_knows_no_north(governor, turn):
    """Everything turned about the vertical: the same commands."""
    g, q_z = gains(governor=governor), from_euler(0.0, 0.0, turn)
    body, pointing = next(random_states(1))
    u, after = law.control(body, hover(0.3), SPEED, g, pointing, DT)
    turned_pointing = Pointing(multiply(q_z, pointing.attitude), pointing.force)
    e, v, q, w = body
    there = Body(rotate(q_z, e), rotate(q_z, v), multiply(q_z, q), w)
    u_turned, after_turned = law.control(there, multiply(q_z, hover(0.3)), SPEED, g, turned_pointing, DT)
    assert u_turned == pytest.approx(u, abs=1e-6)
    assert after_turned.force == pytest.approx(after.force)
    assert after_turned.attitude == pytest.approx(multiply(q_z, after.attitude), abs=1e-9)


def test_the_sign_of_a_quaternion_does_not_matter():
    g, (body, pointing), q_ref = gains(), next(random_states(1)), hover(0.0)
    u, _ = law.control(body, q_ref, SPEED, g, pointing, DT)
    for seen, kept, wanted in (
        (body._replace(attitude=negated(body.attitude)), pointing, q_ref),
        (body, pointing._replace(attitude=negated(pointing.attitude)), q_ref),
        (body, pointing, negated(q_ref)),
    ):
        flipped, _ = law.control(seen, wanted, SPEED, g, kept, DT)
        assert flipped == pytest.approx(u, abs=1e-6)


@settings(max_examples=30)
@given(omega=st.floats(0.0, 1000.0), heading=headings)
def test_it_begins_at_the_attitude_and_with_the_force_there_is_within_its_bounds(omega, heading):
    g = gains()
    pointing = law.start(estimate((1, 2, 3), q=hover(heading), actuators=(omega, omega, 0.0, 0.0)), g, A)
    thrusts = np.array((1.0, 1.0, 0.0, 0.0)) * A.k_f * omega**2
    assert pointing.attitude == hover(heading)
    assert pointing.force == pytest.approx(min(max((force_matrix(A) @ thrusts)[0], g.f_min), g.f_max))


def test_at_the_target_after_a_start_the_command_is_the_hover_s():
    g, pointing = gains(), Pointing(hover(0.5), A.m * A.g)
    goal = law.HoverGoal(Vector(1.0, 2.0, 3.0), 0.5, SPEED)
    u, after = law.fly_to(estimate((1, 2, 3), q=hover(0.5)), goal, g, pointing, DT)
    assert moment_matrix(A) @ u == pytest.approx(np.zeros(3), abs=1e-9)
    assert force_matrix(A) @ u == pytest.approx([A.m * A.g, 0.0, 0.0], abs=1e-9)
    assert after.attitude == pytest.approx(pointing.attitude, abs=1e-9)
    assert after.force == pytest.approx(pointing.force, abs=1e-9)


@pytest.mark.parametrize("governor", [LINEAR, ERROR, QUASI_OPTIMAL_NORM, VELOCITY])
@settings(max_examples=40)
@given(
    e=st.builds(Vector, *[st.floats(-500.0, 500.0)] * 3),
    v=st.builds(Vector, *[st.floats(-15.0, 15.0)] * 3),
    tilt=st.tuples(*[st.floats(-3.0, 3.0)] * 3),
    start=st.floats(0.0, 1.0),
)
def test_f_stays_within_its_bounds_and_q_d_unit(governor, e, v, tilt, start):
    """Omega_d divides by f, so it must stay positive; whatever the state, the commands are finite."""
    g = gains(governor=governor)
    q = turned(hover(0.0), tilt)
    pointing = Pointing(q, g.f_min + start * (g.f_max - g.f_min))
    for _ in range(20):
        u, pointing = law.control(at_rest(q, e, v), hover(0.0), SPEED, g, pointing, DT)
        assert np.isfinite(u).all()
        assert g.f_min <= pointing.force <= g.f_max
        assert np.linalg.norm(pointing.attitude) == pytest.approx(1.0)


def test_the_desired_attitude_moves_by_the_exponential_map():
    g, (body, pointing) = gains(), next(random_states(1))
    w_d, f_dot = steered(body, pointing, hover(0.0), g)
    _, after = law.control(body, hover(0.0), SPEED, g, pointing, DT)
    moved = multiply(conjugate(pointing.attitude), after.attitude)
    assert moved == pytest.approx(rotation([DT * r for r in w_d]), abs=1e-12)
    assert after.force == pytest.approx(pointing.force + DT * f_dot)


def test_the_closed_form_of_the_moments_inverse_is_the_pseudo_inverse():
    for name in ("nominal", "published", "flight-code"):
        a = load(name).parameters
        assert np.array(moment_inverse(a)) == pytest.approx(np.linalg.pinv(moment_matrix(a)), rel=1e-12, abs=1e-12)


def test_compiled_equals_python():
    g, (body, pointing) = gains(governor=VELOCITY), next(random_states(1))
    assert entry(_ticked)(body, g, pointing) == _ticked(body, g, pointing)


def _ticked(body, g, pointing):
    return law.control(body, hover(0.3), SPEED, g, pointing, DT)


# On the quadrotor, whose model the law has exactly (the report flew it there first)

TUMBLED = (math.radians(10.0), math.radians(-45.0), math.radians(25.0))


@pytest.mark.long
def test_with_nu_prime_the_force_error_is_a_first_order_lag():
    """f_D falls as exp(-k_Delta t), appendix D's second figure; with nu the tilt error disturbs it."""
    fallen = {}
    for nu_prime in (False, True):
        flight = fly((5, 5, 5), quadrotor_gains(nu_prime=nu_prime), duration=1.0, attitude=TUMBLED)
        size = np.linalg.norm(flight.f_delta, axis=1)
        fallen[nu_prime] = size / (size[0] * np.exp(-5.0 * DT * np.arange(len(size))))
    assert fallen[True] == pytest.approx(np.ones(500), abs=0.03)
    assert fallen[False].max() > 1.5


@pytest.mark.long
@pytest.mark.parametrize("nu_prime", [False, True])
def test_the_quadrotor_converges_to_target_and_heading(nu_prime):
    flight = fly((5, 5, 5), quadrotor_gains(nu_prime=nu_prime), duration=8.0, attitude=TUMBLED, heading=0.5)
    settled = DT * np.flatnonzero(flight.distance > 0.05)[-1]
    assert settled < 3.6
    assert flight.distance[-1] < 1e-3
    assert not flight.cut[500:].any()
    end = quaternion(flight.q[-1])
    assert 2.0 * math.atan2(end.z, end.w) == pytest.approx(0.5, abs=0.01)
    assert z_axis(end) == pytest.approx((0.0, 0.0, 1.0), abs=1e-3)
