"""Paparazzi's constants of this aircraft: units, and the airframe by which the law has the file's effectiveness."""

import math

import pytest

from sitl.design.gains import indi_gains
from sitl.design.paparazzi_indi import believed, computed, paparazzi_gains, printed
from sitl.model.airframe_files import load
from sitl.model.propeller import hover_speed
from sitl.simulation.tuning import INDI, Tuning, designed

DARKO = load("darko").parameters
HOVER = hover_speed(DARKO)


def test_the_airframe_that_the_law_knows_has_the_effectiveness_of_the_file():
    assert computed(believed(DARKO), HOVER) == pytest.approx(printed())


def test_the_plants_own_effectiveness_is_the_files_but_for_the_roll_about_the_nose():
    own, theirs = computed(DARKO, HOVER), printed()
    assert own.roll == pytest.approx(theirs.roll, rel=0.06)
    assert own.pitch == pytest.approx(theirs.pitch, rel=0.2)
    assert own.thrust == pytest.approx(theirs.thrust, rel=0.15)
    assert own.yaw == pytest.approx(theirs.yaw / 3.0, rel=0.02)


def test_a_pprz_is_the_9600th_of_a_full_command():
    """A motor's full command is 16066 rpm, an elevon's 30 deg: by differences of the thrust and of the roll moment."""
    speed = math.sqrt(2.0) * 900.0
    plain = DARKO._replace(k_fw=0.0)
    by_motor = 2.0 * plain.k_f * speed * 16066.0 * 2.0 * math.pi / 60.0 / 9600.0
    assert computed(plain, speed).thrust == pytest.approx(by_motor * (1.0 - plain.S_ratio * plain.C_d0) / plain.m)


def test_gains_and_lags_are_those_of_the_file():
    gains, known = paparazzi_gains(), believed(DARKO)
    assert gains.attitude.x * gains.rate.x * 2.0 == pytest.approx(120.0)
    assert gains.moment_filter == pytest.approx(2.0 * math.pi * 5.0)
    assert (known.elevon_tau, known.motor_tau) == pytest.approx((0.048, 0.077), abs=5e-4)
    assert gains.guidance.k_p == 0.2


def test_only_studies_fly_them():
    assert designed(DARKO, Tuning(controller=INDI)).gains.indi == indi_gains()
    assert designed(DARKO, Tuning(controller=INDI, paparazzi=1)).gains.indi == paparazzi_gains()
