"""The governors axis by axis, against a second transcription."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sitl.control.governor import (
    ARCTAN,
    ERROR,
    GOMPERTZ,
    QUASI_OPTIMAL_AXIS,
    QUASI_OPTIMAL_NORM,
    VELOCITY,
    GovernorParameters,
    arctan_sigmoid,
    gamma,
    gompertz,
)
from sitl.model.vectors import Vector

K_PP, K_PD, M, ACCELERATION = 1.2, 1.7, 0.492, 0.8
SPEED = 3.0
errors = st.builds(Vector, *[st.floats(-20.0, 20.0)] * 3)
velocities = st.builds(Vector, *[st.floats(-5.0, 5.0)] * 3)
SIGMOIDS = {GOMPERTZ: gompertz, ARCTAN: arctan_sigmoid}


def governor(kind, sigmoid=GOMPERTZ):
    return GovernorParameters(kind, K_PP, K_PD, M, ACCELERATION, 1.5, 2.0, 2.5, sigmoid)


def horizon(speed):
    """Seconds of the present velocity that count as distance."""
    return ((speed / (2.0 * ACCELERATION)) ** 4 + (K_PD / K_PP) ** 4) ** 0.25


def softened(x, limit):
    return x * (1.0 + (x / limit) ** 4) ** -0.25


@pytest.mark.parametrize("sigmoid", SIGMOIDS)
@given(e=errors, v=velocities)
def test_the_quasi_time_optimal_governor_of_each_axis(sigmoid, e, v):
    expected = [
        -M * SIGMOIDS[sigmoid](K_PP / M * (x + u * horizon(abs(u))), ACCELERATION) for x, u in zip(e, v, strict=True)
    ]
    assert gamma(e, v, SPEED, governor(QUASI_OPTIMAL_AXIS, sigmoid)) == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("sigmoid", SIGMOIDS)
@given(e=errors, v=velocities)
def test_the_quasi_time_optimal_governor_of_the_norm(sigmoid, e, v):
    wanted = K_PP / M * (np.array(e) + np.array(v) * horizon(np.linalg.norm(v)))
    size = float(np.linalg.norm(wanted))
    expected = -M * wanted * (SIGMOIDS[sigmoid](size, ACCELERATION) / size if size > 1e-9 else 1.0)
    assert gamma(e, v, SPEED, governor(QUASI_OPTIMAL_NORM, sigmoid)) == pytest.approx(expected, abs=1e-9)


@given(e=errors, v=velocities)
def test_the_error_governor_cuts_position_and_velocity_of_each_axis(e, v):
    expected = -K_PP * np.clip(e, -1.5, 1.5) - K_PD * np.clip(v, -1.5, 1.5)
    assert gamma(e, v, SPEED, governor(ERROR)) == pytest.approx(expected, abs=1e-9)


@given(e=errors, v=velocities)
def test_the_velocity_governor_limits_the_level_and_the_vertical_error(e, v):
    reach = K_PD / K_PP
    level = math.hypot(e.x, e.y)
    share = softened(level, SPEED * reach) / level if level > 1e-9 else 1.0
    vertical = softened(e.z, (2.0 if e.z > 0.0 else 2.5) * reach)
    expected = -K_PP * np.array((share * e.x, share * e.y, vertical)) - K_PD * np.array(v)
    assert gamma(e, v, SPEED, governor(VELOCITY)) == pytest.approx(expected, abs=1e-9)
