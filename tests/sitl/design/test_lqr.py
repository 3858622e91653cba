"""Gains of the linear laws against their models."""

import numpy as np
import pytest
from scipy.linalg import solve_continuous_are

from sitl.design import forward_schedule as forward_linear
from sitl.design import linearise
from sitl.design.forward_schedule import CLIMBS, SPEEDS, WEIGHTS, forward_gains, model
from sitl.design.lqr import hover_gains, lqi, lqr
from sitl.design.trim import level_trim
from sitl.errors import SitlError
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters


def test_the_gain_is_that_of_lapack_s_solution():
    A, B = linearise.hover(NOMINAL)
    K, S = lqr(A, B, np.eye(12), np.eye(4))
    theirs = solve_continuous_are(A, B, np.eye(12), np.eye(4))
    assert pytest.approx(theirs, abs=1e-11) == S
    assert pytest.approx(B.T @ theirs, abs=1e-11) == K
    plain = hover_gains(NOMINAL, integral=False)
    assert pytest.approx(K, abs=1e-9 * np.abs(K).max()) == plain.K
    assert pytest.approx(S, abs=1e-9 * np.abs(S).max()) == plain.S


def test_the_integrals_gains_are_the_lqi_seen_through_the_lead():
    A, B = linearise.hover(NOMINAL)
    K, K_i = lqi(A, B, np.eye(12), np.eye(4), 0.2)
    gains = hover_gains(NOMINAL)
    assert gains.K_i == pytest.approx(K_i, abs=1e-8)
    assert gains.K[:, 3:] == pytest.approx(K[:, 3:], abs=1e-7)
    assert gains.K[:, :3] + gains.lead * gains.K_i == pytest.approx(K[:, :3], abs=1e-7)


def test_what_is_alike_on_both_sides_is_alike_to_the_bit():
    """Position, velocity and rates are not mixed across the plane of symmetry: their gains are zero, not small."""
    gains = hover_gains(NOMINAL)
    assert (gains.K == 0.0).sum() == 12
    assert (gains.S == gains.S.T).all()
    assert (gains.S == 0.0).sum() == 88


def test_lqi_and_lqr_are_stable_and_v_decreases_along_the_lqr():
    A, B = linearise.hover(NOMINAL)
    plain = hover_gains(NOMINAL, integral=False)
    assert not plain.K_i.any()
    closed = A - B @ plain.K
    assert np.linalg.eigvals(closed).real.max() == pytest.approx(-0.5, abs=0.02)
    assert np.linalg.eigvalsh(closed.T @ plain.S + plain.S @ closed).max() < 0.0
    K, K_i = lqi(A, B, np.eye(12), np.eye(4), 0.2)
    whole = np.block([[A - B @ K, -B @ K_i], [np.eye(3, 12), np.zeros((3, 3))]])
    assert np.linalg.eigvals(whole).real.max() < -0.2


def test_the_diagonal_of_s_gives_v_its_metres():
    S = hover_gains(NOMINAL).S
    assert np.diag(S) == pytest.approx(
        [1.59, 1.47, 1.30, 1.02, 0.75, 0.46, 13.4, 88, 13.6, 0.045, 0.31, 0.034], rel=0.02
    )


def test_the_forward_schedule_is_an_lqr_at_every_speed_and_the_trims_of_every_climb():
    gains = forward_gains(NOMINAL)
    for i in (0, 11, 30, 50):
        A, B = model(NOMINAL, level_trim(NOMINAL, SPEEDS[i]))
        weight = 1.0 + (SPEEDS[i] / forward_linear.FLOW) ** 2
        R = np.diag(forward_linear.FORWARD_EFFORT * (1.0, 1.0, weight, weight))
        S = solve_continuous_are(A, B, WEIGHTS, R)
        K = np.linalg.solve(R, B.T @ S)
        assert gains.S[i] == pytest.approx(S, abs=1e-9 * np.abs(S).max())
        assert gains.K[i] == pytest.approx(K, abs=1e-9 * np.abs(K).max())
    trim = level_trim(NOMINAL, SPEEDS[20], CLIMBS[25])
    table = gains.theta[20, 25], gains.thrust[20, 25], gains.delta[20, 25]
    assert table == pytest.approx((trim.theta, trim.thrust, trim.delta), abs=1e-7)


def test_without_a_trim_there_is_no_forward_law():
    with pytest.raises(SitlError, match="nothing balances level flight at"):
        forward_gains(load("report-table").parameters)
