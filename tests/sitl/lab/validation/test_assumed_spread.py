"""Claims of level flight over what the aircraft's file assumes: it names the intervals, and the draws are seeded."""

import math

import pytest

from sitl import SitlError, load_airframe
from sitl.__main__ import main
from sitl.design.trim import level_trim
from sitl.lab.validation.assumed_spread import INTERVALS, Claims, as_text, claims, spread

SET = load_airframe("darko")
DARKO = SET.parameters


def test_the_set_lies_in_every_interval_and_its_file_says_that_they_are_assumed():
    for key, (low, high) in INTERVALS.items():
        assert low <= getattr(DARKO, key) <= high
        source = SET.values[{"per_stall": "stall_angle"}.get(key, key)].source
        assert "assumed" in source or " to " in source


def test_the_claims_are_those_of_the_trims():
    own = claims(DARKO)
    assert own.hover_power == pytest.approx(120.0, abs=3.0)
    assert own.most_elevon == pytest.approx(math.degrees(level_trim(DARKO, 10.0).delta), abs=0.3)
    assert 14.0 <= own.cheapest_speed <= 18.0


@pytest.mark.long
def test_a_seed_is_one_spread_about_the_claims():
    drawn = spread(DARKO, 6)
    assert spread(DARKO, 6) == drawn
    assert spread(DARKO, 6, seed=2) != drawn
    own = claims(DARKO)
    assert min(one.hover_power for one in drawn) < own.hover_power < max(one.hover_power for one in drawn)
    with pytest.raises(SitlError, match="--spread 0: must be at least 1"):
        spread(DARKO, 0)


def test_a_line_names_the_claim_its_unit_and_its_interval():
    others = [Claims(90.0, 14.0, 1e4, 19.0, 12.0, 20.0), Claims(110.0, 16.0, 3e4, 21.0, 15.0, 25.0)]
    lines = as_text(Claims(100.0, 15.0, 2e4, 20.0, 13.0, 22.0), others)
    assert lines[1] == "hover power 100 W (90 to 110)"
    assert lines[4] == "most elevon 20 deg (19 to 21)"
    assert lines[-1] == "break even turned 22 m (20 to 25)"


def test_a_leg_breaks_even_no_sooner_after_a_turn():
    own = claims(DARKO)
    assert 10.0 < own.break_even <= own.break_even_turned < 60.0


def test_the_command_prints_them(capsys):
    assert main(["study", "validate", "--spread", "2"]) == 0
    assert "in brackets over 2 draws" in capsys.readouterr().out
