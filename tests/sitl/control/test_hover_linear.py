"""The linear hover law: its frame, its Lyapunov value, its integral."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control import hover_linear as law
from sitl.control.allocation import allocate
from sitl.control.attitude_loop import NOT_CHOSEN
from sitl.control.hover_linear import HoverError
from sitl.design.lqr import gentle_hover_gains, hover_gains
from sitl.model.airframe_files import load
from sitl.model.quaternions import from_euler, hover, multiply, rotate
from sitl.model.vectors import Vector, scaled
from tests.support.flights.estimates import STILL, estimate, negated, reference, turned, vector

A = load("nominal").parameters
LQI = hover_gains(A)
ORIGIN = Vector(0.0, 0.0, 0.0)
headings = st.floats(-math.pi, math.pi)
offsets = st.builds(Vector, *[st.floats(-8.0, 8.0)] * 3)
tilts = st.builds(Vector, *[st.floats(-0.8, 0.8)] * 3)


GAINS = gentle_hover_gains(A)


@given(p=offsets, speed=st.floats(0.2, 6.0))
def test_the_point_that_is_followed_leads_by_no_more_than_the_speed_limit_allows(p, speed):
    x = HoverError(p, ORIGIN, ORIGIN, ORIGIN)
    seen = law.governed(x, speed, GAINS).position
    assert seen.z == p.z
    ahead, aside = seen.x / GAINS.headway, seen.y / GAINS.headway_aside
    assert math.hypot(ahead, aside) <= speed * (1.0 + 1e-9)
    assert p.x * seen.y == pytest.approx(p.y * seen.x, abs=1e-9)
    if math.hypot(p.x / GAINS.headway, p.y / GAINS.headway_aside) <= speed:
        assert seen == p


def test_without_a_headway_nothing_is_limited():
    x = HoverError(Vector(50.0, 3.0, 1.0), ORIGIN, ORIGIN, ORIGIN)
    assert law.governed(x, 0.2, law.LinearGains(*LQI[:6])) == x


def flat(x):
    return np.concatenate(x)


def control(x, integral=ORIGIN, heading=0.0, gains=LQI):
    return np.array(law.control(x, integral, heading, gains))


def integrated(seen, seconds, gains=LQI, integral=ORIGIN):
    for _ in range(round(seconds / 0.002)):
        integral = law.integrate(seen, ORIGIN, integral, gains, 0.002)
    return integral


@given(heading=headings, target=offsets)
def test_hovering_at_the_target_is_no_error_and_needs_the_hover_thrust(heading, target):
    x = law.error(estimate(target, q=hover(heading)), target, heading)
    assert flat(x) == pytest.approx(np.zeros(12), abs=1e-12)
    assert control(x, heading=heading) == pytest.approx(np.array(LQI.u_bar))


@given(turn=headings, heading=headings, p=offsets, tilt=tilts, integral=offsets)
def test_the_law_knows_no_north(turn, heading, p, tilt, integral):
    """Everything turned about the vertical: the same error and the same commands."""
    q_z, q, v = from_euler(0.0, 0.0, turn), turned(hover(heading), tilt), scaled(p, 0.3)
    x = law.error(estimate(p, v, q, (0.1, 0.2, 0.3)), ORIGIN, heading)
    seen = estimate(rotate(q_z, p), rotate(q_z, v), multiply(q_z, q), (0.1, 0.2, 0.3))
    assert flat(law.error(seen, ORIGIN, heading + turn)) == pytest.approx(flat(x), abs=1e-9)
    u = control(x, integral, heading)
    assert control(x, rotate(q_z, integral), heading + turn) == pytest.approx(u, abs=1e-6)


@given(heading=headings, tilt=tilts)
def test_the_sign_of_the_quaternion_does_not_matter(heading, tilt):
    q = turned(hover(heading), tilt)
    either = [flat(law.error(estimate((1, 2, 3), q=way), ORIGIN, 0.0)) for way in (q, negated(q))]
    assert either[0] == pytest.approx(either[1], abs=1e-12)


@given(p=offsets, tilt=tilts)
def test_v_is_the_quadratic_form_and_positive(p, tilt):
    seen = estimate(p, scaled(p, -0.2), turned(hover(0.0), tilt), tilt)
    x = flat(law.error(seen, ORIGIN, 0.0))
    V = law.lyapunov(seen, reference(), LQI)
    assert pytest.approx(x @ LQI.S @ x, rel=1e-9, abs=1e-12) == V
    assert V >= 0.0
    assert law.quadratic(HoverError(ORIGIN, ORIGIN, ORIGIN, ORIGIN), LQI.S) == 0.0


def test_s_is_symmetric_of_which_v_reads_one_half():
    assert (LQI.S.T == LQI.S).all()


@given(direction=tilts, distance=st.floats(0.0, 100.0))
def test_the_law_is_linear_within_reach_and_constant_beyond(direction, distance):
    unit = np.array((1.0, 0.0, 0.0)) + direction
    offset = distance * unit / np.linalg.norm(unit)
    x = HoverError(vector(offset), ORIGIN, ORIGIN, ORIGIN)
    K, u_bar = LQI.K[:, :3], np.array(LQI.u_bar)
    seen = offset * min(1.0, LQI.reach / max(distance, 1e-9))
    assert control(x) == pytest.approx(u_bar - K @ seen, rel=1e-9, abs=1e-9)
    assert control(x, gains=LQI._replace(reach=math.inf)) == pytest.approx(u_bar - K @ offset, rel=1e-9, abs=1e-9)


def test_an_offset_counts_up_to_six_metres_unless_a_design_says_otherwise():
    def pull(distance):
        return control(HoverError(Vector(distance, 0.0, 0.0), ORIGIN, ORIGIN, ORIGIN)).tolist()

    assert pull(5.9) != pull(6.0) == pull(20.0)


@given(p=offsets, v=offsets, tilt=tilts, w=tilts, integral=offsets)
def test_every_entry_of_the_gains_is_used_in_its_place(p, v, tilt, w, integral):
    u = np.array(LQI.u_bar) - LQI.K @ np.concatenate((p, v, tilt, w)) - LQI.K_i @ np.array(integral)
    assert control(HoverError(p, v, tilt, w), integral, 0.0, LQI._replace(reach=math.inf)) == pytest.approx(u, abs=1e-9)


def test_the_integral_holds_against_what_pushes():
    """Ahead of the target for a while: the law tips the nose back more than without the integral."""
    seen = estimate((0.5, 0, 0))
    x, kept = law.error(seen, ORIGIN, 0.0), integrated(seen, 2.0)
    assert kept == pytest.approx((1.0, 0.0, 0.0))
    assert (control(x, kept)[2:] > control(x)[2:]).all()


def test_approaching_at_the_lead_s_speed_does_not_wind_it_up():
    seen = estimate((-1.3, 0, 0), (1.3 / LQI.lead, 0, 0))
    assert integrated(seen, 5.0) == pytest.approx(STILL, abs=1e-9)


@settings(max_examples=20)
@given(p=offsets, integral=offsets)
def test_the_integral_and_its_rate_are_bounded(p, integral):
    seen = estimate(scaled(p, 100.0))
    once = integrated(seen, 0.002, integral=integral)
    assert np.abs(np.subtract(once, integral)).max() <= 0.002 * LQI.integral_limit + 1e-12
    small = LQI._replace(bound=0.5)
    assert np.abs(integrated(seen, 0.5, small, vector(np.clip(integral, -0.5, 0.5)))).max() <= 0.5


def test_without_integral_gain_the_integral_says_nothing():
    lqr = hover_gains(A, integral=False)
    x = law.error(estimate((1, 2, 3)), ORIGIN, 0.0)
    assert (control(x, Vector(5.0, 5.0, 5.0), gains=lqr) == control(x, gains=lqr)).all()


def test_a_tick_commands_then_integrates():
    seen, wanted, integral = estimate((1, -2, 3), (0.1, 0.2, 0.3)), reference((0, 0, 1), 0.4), Vector(1.0, 2.0, 3.0)
    command, saturation, after = law.step(seen, wanted, LQI, A, law.LinearState(integral, NOT_CHOSEN), 0.002)
    assert after.integral == law.integrate(seen, wanted.position, integral, LQI, 0.002)
    u = law.control(law.error(seen, wanted.position, 0.4), integral, 0.4, LQI)
    assert after.side == 1.0
    assert (command, saturation) == allocate(u, A)


@given(p=offsets, v=offsets, tilt=tilts, w=tilts, integral=offsets, heading=headings)
def test_what_the_integral_adds_to_v_is_its_part_of_the_quadratic_form(p, v, tilt, w, integral, heading):
    draws = np.random.default_rng(3)
    S_xi, half = draws.normal(size=(12, 3)), draws.normal(size=(3, 3))
    gains = LQI._replace(S_xi=S_xi, S_ii=half + half.T)
    seen = estimate(p, v, turned(hover(heading), tilt), w)
    x = flat(law.error(seen, ORIGIN, heading))
    ahead = np.array(rotate(from_euler(0.0, 0.0, -heading), integral))
    share = law.integral_share(seen, reference(heading=heading), gains, integral)
    assert share == pytest.approx(2.0 * x @ S_xi @ ahead + ahead @ gains.S_ii @ ahead, rel=1e-6, abs=1e-6)


def test_unless_it_is_told_v_has_nothing_of_the_integral():
    plain = law.LinearGains(*LQI[:6])
    assert (plain.S_xi.shape, plain.S_ii.shape) == ((12, 3), (3, 3))
    assert law.integral_share(estimate((1, 2, 3)), reference(), plain, Vector(1.0, 2.0, 3.0)) == 0.0
