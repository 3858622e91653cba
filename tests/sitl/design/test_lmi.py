"""The hover gain by LMI against its guarantee, and against another solver."""

import math

import numpy as np
import pytest

from sitl.design import linearise
from sitl.design.inequalities import least_cost
from sitl.design.lmi import DECAY, LMI_EFFORT, SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import hover_gains, lqr
from sitl.errors import SitlError
from sitl.model.airframe_files import load

NOMINAL = load("nominal").parameters
A, B = linearise.hover(NOMINAL)
LQR = hover_gains(NOMINAL, integral=False)


@pytest.fixture(scope="module")
def gains():
    return lmi_gains(NOMINAL)


def test_without_decay_and_spread_it_is_the_lqr():
    plain = lmi_gains(NOMINAL, decay=0.0, spread=0.0, effort=1.0)
    assert pytest.approx(plain.K, abs=1e-4) == LQR.K
    assert pytest.approx(plain.S, abs=1e-4) == LQR.S


@pytest.mark.long
def test_the_guarantee_holds_for_every_effectiveness_within_the_spread(gains):
    random = np.random.default_rng(1)
    promised = np.eye(12) + LMI_EFFORT * gains.K.T @ gains.K
    for motor, elevon in random.uniform(1.0 - SPREAD, 1.0 + SPREAD, (200, 2)):
        closed = A - B * [motor, motor, motor * elevon, motor * elevon] @ gains.K
        rest = closed.T @ gains.S + gains.S @ closed + 2.0 * DECAY * gains.S + promised
        assert np.linalg.eigvalsh(rest).max() < 1e-5
        assert np.linalg.eigvals(closed).real.max() < -DECAY


@pytest.mark.long
@pytest.mark.filterwarnings("ignore:Solution may be inaccurate")
def test_another_solver_finds_no_less_cost(gains):
    """CLARABEL on the whole of the hover, not its halves; it may break the inequalities by a little."""
    import cvxpy as cp  # here, since it would take every process that collects the tests a second

    corners = effectiveness(NOMINAL, SPREAD)
    scale = np.sqrt(np.diag(lqr(A, corners[0], np.eye(12), LMI_EFFORT * np.eye(4))[1]))
    T, back = np.diag(scale), np.diag(1.0 / scale)
    X, Y, Z = cp.Variable((12, 12), symmetric=True), cp.Variable((4, 12)), cp.Variable((12, 12), symmetric=True)
    constraints = [cp.bmat([[Z, T], [T, X]]) >> 0]
    for corner in corners:
        drift = T @ A @ back @ X - T @ corner @ Y
        cost = cp.vstack([back @ X, math.sqrt(LMI_EFFORT) * Y])
        constraints.append(cp.bmat([[-drift - drift.T - 2.0 * DECAY * X, cost.T], [cost, np.eye(16)]]) >> 0)
    problem = cp.Problem(cp.Minimize(cp.trace(Z)), constraints)
    problem.solve(solver=cp.CLARABEL)
    assert np.trace(gains.S) == pytest.approx(problem.value, rel=1e-5)
    K = Y.value @ np.linalg.inv(X.value) @ T
    assert pytest.approx(K, abs=1e-3) == gains.K


def test_the_least_cost_of_one_state_is_known():
    """Of x' = u with u = -k x: V' = -2 k s x^2 = -(1 + rho k^2) x^2, least at k = 1 / sqrt(rho)."""
    K, S = least_cost(np.zeros((1, 1)), np.ones((1, 1, 1)), 0.0, 4.0)
    assert pytest.approx(0.5, rel=1e-3) == K
    assert pytest.approx(2.0, rel=1e-6) == S


def test_the_lqr_guarantees_less(gains):
    corners = effectiveness(NOMINAL, SPREAD)
    ours, theirs = (guaranteed_decay(A, corners, law.K, law.S) for law in (gains, LQR))
    assert theirs == pytest.approx(0.30, abs=0.01)
    assert ours > DECAY
    assert ours > theirs


@pytest.mark.long
@pytest.mark.parametrize("choice", [{"decay": 10.0}, {"spread": 0.9}, {"effort": 1e-3}, {"effort": 1e4}])
def test_far_from_the_usual_there_are_gains_as_well(choice):
    found = lmi_gains(NOMINAL, **choice)
    for corner in effectiveness(NOMINAL, choice.get("spread", SPREAD)):
        assert np.linalg.eigvals(A - corner @ found.K).real.max() < -choice.get("decay", DECAY)


def test_a_decay_rate_is_that_of_the_worst_corner():
    """Of x' = -s x under V = x^2 the rate is s: the smallest counts."""
    corners = [np.array([[0.5]]), np.array([[2.0]])]
    assert guaranteed_decay(np.zeros((1, 1)), corners, np.eye(1), np.eye(1)) == pytest.approx(0.5)


@pytest.mark.parametrize(
    "choice", [{"decay": -1.0}, {"spread": 1.0}, {"effort": 0.0}, {"decay": float("nan")}, {"decay": 1e5}]
)
def test_what_cannot_be_guaranteed_is_one_line(choice):
    with pytest.raises(SitlError) as error:
        lmi_gains(NOMINAL, **choice)
    assert "\n" not in str(error.value)
