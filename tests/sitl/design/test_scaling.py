"""Gains of vehicles of another size: those of the shipped sets are as they were, others go by their units."""

from pathlib import Path

import numpy as np
import pytest

from sitl.design.gains import indi_gains, line_of_sight_gains, zero_moment_gains
from sitl.design.lqr import gentle_hover_gains
from sitl.design.scaling import UNIT_SCALE, scale_of
from sitl.lab.studies.airframe_variants import write_similar
from sitl.model.airframe_files import available, load
from sitl.simulation.tuning import INDI, Tuning, designed

DARKO = load("darko")
RATIO = 2.0 ** (1.0 / 3.0)  # of the lengths of two vehicles, one of twice the other's mass


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    folder = tmp_path_factory.mktemp("pair")
    return [load(write_similar(DARKO, mass, Path(folder)).path).parameters for mass in (2.0, 4.0)]


@pytest.mark.parametrize("name", available())
def test_every_shipped_set_is_of_size_1_to_the_bit(name):
    assert scale_of(load(name).parameters) == UNIT_SCALE


def test_a_model_that_is_wrong_by_some_per_cent_has_the_gains_of_the_right_one():
    a = DARKO.parameters
    assert {scale_of(a._replace(m=share * a.m)) for share in (0.93, 1.07)} == {UNIT_SCALE}


def test_a_long_lag_slows_the_laws_and_a_short_one_does_not_hasten_them():
    a = DARKO.parameters
    assert scale_of(a._replace(elevon_tau=0.12)).time == pytest.approx(2.0)
    assert scale_of(a._replace(elevon_tau=0.01, motor_tau=0.001)).time == 1.0


def test_similar_vehicles_have_gains_by_their_units(pair):
    small, large = (gentle_hover_gains(a) for a in pair)
    time, force = RATIO**0.5, RATIO**3
    columns = np.repeat((1.0 / RATIO, time / RATIO, 1.0, time), 3)  # of positions, velocities, tilts, rates
    assert pytest.approx(force * columns * small.K, rel=1e-5, abs=1e-6) == large.K
    assert large.K_i == pytest.approx(force / (RATIO * time) * small.K_i, rel=1e-5, abs=1e-6)
    # V of a like deviation is as large.
    assert pytest.approx(np.outer(columns, columns) * small.S, rel=1e-5, abs=1e-5) == large.S
    limits = ("lead", time), ("integral_limit", RATIO), ("reach", RATIO), ("bound", RATIO * time), ("headway", time)
    for field, factor in limits:
        assert getattr(large, field) == pytest.approx(factor * getattr(small, field), rel=1e-5)


@pytest.mark.long
def test_similar_vehicles_turn_by_their_times(pair):
    small, large = (zero_moment_gains(a) for a in pair)
    assert large.lam == pytest.approx(small.lam / RATIO**0.5)
    assert large.governor.k_pp == pytest.approx(RATIO**2 * small.governor.k_pp)  # N/m
    sights = [line_of_sight_gains(0.0, scale_of(a)) for a in pair]
    assert sights[1].rate.x == pytest.approx(sights[0].rate.x / RATIO**0.5)
    by_indi = [designed(a, Tuning(controller=INDI)).gains.indi for a in pair]
    for field in ("attitude", "rate"):
        assert tuple(getattr(by_indi[1], field)) == pytest.approx(
            tuple(gain / RATIO**0.5 for gain in getattr(by_indi[0], field))
        )
    assert by_indi[1].moment_filter == pytest.approx(by_indi[0].moment_filter / RATIO**0.5)
    assert by_indi[1].guidance.k_p == pytest.approx(by_indi[0].guidance.k_p / RATIO**0.5)


def test_the_gains_of_indi_on_a_shipped_set_are_those_of_size_1():
    assert designed(DARKO.parameters, Tuning(controller=INDI)).gains.indi == indi_gains()
