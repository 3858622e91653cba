"""A tick of the wind estimator against the extended Kalman filter's matrices."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.control import wind_estimator
from sitl.control.estimate import Readings
from sitl.control.wind_estimator import Covariance, WindState
from sitl.design.gains import wind_gains
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.quaternions import rotate, rotate_inverse, x_axis
from sitl.model.vectors import Vector, subtract
from tests.support.flights.estimates import estimate, rotation, vector

A = load("nominal").parameters
GAINS = wind_gains()
DT = 0.002
STATE = WindState(Vector(1.0, -2.0, 0.5), Covariance(2.0, 0.1, -0.3, 1.0, 0.2, 1.5))


def matrix(C):
    return np.array(((C.xx, C.xy, C.xz), (C.xy, C.yy, C.yz), (C.xz, C.yz, C.zz)))


def corrected(wind, C, H, innovation, noise):
    K = C @ H / (H @ C @ H + noise)
    return wind + K * innovation, C - np.outer(K, H @ C)


def slope(v_b, both):
    """Derivative of the normal force by the wind, body frame, written out as in the report's section on forces."""
    eta = math.sqrt(v_b @ v_b + 0.01)
    h = 0.5 * A.rho * A.S
    tilt = 0.5 * A.C_l * A.xi_f * both
    # F_z = -h eta (tilt v_x + C_l v_z): by the wind, which is -v, both factors change
    across = tilt * v_b[0] + A.C_l * v_b[2]
    return h * (across * v_b / eta + eta * np.array((tilt, 0.0, A.C_l)))


def filtered(seen, read):
    """The wind and its covariance a tick later."""
    wind = np.array(STATE.wind) * math.exp(-DT / GAINS.return_time)
    C = matrix(STATE.covariance) + GAINS.walk**2 * DT * np.eye(3)
    v_b = rotate_inverse(seen.attitude, subtract(read.velocity, vector(wind)))
    F, _ = wrench(v_b, seen.rates, seen.actuators, A)
    H = slope(np.array(v_b), sum(seen.actuators[2:])) / A.m
    H[0] = H[0] if read.has_airspeed else 0.0
    H = np.array(rotate(seen.attitude, vector(H)))
    wind, C = corrected(wind, C, H, read.normal_force - F.z / A.m, GAINS.normal_noise**2 / DT)
    nose = np.array(x_axis(seen.attitude))
    if not read.has_airspeed:
        wind = wind - (1.0 - math.exp(-DT / GAINS.axial_time)) * (wind @ nose) * nose
    elif read.airspeed > GAINS.min_pitot:
        innovation = read.airspeed - (np.array(read.velocity) - wind) @ nose
        wind, C = corrected(wind, C, -nose, innovation, GAINS.pitot_noise**2 / DT)
    C[np.diag_indices(3)] = np.minimum(np.diag(C), GAINS.max_deviation**2)
    return wind, C


@pytest.mark.parametrize("airspeed", [None, -5.0, GAINS.min_pitot, 4.5, 9.0, 20.0])
@settings(max_examples=15)
@given(
    turn=st.tuples(*[st.floats(-2.0, 2.0)] * 3),
    velocity=st.tuples(*[st.floats(-15.0, 15.0)] * 3),
    normal=st.floats(-20.0, 20.0),
    elevons=st.tuples(*[st.floats(-0.5, 0.5)] * 2),
)
def test_a_tick_is_a_prediction_and_a_correction_by_each_reading(airspeed, turn, velocity, normal, elevons):
    seen = estimate(v=velocity, q=rotation(turn), w=(0.3, -0.2, 0.1), actuators=(600.0, 500.0, *elevons))
    read = Readings(seen.velocity, normal, airspeed or 0.0, airspeed is not None)
    after = wind_estimator.update(seen, read, GAINS, A, STATE, DT)
    wind, C = filtered(seen, read)
    assert after.wind == pytest.approx(wind, abs=1e-9)
    assert matrix(after.covariance) == pytest.approx(C, abs=1e-9)


def test_the_tube_is_read_above_its_least_airspeed_and_not_at_it():
    seen = estimate(v=(9.0, 0.0, 0.0), q=rotation((0.1, -0.2, 0.3)), actuators=(600.0, 500.0, 0.1, 0.0))

    def wind(airspeed):
        return wind_estimator.update(seen, Readings(seen.velocity, -3.0, airspeed, True), GAINS, A, STATE, DT).wind

    assert wind(GAINS.min_pitot) == wind(0.0) == wind(-5.0)
    assert wind(GAINS.min_pitot + 1e-9) != wind(GAINS.min_pitot)


def test_nothing_is_known_at_first():
    most = GAINS.max_deviation**2
    start = wind_estimator.start(GAINS)
    assert start.wind == Vector(0.0, 0.0, 0.0)
    assert matrix(start.covariance) == pytest.approx(most * np.eye(3))


def test_no_variance_grows_above_that_of_the_start():
    state = wind_estimator.start(GAINS)
    seen = estimate(q=rotation((0.0, 0.0, 0.0)))
    for _ in range(50):
        state = wind_estimator.update(seen, Readings(seen.velocity, 0.0, 0.0, True), GAINS, A, state, DT)
    assert state.covariance.xx == state.covariance.yy == GAINS.max_deviation**2
