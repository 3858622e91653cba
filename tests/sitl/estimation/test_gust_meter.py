"""The level of the gusts by the force across the wing: found, followed, and not mistaken for what lasts."""

import math

import numpy as np
import pytest

from sitl.estimation.gust_meter import (
    FIRST_LEVEL,
    FIRST_SHARE,
    FIRST_SHARE_DOUBT,
    LEAST_LEVEL,
    MOST_SHARE,
    Felt,
    LackingModel,
    corrected_by,
    felt_anew,
    lacking_after,
    metered,
    unknown_gusts,
)
from sitl.model.vectors import Vector

STEP, TURNOVER = 0.01, 4.0  # of readings and of gusts [s]
NOISE, SLOPE = 0.02, -1.5  # of the force [m/s2], [1/s]
STILL = Vector(0.0, 0.0, 0.0)


def felt(innovation, slope=SLOPE):
    return Felt(
        innovation=innovation,
        made=0.0,
        slope=Vector(0.0, 0.0, slope),
        steep=0.0,
        curve=0.0,
        raised=0.0,
        bend=0.0,
        noise=NOISE**2,
        step=STEP / TURNOVER,
    )


def pushes(level, seconds, random):
    """Mean forces of steps that gusts make of this level, whose air wanders within the steps, too."""
    fine, n = 10, round(seconds / STEP)
    keep = math.exp(-STEP / fine / TURNOVER)
    gust, air = level * random.standard_normal(), []
    for fresh in random.standard_normal(n * fine):
        gust = keep * gust + level * math.sqrt(1.0 - keep * keep) * fresh
        air.append(gust)
    return SLOPE * np.array(air).reshape(n, fine).mean(axis=1) + NOISE * random.standard_normal(n)


def after(forces, meter=None):
    meter = meter or unknown_gusts(FIRST_LEVEL)
    for force in forces:
        meter = metered(meter, felt(float(force)), STILL, STEP)
    return meter


@pytest.mark.parametrize("level", [0.25, 0.5, 1.0, 2.0])
def test_the_level_is_found_in_some_seconds(level):
    found = [after(pushes(level, 10.0, np.random.default_rng(seed))).level for seed in range(6)]
    assert np.mean(found) == pytest.approx(level, rel=0.1)
    assert np.std(found) < 0.2 * level


def test_still_air_is_still():
    calm = after(NOISE * np.random.default_rng(1).standard_normal(2000))
    assert calm.level == pytest.approx(LEAST_LEVEL, abs=0.02)


def test_a_level_that_changes_is_followed():
    random = np.random.default_rng(2)
    weak = after(pushes(0.3, 10.0, random))
    strong = after(pushes(1.5, 20.0, random), weak)
    assert weak.level < 0.4
    assert strong.level == pytest.approx(1.5, rel=0.25)


def test_what_lasts_is_no_gust():
    random = np.random.default_rng(3)
    noise = NOISE * random.standard_normal(2000)
    slow = 2.0 + 0.5 * np.sin(0.2 * STEP * np.arange(2000))
    assert after(noise + slow).level < FIRST_LEVEL


def test_a_correction_of_the_belief_is_no_gust():
    meter = after(NOISE * np.random.default_rng(4).standard_normal(1000))
    through = Vector(0.0, 0.0, 0.8)
    told = metered(corrected_by(meter, through), felt(meter.residual - SLOPE * 0.8), through, STEP)
    untold = metered(meter, felt(meter.residual - SLOPE * 0.8), through, STEP)
    assert told.level == pytest.approx(meter.level, rel=0.01)
    assert untold.level > 1.05 * meter.level


def test_a_steeper_force_tells_of_weaker_gusts():
    forces = pushes(1.0, 10.0, np.random.default_rng(5))
    meter = unknown_gusts(FIRST_LEVEL)
    for force in forces:
        meter = metered(meter, felt(float(force), 2.0 * SLOPE), STILL, STEP)
    assert meter.level == pytest.approx(0.5 * after(forces).level, rel=0.1)


def test_after_a_landing_the_level_is_kept_and_the_force_forgotten():
    meter = after(pushes(1.0, 5.0, np.random.default_rng(6)))
    anew = felt_anew(meter)
    assert (anew.level, anew.growth) == (meter.level, 1.0)
    assert anew.variance > 100.0 * meter.variance


def test_the_growth_is_that_of_the_last_reading():
    meter = after(pushes(1.0, 1.0, np.random.default_rng(7)))
    again = metered(meter, felt(3.0), STILL, STEP)
    assert again.growth == pytest.approx(again.level / meter.level)
    assert again.growth > 1.0


@pytest.mark.parametrize(
    ("off", "least", "most"), [(0.0, 0.0, 0.3), (1.0, 0.9, 1.1), (3.0, 1.5, MOST_SHARE / FIRST_SHARE)]
)
def test_a_model_is_as_wrong_as_its_innovations_are_large(off, least, most):
    """Innovations as large as expected change nothing; smaller and larger ones do."""
    noise, force, wing = 0.1**2, 5.0, LackingModel(FIRST_SHARE, FIRST_SHARE_DOUBT)
    innovation = off * math.sqrt(noise + (FIRST_SHARE * force) ** 2)
    for _ in range(1000):
        lacks = (wing.share * force) ** 2
        wing = lacking_after(wing, innovation, lacks, noise + lacks)
    assert least * FIRST_SHARE <= wing.share <= most * FIRST_SHARE


def test_what_the_wind_explains_tells_nothing_of_the_model():
    wing = LackingModel(FIRST_SHARE, FIRST_SHARE_DOUBT)
    assert lacking_after(wing, 3.0, 0.0, 0.01) == wing
