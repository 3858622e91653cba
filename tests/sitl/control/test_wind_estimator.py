"""The wind estimator's equations; what it makes of flights is in tests/sitl/flights/test_wind_estimate.py."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.compiled import entry
from sitl.control import wind_estimator
from sitl.control.estimate import Readings
from sitl.control.wind_estimator import Covariance, WindState
from sitl.design.gains import wind_gains
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.quaternions import hover, rotate_inverse
from sitl.model.vectors import Vector, subtract
from tests.support.flights.estimates import estimate, rotation, vector

A = load("nominal").parameters
GAINS = wind_gains()
DT = 0.002
readings = st.tuples(
    st.tuples(*[st.floats(-3.0, 3.0)] * 3),  # attitude as a rotation vector
    st.tuples(*[st.floats(-15.0, 15.0)] * 3),  # velocity
    st.floats(-30.0, 30.0),  # normal specific force
    st.one_of(st.none(), st.floats(-5.0, 25.0)),  # pitot
    st.tuples(*[st.floats(-0.5, 0.5)] * 2),  # elevons
)


def matrix(C):
    return np.array(((C.xx, C.xy, C.xz), (C.xy, C.yy, C.yz), (C.xz, C.yz, C.zz)))


def seen_of(wind, seen, *, tube):
    """Readings of ideal sensors."""
    v_b = rotate_inverse(seen.attitude, subtract(seen.velocity, vector(wind)))
    F, _ = wrench(v_b, seen.rates, seen.actuators, A)
    return Readings(seen.velocity, F.z / A.m, v_b.x if tube else 0.0, tube)


@given(several=st.lists(readings, min_size=1, max_size=6), repeats=st.integers(1, 100))
@settings(max_examples=50)
def test_whatever_is_read_the_covariance_stays_one(several, repeats):
    """Positive, and never above what the filter started with."""
    state = wind_estimator.start(GAINS)
    for attitude, velocity, normal, pitot, elevons in several:
        seen = estimate(v=velocity, q=rotation(attitude), w=(0.1, 0.1, 0.1), actuators=(600.0, 600.0, *elevons))
        read = Readings(seen.velocity, normal, 0.0 if pitot is None else pitot, pitot is not None)
        for _ in range(repeats):
            state = wind_estimator.update(seen, read, GAINS, A, state, DT)
    C = matrix(state.covariance)
    assert np.linalg.eigvalsh(C).min() > 0.0
    assert np.diag(C).max() <= GAINS.max_deviation**2 + 1e-9


def test_a_turn_with_ideal_sensors_finds_the_wind_on_every_axis():
    wind, state = (3.0, -2.0, 1.0), wind_estimator.start(GAINS)
    for k in range(5000):
        heading = 2.0 * math.pi * k / 2500
        seen = estimate(
            v=(12.0 * math.cos(heading), 12.0 * math.sin(heading), 0.0),
            q=rotation((0.0, 0.0, heading)),
            actuators=(500.0, 500.0, 0.1, 0.1),
        )
        state = wind_estimator.update(seen, seen_of(wind, seen, tube=True), GAINS, A, state, DT)
    assert state.wind == pytest.approx(wind, abs=0.15)


def test_what_is_read_as_expected_moves_the_estimate_only_towards_calm():
    wind = Vector(1.0, 2.0, -0.5)
    state = WindState(wind, Covariance(1.0, 0.1, 0.2, 2.0, 0.3, 1.5))
    faded = Vector(*(math.exp(-DT / GAINS.return_time) * x for x in wind))
    seen = estimate(v=(10.0, 0.0, 0.0), q=hover(0.3), w=(0.1, 0.2, 0.3), actuators=(600.0, 600.0, 0.1, 0.0))
    after = wind_estimator.update(seen, seen_of(faded, seen, tube=True), GAINS, A, state, DT)
    assert after.wind == pytest.approx(faded, abs=1e-12)


def test_without_a_tube_the_wind_along_the_nose_fades():
    seen = estimate(v=(10.0, 0.0, 0.0), q=rotation((0.0, 0.0, 0.0)), actuators=(500.0, 500.0, 0.0, 0.0))
    state = WindState(Vector(3.0, 2.0, 0.0), Covariance(1e-9, 0.0, 0.0, 1e-9, 0.0, 1e-9))
    after = wind_estimator.update(seen, seen_of(state.wind, seen, tube=False), GAINS, A, state, DT)
    lost = 3.0 * (1.0 - math.exp(-DT / GAINS.axial_time - DT / GAINS.return_time))
    assert 3.0 - after.wind.x == pytest.approx(lost, rel=1e-6)
    assert after.wind.y == pytest.approx(2.0 * math.exp(-DT / GAINS.return_time))


def test_the_update_is_the_kalman_filter_s():
    """Gain, estimate and covariance by their matrices, of one reading of the tube."""
    state = WindState(Vector(1.0, -2.0, 0.5), Covariance(2.0, 0.1, -0.3, 1.0, 0.2, 1.5))
    H = np.array((0.6, -0.64, 0.48))
    C, noise, innovation = matrix(state.covariance), 0.3, 0.7
    K = C @ H / (H @ C @ H + noise)
    after = wind_estimator._corrected(state, vector(H), innovation, noise)
    assert np.array(after.wind) == pytest.approx(state.wind + K * innovation)
    assert matrix(after.covariance) == pytest.approx(C - np.outer(K, H @ C))


def test_the_slope_is_the_derivative_of_the_normal_force_by_the_wind():
    """Central difference of the plant's own force; without body rates the two agree but for MIN_SPEED."""
    d, h = (0.2, -0.05), 1e-5
    v = np.array((9.0, 1.0, -2.0))
    seen = estimate(actuators=(0.0, 0.0, *d))

    def force(change):
        return wrench(vector(v - change), vector((0.0, 0.0, 0.0)), seen.actuators, A)[0].z

    slope = [(force(h * axis) - force(-h * axis)) / (2.0 * h) for axis in np.eye(3)]
    assert wind_estimator.normal_slope(vector(v), seen.actuators, A) == pytest.approx(tuple(slope), rel=1e-3)


@pytest.mark.parametrize("tube", [True, False])
def test_compiled_equals_python(tube):
    seen = estimate(
        (1, 2, 3), (9.0, 1.0, 0.2), rotation((0.1, -0.2, 0.3)), (0.3, 0.2, 0.1), actuators=(600, 500, 0.1, 0)
    )
    state = WindState(Vector(1.0, -2.0, 0.5), Covariance(2.0, 0.1, -0.3, 1.0, 0.2, 1.5))
    given_ = seen, Readings(seen.velocity, -3.0, 8.0, tube), GAINS, A, state
    assert entry(_ticked)(*given_) == _ticked(*given_)


def _ticked(seen, read, gains, a, state):
    return wind_estimator.update(seen, read, gains, a, state, DT)
