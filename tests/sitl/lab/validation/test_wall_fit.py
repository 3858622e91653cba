"""The fit to the flight before the wind wall: the shipped constants are its own, and only what is shared counts."""

import math

import pytest

from sitl import load_airframe
from sitl.__main__ import main
from sitl.lab.validation.wall_fit import fit
from sitl.lab.validation.wall_flight import FLIGHT
from sitl.model.airframe import elevon_arm, slipstream_slope

DARKO = load_airframe("darko").parameters


def test_the_shipped_constants_are_those_of_the_fit():
    C_d0, stall_angle, C_90, _ = fit(DARKO)
    shipped = (DARKO.C_d0, math.degrees(math.asin(1.0 / math.sqrt(DARKO.per_stall))), DARKO.C_90)
    assert abs(C_d0 - shipped[0]) < 0.001
    assert abs(stall_angle - shipped[1]) < 0.2
    assert abs(C_90 - shipped[2]) < 0.01


def test_a_wrong_start_finds_them_too_and_the_elevons_moment_stays():
    start = DARKO._replace(C_d0=0.05, C_90=1.0)
    found = fit(start)
    assert found.C_d0 == pytest.approx(DARKO.C_d0, abs=0.002)
    moment, kept = (a.S_ratio * slipstream_slope(a) * a.xi_f * elevon_arm(a) for a in (start, found.airframe))
    assert kept == pytest.approx(moment, rel=1e-9)


def test_the_thesis_moment_of_the_elevons_is_the_set_s():
    """S_wet / (4 S_p) Delta_r C_l xi_m of the thesis [m]."""
    thesis = 0.0180 / (4.0 * 0.0127) * 0.0145 * 5.4001 * 1.4
    assert DARKO.S_ratio * slipstream_slope(DARKO) * DARKO.xi_f * elevon_arm(DARKO) == pytest.approx(thesis, rel=0.01)


def test_what_was_kept_back_moves_no_constant():
    moved = [row if row.fitted else row._replace(flown=row.flown._replace(pitch=45.0, elevon=30.0)) for row in FLIGHT]
    assert fit(DARKO, moved) == fit(DARKO)


def test_the_command_prints_it(capsys):
    assert main(["study", "validate", "--fit"]) == 0
    assert "fitted to the shared stretches alone" in capsys.readouterr().out
