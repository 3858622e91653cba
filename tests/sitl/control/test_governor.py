"""Governors: what they bound, and that they leave small errors alone."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control.governor import (
    ARCTAN,
    ERROR,
    LINEAR,
    QUASI_OPTIMAL_AXIS,
    QUASI_OPTIMAL_NORM,
    VELOCITY,
    GovernorParameters,
    activity,
    arctan_sigmoid,
    gamma,
    gompertz,
    softened,
)
from sitl.model.vectors import Vector

KINDS = [LINEAR, ERROR, QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM, VELOCITY]
SPEED, K = 3.0, 1.5
AT_REST = Vector(0.0, 0.0, 0.0)

vectors = st.builds(Vector, *[st.floats(-200.0, 200.0)] * 3)
velocities = st.builds(Vector, *[st.floats(-10.0, 10.0)] * 3)


def governor(kind, **changes):
    return GovernorParameters(kind, K, K, 0.492, 0.5, 1.0, 2.0, 2.5)._replace(**changes)


def norm(v):
    return math.sqrt(sum(x * x for x in v))


def linear(e, v):
    return [-K * a - K * b for a, b in zip(e, v, strict=True)]


@pytest.mark.parametrize("sigmoid", [gompertz, arctan_sigmoid])
@given(x=st.floats(-1e3, 1e3), M=st.floats(0.05, 20.0))
def test_sigmoids_are_odd_bounded_and_never_steeper_than_one(sigmoid, x, M):
    assert sigmoid(-x, M) == -sigmoid(x, M)
    assert abs(sigmoid(x, M)) <= M * (1.0 + 1e-12)
    assert abs(sigmoid(x + 1e-3, M) - sigmoid(x, M)) <= 1.07e-3  # the Gompertz slope peaks at 1.062
    assert (sigmoid(1e-6, M) - sigmoid(-1e-6, M)) / 2e-6 == pytest.approx(1.0, rel=1e-3)


@given(x=st.floats(0.0, 100.0), M=st.floats(0.05, 20.0))
def test_the_gompertz_sigmoid_is_the_reports_with_other_constants(x, M):
    """With b = ln(ln 2) and c = 1 / (M ln 2) for the printed b = -ln(1/2), c = 1, which give -0.73 M at zero."""
    report = 2.0 * M * math.exp(-math.exp(math.log(math.log(2.0)) - x / (M * math.log(2.0)))) - M
    assert gompertz(x, M) == pytest.approx(report, abs=1e-11 * M)


def test_at_the_target_itself_the_gompertz_sigmoid_asks_for_nothing():
    assert gompertz(0.0, 1.0) == gompertz(-0.0, 7.3) == 0.0


def test_the_gompertz_sigmoid_is_nearer_the_hard_saturation_than_the_arctangent():
    for x in (0.5, 1.0, 2.0, 4.0, 8.0):
        hard = min(x, 1.0)
        assert abs(gompertz(x, 1.0) - hard) < abs(arctan_sigmoid(x, 1.0) - hard)


@pytest.mark.parametrize("kind", KINDS)
def test_near_the_target_every_governor_is_the_linear_law(kind):
    e, v = Vector(0.01, -0.02, 0.015), Vector(0.005, 0.01, -0.005)
    assert gamma(e, v, SPEED, governor(kind)) == pytest.approx(linear(e, v), rel=0.05)
    assert activity(e, v, SPEED, governor(kind)) < 0.05


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=50)
@given(e=vectors, v=velocities)
def test_activity_is_the_share_of_the_force_taken_away(kind, e, v):
    asked, given_ = linear(e, v), gamma(e, v, SPEED, governor(kind))
    taken = norm(a - b for a, b in zip(asked, given_, strict=True))
    expected = min(1.0, taken / norm(asked)) if norm(asked) > 1e-6 else 0.0
    assert activity(e, v, SPEED, governor(kind)) == pytest.approx(expected, abs=1e-9)


def test_activity_in_numbers():
    """4 m off at rest: the error governor sees one metre of it, the velocity governor softens it at its 3 m."""
    off = Vector(4.0, 0.0, 0.0)
    assert activity(off, AT_REST, SPEED, governor(LINEAR)) == 0.0
    assert activity(off, AT_REST, SPEED, governor(ERROR)) == pytest.approx(0.75)
    assert activity(off, AT_REST, SPEED, governor(VELOCITY)) == pytest.approx(1.0 - (1.0 + (4 / 3) ** 4) ** -0.25)
    sideways = Vector(0.0, 1.0, 0.0)  # a governor that asks for the opposite takes away all there is, not more
    assert activity(Vector(0.0, -1.0, 0.0), sideways, SPEED, governor(LINEAR)) == 0.0
    assert activity(Vector(0.0, -1.1, 0.0), sideways, 0.01, governor(VELOCITY)) == 1.0


@given(e=vectors, v=velocities)
def test_the_error_governor_bounds_the_force_of_each_axis(e, v):
    assert max(map(abs, gamma(e, v, SPEED, governor(ERROR)))) <= 3.0 + 1e-12


@pytest.mark.parametrize("sigmoid", [0, ARCTAN])
@given(e=vectors, v=velocities, M=st.floats(0.1, 3.0))
def test_quasi_time_optimal_governors_bound_the_acceleration(sigmoid, e, v, M):
    axis = gamma(e, v, SPEED, governor(QUASI_OPTIMAL_AXIS, M=M, sigmoid=sigmoid))
    whole = gamma(e, v, SPEED, governor(QUASI_OPTIMAL_NORM, M=M, sigmoid=sigmoid))
    assert max(map(abs, axis)) <= 0.492 * M * (1.0 + 1e-9)
    assert norm(whole) <= 0.492 * M * (1.0 + 1e-9)


@given(v=st.floats(0.5, 20.0))
def test_the_quasi_time_optimal_governor_brakes_in_time(v):
    """At v it asks for braking before v^2 / 2M from the target and for thrust well before that."""
    p, moving = governor(QUASI_OPTIMAL_NORM), Vector(v, 0.0, 0.0)
    stop = v * v / (2.0 * p.M)
    assert gamma(Vector(-stop, 0.0, 0.0), moving, SPEED, p).x <= 1e-9
    assert gamma(Vector(-stop - 5.0 * v - 5.0, 0.0, 0.0), moving, SPEED, p).x > 0.0


@given(azimuth=st.floats(-math.pi, math.pi), distance=st.floats(0.1, 1e4), speed=st.floats(0.5, 5.0))
def test_the_velocity_governor_stops_pushing_at_its_speed_limit(azimuth, distance, speed):
    """The force vanishes at or below the limit, whatever the distance."""
    p = governor(VELOCITY)
    c, s = math.cos(azimuth), math.sin(azimuth)
    away = Vector(-distance * c, -distance * s, 0.0)
    fx, fy, _ = gamma(away, Vector(speed * c, speed * s, 0.0), speed, p)
    assert c * fx + s * fy <= 1e-9
    slow = 0.5 * min(speed, distance)
    fx, fy, _ = gamma(away, Vector(slow * c, slow * s, 0.0), speed, p)
    assert c * fx + s * fy > 0.0


@pytest.mark.parametrize(("e_z", "limit"), [(50.0, -2.0), (-50.0, 2.5)])
def test_the_velocity_governor_has_its_own_limits_down_and_up(e_z, limit):
    force = gamma(Vector(0.0, 0.0, e_z), Vector(0.0, 0.0, limit), SPEED, governor(VELOCITY))
    assert force.z == pytest.approx(0.0, abs=1e-4)


@given(x=st.floats(-1e4, 1e4), limit=st.floats(0.01, 100.0))
def test_softening_keeps_an_error_below_its_limit(x, limit):
    assert softened(x, limit) == pytest.approx((1.0 + (x / limit) ** 4) ** -0.25)
    assert abs(x) * softened(x, limit) <= limit * (1.0 + 1e-9)
    assert softened(0.1 * limit, limit) == pytest.approx(1.0, abs=1e-4)
