"""Gusts: their deviation, their time."""

import math

import numpy as np
import pytest

from sitl.model.gusts import gust_after
from sitl.model.vectors import Vector
from tests.support.estimates import STILL, vector


@pytest.mark.parametrize("dt", [0.002, 0.02])
def test_gusts_have_the_deviation_asked_for_at_any_step(dt):
    rng = np.random.default_rng(5)
    gust, seen = vector(STILL), []
    for noise in rng.standard_normal((60_000, 3)):
        gust = gust_after(gust, Vector(*noise.tolist()), 1.5, 0.5, 10.0, dt)
        seen.append(gust)
    assert np.std(seen[2000:]) == pytest.approx(1.5, rel=0.04)


def test_gusts_fade_over_the_time_it_takes_to_fly_through_them():
    """Without fresh noise e-folding takes length / airspeed; air at rest turns over slowly all the same."""
    gust = Vector(1.0, -2.0, 0.5)
    for _ in range(150):
        gust = gust_after(gust, vector(STILL), 1.0, 30.0, 20.0, 0.01)
    assert gust == pytest.approx((1.0 / math.e, -2.0 / math.e, 0.5 / math.e))
    still = Vector(1.0, 1.0, 1.0)
    for _ in range(100):
        still = gust_after(still, vector(STILL), 1.0, 30.0, 0.0, 0.3)
    assert still == pytest.approx((1.0 / math.e,) * 3)
