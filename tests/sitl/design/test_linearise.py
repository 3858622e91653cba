"""Linear models against the plant and each other."""

import math

import numpy as np
import pytest

from sitl.design import linearise
from sitl.design.lqr import hover_thrust, lqr
from sitl.design.trim import level_trim
from sitl.model.aerodynamics import wrench
from sitl.model.airframe_files import load
from sitl.model.state import Actuators
from sitl.model.vectors import Vector

NOMINAL, PUBLISHED = load("nominal").parameters, load("published").parameters
SPEEDS = (1.0, 3.0, 5.0, 5.5, 7.0, 10.0, 15.0, 20.0, 25.0)


def test_the_plant_linearised_at_rest_is_the_closed_form_of_the_hover():
    A, B = linearise.forward(NOMINAL, level_trim(NOMINAL, 0.0))
    closed_A, closed_B = linearise.hover(NOMINAL)
    T = hover_thrust(NOMINAL).T1
    assert pytest.approx(closed_A[2:, 2:], abs=1e-3) == A  # |v| v has a kink in its second derivative
    assert pytest.approx(closed_B[2:] * [1.0, 1.0, T, T], abs=1e-5) == B


def test_the_report_holds_eta_still():
    (ours, B), (theirs, same) = linearise.hover(PUBLISHED), linearise.hover(PUBLISHED, constrained=False)
    assert np.argwhere(ours != theirs).tolist() == [[5, 7]]
    assert theirs[5, 7] == pytest.approx(-math.sqrt(2.0) * PUBLISHED.g)
    assert (same == B).all()
    trim = level_trim(PUBLISHED, 5.0)
    ours, theirs = (linearise.forward(PUBLISHED, trim, constrained=still)[0] for still in (True, False))
    assert set(np.argwhere(np.abs(ours - theirs) > 1e-6)[:, 1].tolist()) == {5}  # what eps_2 alone moves


@pytest.mark.parametrize("speed", SPEEDS)
def test_level_flight_is_unstable_without_control_and_stable_under_lqr(speed):
    A, B = linearise.forward(NOMINAL, level_trim(NOMINAL, speed))
    assert np.linalg.eigvals(A).real.max() > 0.2
    Q = np.diag([1.0] + 3 * [0.5] + 3 * [20.0] + 3 * [0.3])
    K, S = lqr(A, B, Q, np.diag([2.0, 2.0, 8.0, 8.0]))
    assert np.linalg.eigvals(A - B @ K).real.max() < -0.8
    assert np.linalg.eigvalsh(S).min() > 0.0


@pytest.mark.parametrize(("speed", "condition"), [(0.0, 6.3), (5.0, 6.2), (20.0, 35.3)])
def test_moments_can_be_inverted_at_every_speed(speed, condition):
    """By (T1 - T2, delta1 + delta2, delta1 - delta2)."""
    trim = level_trim(NOMINAL, speed)
    v = Vector(speed * math.cos(trim.theta), 0.0, -speed * math.sin(trim.theta))

    def moment(differ, both, uneven):
        T1, T2 = trim.thrust + 0.5 * differ, trim.thrust - 0.5 * differ
        d1, d2 = trim.delta + 0.5 * (both + uneven), trim.delta + 0.5 * (both - uneven)
        w1, w2 = math.sqrt(T1 / NOMINAL.k_f), math.sqrt(T2 / NOMINAL.k_f)
        return np.array(wrench(v, Vector(0.0, 0.0, 0.0), Actuators(w1, w2, d1, d2), NOMINAL)[1])

    jacobian = np.array([(moment(*step) - moment(*-step)) / 2e-6 for step in 1e-6 * np.eye(3)]).T
    assert np.linalg.cond(jacobian) == pytest.approx(condition, abs=0.1)
