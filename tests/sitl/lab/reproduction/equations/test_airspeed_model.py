"""The report's hover model augmented by the airspeed, corrected: the plant without rates, and its Jacobian."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.lab.reproduction.equations import airspeed_model
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

NOMINAL = load("nominal").parameters
SETTINGS = settings(max_examples=60)
STILL = Vector(0.0, 0.0, 0.0)

motors, elevons = st.floats(200, 1000), st.floats(-0.5, 0.5)
vectors = st.builds(Vector, *[st.floats(-20, 20)] * 3)
controls = st.builds(Actuators, motors, motors, elevons, elevons)


def augmented(u):
    T1, T2 = NOMINAL.k_f * np.square(u[:2])
    return airspeed_model.virtual_command(T1, T2, u[2], u[3])


@SETTINGS
@given(vectors, controls)
def test_without_rates_the_plant_is_the_airspeed_model(v, u):
    eta = float(np.linalg.norm(v))
    F = airspeed_model.force(np.array(v), eta, augmented(u), NOMINAL)
    M = airspeed_model.moment(np.array(v), eta, augmented(u), NOMINAL)
    assert np.concatenate((F, M)) == pytest.approx(np.concatenate(wrench(v, STILL, u, NOMINAL)), rel=1e-9, abs=1e-9)


@SETTINGS
@given(vectors, controls)
def test_the_airspeed_models_jacobian_is_its_moments_derivative(v, u):
    at, eta, v = augmented(u), float(np.linalg.norm(v)), np.array(v)
    columns = []
    for k in (1, 2, 3):
        step = np.zeros(4)
        step[k] = 1e-5
        ahead, behind = (airspeed_model.moment(v, eta, at + sign * step, NOMINAL) for sign in (1, -1))
        columns.append((ahead - behind) / 2e-5)
    assert airspeed_model.moment_jacobian(v, eta, at, NOMINAL) == pytest.approx(np.array(columns).T, abs=1e-7)


def test_the_airspeed_models_jacobian_is_well_conditioned_where_the_printed_one_is_singular():
    """Eq. M_y as printed multiplies d1 + d2 by T1 - T2: with equal thrusts the elevons would not pitch in hover."""
    jacobian = airspeed_model.moment_jacobian(np.zeros(3), 0.0, np.array([4.85, 0.0, 0.0, 0.0]), NOMINAL)
    assert np.linalg.cond(jacobian) == pytest.approx(6.3, abs=0.1)
