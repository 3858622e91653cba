"""The report's line-of-sight law: its inversion, its two readings, where it arrives and where it does not."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.lab.reproduction.equations import report_forward_law
from sitl.lab.reproduction.equations.report_forward_flight import conditioning, fly
from sitl.lab.reproduction.equations.report_forward_law import ReportForwardGains, ReportTarget
from sitl.model.airframe_files import load
from sitl.model.quaternions import from_euler
from sitl.model.state import Actuators, Body
from sitl.model.vectors import Vector, dot, norm

NOMINAL = load("nominal").parameters
FAR = Vector(1000.0, 0.0, 1000.0)
ORIGIN = Vector(0.0, 0.0, 0.0)
commands = st.tuples(st.floats(1.0, 9.0), st.floats(-2.0, 2.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
velocities = st.tuples(st.floats(0.0, 25.0), st.floats(-5.0, 5.0), st.floats(-8.0, 8.0))
directions = st.builds(Vector, *[st.floats(-10.0, 10.0)] * 3)


def flying(v=(12.0, 1.0, 2.0), attitude=(0.1, -0.4, 0.2), w=(0.3, -0.2, 0.1)):
    return Body(ORIGIN, Vector(*v), from_euler(*attitude), Vector(*w))


@settings(max_examples=40)
@given(u=commands, v=velocities, swapped=st.sampled_from((0, 1)))
def test_the_jacobian_is_the_derivative_of_the_moment_in_either_reading(u, v, swapped):
    gains, u, v = ReportForwardGains(NOMINAL, swapped=swapped), np.array(u), np.array(v)
    eta, step = float(np.linalg.norm(v)), 1e-6
    _, J = report_forward_law.model(v, eta, u, gains)
    for column in range(3):
        ahead = np.zeros(4)
        ahead[column + 1] = step
        up, down = (report_forward_law.model(v, eta, u + sign * ahead, gains)[0] for sign in (1.0, -1.0))
        assert J[:, column] == pytest.approx((up - down) / (2.0 * step), abs=1e-7)


def test_the_swapped_reading_is_the_report_s_pitch_moment():
    """Equation M as typed, in the signs of FLU."""
    a, u, v = NOMINAL, np.array((4.0, 0.7, 0.3, -0.2)), np.array((9.0, 0.0, -2.0))
    eta = float(np.linalg.norm(v))
    M, _ = report_forward_law.model(v, eta, u, ReportForwardGains(a, swapped=1))
    slip, air = 0.5 * a.S_ratio, 0.25 * a.rho * a.S * eta
    typed = (slip * u[1] + air * v[0]) * u[2] + slip * u[0] * u[3]
    wing = 0.5 * a.rho * a.S * eta * a.Delta_r * a.C_l * v[2]
    assert M[1] == pytest.approx(-a.Delta_r * a.C_l * a.xi_m * typed - wing)


def test_both_readings_agree_where_the_exchange_changes_nothing():
    same = np.array((3.0, 3.0, 0.2, 0.1))
    v = np.array((8.0, 0.0, -1.0))
    ours, theirs = (report_forward_law.model(v, 8.06, same, ReportForwardGains(NOMINAL, swapped=s))[0] for s in (0, 1))
    assert ours == pytest.approx(theirs)


@settings(max_examples=30)
@given(entries=st.lists(st.floats(-2.0, 2.0), min_size=9, max_size=9))
def test_the_limited_inverse_is_the_inverse_where_no_limit_acts_and_bounded_where_one_does(entries):
    J = np.array(entries).reshape(3, 3)
    singular = np.linalg.svd(J, compute_uv=False)
    if singular[2] > 1e-3:
        assert report_forward_law.limited_inverse(J, 0.0) @ J == pytest.approx(np.eye(3), abs=1e-6)
    if singular[0] > 1e-3:
        largest = np.linalg.norm(report_forward_law.limited_inverse(J, 0.1), 2)
        assert largest <= 10.0 / singular[0] * (1.0 + 1e-9)


def test_the_limited_inverse_of_a_singular_jacobian_is_finite():
    _, J = report_forward_law.model(
        np.zeros(3), 0.0, np.array((4.8, 0.0, 0.0, 0.0)), ReportForwardGains(NOMINAL, swapped=1)
    )
    assert np.isfinite(report_forward_law.limited_inverse(J, 1e-3)).all()


@settings(max_examples=40)
@given(to=directions, v=directions)
def test_the_line_of_sight_error_turns_the_target_s_direction_into_the_velocity_s(to, v):
    """q_e has length one, half the angle, and its axis is square to both."""
    if min(norm(to), norm(v)) < 0.1 or dot(to, v) < -0.999 * norm(to) * norm(v):
        return
    axis, angle = report_forward_law.line_of_sight(flying(v), to)
    assert norm(axis) == pytest.approx(math.sin(0.5 * angle), abs=1e-7)
    assert dot(axis, to) == pytest.approx(0.0, abs=1e-9)
    assert dot(axis, v) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize(("v", "expected"), [((5.0, 0.0, 0.0), 0.0), ((-5.0, 0.0, 0.0), math.pi), (ORIGIN, 0.0)])
def test_aligned_opposite_and_standing_still_are_finite(v, expected):
    axis, angle = report_forward_law.line_of_sight(flying(v), Vector(100.0, 0.0, 0.0))
    assert np.isfinite(axis).all()
    assert angle == pytest.approx(expected)


def test_a_target_above_asks_for_nose_up():
    body = flying(v=(10.0, 0.0, 0.0), attitude=(0.0, 0.0, 0.0), w=(0.0, 0.0, 0.0))
    wanted = report_forward_law.wanted_moment(body, FAR, ReportForwardGains(NOMINAL))
    assert wanted.y < 0.0
    assert (wanted.x, wanted.z) == pytest.approx((0.0, 0.0))


def test_the_law_starts_with_the_present_actuators():
    body, now = flying(), Actuators(520.0, 500.0, 0.1, 0.05)
    gains = ReportForwardGains(NOMINAL, k_u=0.0)
    law = report_forward_law.start(now, gains)
    goal = ReportTarget(FAR, body.velocity.x)
    u = report_forward_law.control(body, ORIGIN, goal, gains._replace(k_p=0.0), 0.002, law)
    assert (*np.sqrt(u[:2] / NOMINAL.k_f), *u[2:]) == pytest.approx(now)


def test_the_law_s_state_keeps_only_commands_that_the_actuators_can_give():
    law = np.array((30.0, 4.0, -3.0, 0.0))
    u = report_forward_law.control(flying(), ORIGIN, ReportTarget(FAR, 20.0), ReportForwardGains(NOMINAL), 0.002, law)
    assert np.abs(u[2:]).max() <= NOMINAL.delta_max
    assert np.sqrt(u[:2].max() / NOMINAL.k_f) <= NOMINAL.omega_max * (1.0 + 1e-12)
    assert law[:3] == pytest.approx([u[0] - u[1], u[2] + u[3], u[2] - u[3]])


@pytest.mark.long
def test_in_the_vertical_plane_the_corrected_law_arrives_on_the_line_of_sight():
    flight = fly(FAR, ReportForwardGains(NOMINAL), speed=20.0, duration=20.0)
    assert math.degrees(flight.angle_off[flight.at(5.0) :].max()) < 0.15
    assert np.linalg.norm(flight.v[-1]) == pytest.approx(20.0, abs=0.2)
    assert np.abs(flight.p[:, 1]).max() < 1e-6


@pytest.mark.long
@pytest.mark.parametrize(("k_c", "low", "high"), [(1.0, 0.2, 0.6), (0.3, 1.0, 1.7), (0.05, 7.0, 9.0)])
def test_the_swapped_pitch_moment_leaves_a_lasting_error(k_c, low, high):
    flight = fly(FAR, ReportForwardGains(NOMINAL, swapped=1, k_c=k_c), speed=20.0, duration=30.0)
    off = np.degrees(flight.angle_off[flight.at(20.0) :])
    assert off.min() > low
    assert off.max() < high


@pytest.mark.parametrize(
    ("speed", "ours", "typed"),
    [(0.0, 6.3, math.inf), (1.0, 6.3, 6.3e3), (3.0, 6.2, 82), (5.0, 6.2, 15.9), (20.0, 35, 35)],
)
def test_the_bad_conditioning_comes_from_the_exchanged_thrusts_alone(speed, ours, typed):
    assert conditioning(NOMINAL, speed, swapped=False) == pytest.approx(ours, rel=0.03)
    if math.isinf(typed):
        assert conditioning(NOMINAL, speed, swapped=True) > 1e14
    else:
        assert conditioning(NOMINAL, speed, swapped=True) == pytest.approx(typed, rel=0.03)
