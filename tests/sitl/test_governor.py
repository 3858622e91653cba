"""Governors: what they bound, and that they leave small errors alone."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.laws.governor import (
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

KINDS = [LINEAR, ERROR, QUASI_OPTIMAL_AXIS, QUASI_OPTIMAL_NORM, VELOCITY]
SPEED = 3.0
AT_REST = (0.0, 0.0, 0.0)

vectors = st.tuples(*[st.floats(-200.0, 200.0)] * 3)
velocities = st.tuples(*[st.floats(-10.0, 10.0)] * 3)


def governor(kind, **changes):
    return GovernorParameters(kind, 1.5, 1.5, 0.492, 0.5, 1.0, 2.0, 2.5)._replace(**changes)


def norm(v):
    return math.sqrt(sum(x * x for x in v))


@pytest.mark.parametrize("sigmoid", [gompertz, arctan_sigmoid])
@settings(deadline=None)
@given(x=st.floats(-1e3, 1e3), M=st.floats(0.05, 20.0))
def test_sigmoids_are_odd_bounded_and_never_steeper_than_one(sigmoid, x, M):
    assert sigmoid(-x, M) == pytest.approx(-sigmoid(x, M), abs=1e-12)
    assert abs(sigmoid(x, M)) <= M * (1.0 + 1e-12)
    assert abs(sigmoid(x + 1e-3, M) - sigmoid(x, M)) <= 1.07e-3  # the Gompertz slope peaks at 1.062
    assert (sigmoid(1e-6, M) - sigmoid(-1e-6, M)) / 2e-6 == pytest.approx(1.0, rel=1e-3)


def test_the_printed_gompertz_constants_are_off():
    """The report's b = -ln(1/2) gives sigma(0) = -0.73 M; b = ln(ln 2) gives zero."""
    printed = 2.0 * math.exp(-math.exp(-math.log(0.5))) - 1.0
    assert printed == pytest.approx(-0.73, abs=0.005)
    assert gompertz(0.0, 1.0) == pytest.approx(0.0, abs=1e-15)


def test_the_gompertz_sigmoid_is_nearer_the_hard_saturation_than_the_arctangent():
    hard = [min(x, 1.0) for x in (0.5, 1.0, 2.0, 4.0, 8.0)]
    for x, limit in zip((0.5, 1.0, 2.0, 4.0, 8.0), hard, strict=True):
        assert abs(gompertz(x, 1.0) - limit) < abs(arctan_sigmoid(x, 1.0) - limit)


@pytest.mark.parametrize("kind", KINDS)
def test_near_the_target_every_governor_is_the_linear_law(kind):
    e, v = (0.01, -0.02, 0.015), (0.005, 0.01, -0.005)
    expected = [-1.5 * a - 1.5 * b for a, b in zip(e, v, strict=True)]
    assert gamma(e, v, SPEED, governor(kind)) == pytest.approx(expected, rel=0.05)
    assert activity(e, v, SPEED, governor(kind)) < 0.05


@pytest.mark.parametrize("kind", KINDS)
@settings(deadline=None, max_examples=50)
@given(e=vectors, v=velocities)
def test_activity_is_the_share_of_the_force_taken_away(kind, e, v):
    share = activity(e, v, SPEED, governor(kind))
    assert 0.0 <= share <= 1.0
    if kind == LINEAR:
        assert share < 1e-12


@settings(deadline=None)
@given(e=vectors, v=velocities)
def test_the_error_governor_bounds_the_force_of_each_axis(e, v):
    assert max(map(abs, gamma(e, v, SPEED, governor(ERROR)))) <= 3.0 + 1e-12


@pytest.mark.parametrize("sigmoid", [0, ARCTAN])
@settings(deadline=None)
@given(e=vectors, v=velocities, M=st.floats(0.1, 3.0))
def test_quasi_time_optimal_governors_bound_the_acceleration(sigmoid, e, v, M):
    axis = gamma(e, v, SPEED, governor(QUASI_OPTIMAL_AXIS, M=M, sigmoid=sigmoid))
    whole = gamma(e, v, SPEED, governor(QUASI_OPTIMAL_NORM, M=M, sigmoid=sigmoid))
    assert max(map(abs, axis)) <= 0.492 * M * (1.0 + 1e-9)
    assert norm(whole) <= 0.492 * M * (1.0 + 1e-9)


@settings(deadline=None)
@given(v=st.floats(0.5, 20.0))
def test_the_quasi_time_optimal_governor_brakes_in_time(v):
    """At v it asks for braking before v^2 / 2M from the target and for thrust well before that."""
    p = governor(QUASI_OPTIMAL_NORM)
    stop = v * v / (2.0 * p.M)
    assert gamma((-stop, 0.0, 0.0), (v, 0.0, 0.0), SPEED, p)[0] <= 1e-9
    assert gamma((-stop - 5.0 * v - 5.0, 0.0, 0.0), (v, 0.0, 0.0), SPEED, p)[0] > 0.0


@settings(deadline=None)
@given(azimuth=st.floats(-math.pi, math.pi), distance=st.floats(0.1, 1e4), speed=st.floats(0.5, 5.0))
def test_the_velocity_governor_stops_pushing_at_its_speed_limit(azimuth, distance, speed):
    """The force vanishes at or below the limit, whatever the distance."""
    p = governor(VELOCITY)
    c, s = math.cos(azimuth), math.sin(azimuth)
    fx, fy, _ = gamma((-distance * c, -distance * s, 0.0), (speed * c, speed * s, 0.0), speed, p)
    assert c * fx + s * fy <= 1e-9
    slow = 0.5 * min(speed, distance)
    fx, fy, _ = gamma((-distance * c, -distance * s, 0.0), (slow * c, slow * s, 0.0), speed, p)
    assert c * fx + s * fy > 0.0


@pytest.mark.parametrize(("e_z", "limit"), [(50.0, -2.0), (-50.0, 2.5)])
def test_the_velocity_governor_has_its_own_limits_down_and_up(e_z, limit):
    p = governor(VELOCITY)
    assert gamma((0.0, 0.0, e_z), (0.0, 0.0, limit), SPEED, p)[2] == pytest.approx(0.0, abs=1e-4)


@settings(deadline=None)
@given(x=st.floats(-1e4, 1e4), limit=st.floats(0.01, 100.0))
def test_softening_keeps_an_error_below_its_limit(x, limit):
    assert abs(x) * softened(x, limit) <= limit * (1.0 + 1e-9)
    assert softened(0.1 * limit, limit) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize("kind", KINDS)
def test_compiled_equals_python(kind):
    p, e, v = governor(kind), (12.0, -0.4, 3.0), (-1.0, 0.2, 2.5)
    python = getattr(gamma, "py_func", gamma)
    assert gamma(e, v, SPEED, p) == pytest.approx(python(e, v, SPEED, p), rel=1e-12)
