"""The hover gain by LMI against its guarantee and the plant."""

import numpy as np
import pytest

from sitl.design import linearise
from sitl.design.lmi import DECAY, EFFORT, SPREAD, effectiveness, guaranteed_decay, lmi_gains
from sitl.design.lqr import hover_gains
from sitl.errors import SitlError
from sitl.studies.region import decay_seen, draw, fly, steps
from tests.support.hover_flight import NOMINAL

A, B = linearise.hover(NOMINAL)
LQR = hover_gains(NOMINAL, integral=False)


@pytest.fixture(scope="module")
def gains():
    return lmi_gains(NOMINAL)


def test_without_decay_and_spread_it_is_the_lqr():
    plain = lmi_gains(NOMINAL, decay=0.0, spread=0.0, effort=1.0)
    assert pytest.approx(plain.K, abs=1e-3) == LQR.K
    assert pytest.approx(plain.S, abs=1e-3) == LQR.S


def test_the_guarantee_holds_for_every_effectiveness_within_the_spread(gains):
    random = np.random.default_rng(1)
    promised = np.eye(12) + EFFORT * gains.K.T @ gains.K
    for motor, elevon in random.uniform(1.0 - SPREAD, 1.0 + SPREAD, (200, 2)):
        closed = A - B * [motor, motor, motor * elevon, motor * elevon] @ gains.K
        rest = closed.T @ gains.S + gains.S @ closed + 2.0 * DECAY * gains.S + promised
        assert np.linalg.eigvalsh(rest).max() < 1e-3
        assert np.linalg.eigvals(closed).real.max() < -DECAY


def test_the_lqr_guarantees_less(gains):
    corners = effectiveness(NOMINAL, SPREAD)
    ours, theirs = (guaranteed_decay(A, corners, law.K, law.S) for law in (gains, LQR))
    assert theirs == pytest.approx(0.30, abs=0.01)
    assert ours > DECAY
    assert ours > theirs


def test_a_decay_rate_is_that_of_the_worst_corner():
    """Of x' = -s x under V = x^2 the rate is s: the smallest counts."""
    corners = [np.array([[0.5]]), np.array([[2.0]])]
    assert guaranteed_decay(np.zeros((1, 1)), corners, np.eye(1), np.eye(1)) == pytest.approx(0.5)


def test_on_the_plant_it_settles_like_the_lqr_and_loses_fewer(gains):
    assert decay_seen(NOMINAL, gains) > DECAY
    assert steps(NOMINAL, gains).max() < steps(NOMINAL, LQR).max() + 1.5
    states = draw(LQR.S, 120, 2, envelope=True)
    ours, theirs = (fly(NOMINAL, law, states, 0.01) for law in (gains, LQR))
    assert ours.converged.mean() > theirs.converged.mean() + 0.1
    assert ours.saturated.mean() < 0.5 * theirs.saturated.mean()


@pytest.mark.parametrize(
    "choice", [{"decay": -1.0}, {"spread": 1.0}, {"effort": 0.0}, {"decay": float("nan")}, {"decay": 1e5}]
)
def test_what_cannot_be_guaranteed_is_one_line(choice):
    with pytest.raises(SitlError) as error:
        lmi_gains(NOMINAL, **choice)
    assert "\n" not in str(error.value)
