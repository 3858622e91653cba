"""Gusts: their deviation, their time."""

import math

import numpy as np
import pytest

from sitl.model.gusts import gust_after
from sitl.model.vectors import Vector
from tests.support.flights.estimates import STILL, vector


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


def test_each_axis_keeps_its_share_of_the_gust_and_takes_its_own_noise():
    gust, noise = Vector(1.0, -2.0, 0.5), Vector(0.3, -0.7, 1.1)
    keep = math.exp(-0.02 * 10.0 / 30.0)
    fresh = 1.5 * math.sqrt(1.0 - keep * keep)
    expected = [keep * before + fresh * drawn for before, drawn in zip(gust, noise, strict=True)]
    assert gust_after(gust, noise, 1.5, 30.0, 10.0, 0.02) == pytest.approx(expected, rel=1e-9)
