"""Returns and landings asked for on the way: what is drawn, how they end, and what counts as good."""

import math

import pytest

from sitl.lab.studies.landings import (
    ALONG,
    ASIDE,
    HIGHEST_ASKED,
    LOWEST_ASKED,
    MAX_UNNOTICED,
    AskedLanding,
    AskedLandingEnd,
    asked_passed,
    asked_summary,
    fly_asked,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation

WELL = AskedLanding(
    seed=1, request="RTL", place=(10.0, 3.0, 20.0), wind=5.0, law="TO_HOVER", end=AskedLandingEnd.UPRIGHT, low=19.0,
    unnoticed=0.05, slid=0.0, sink=0.5, level=0.1, off=0.2, time=40.0, ground=0.0,
)  # fmt: skip


@pytest.mark.parametrize(("seed", "controller"), [(1, "hybrid"), (3, "indi")])
def test_a_return_or_landing_asked_for_in_forward_flight_stops_stands_upright_and_sinks(seed, controller):
    landing = fly_asked(seed, Craft("physical", Navigation.TRUTH, controller=controller), 5.0, 1.0)
    assert landing.is_good
    assert landing.wind == 0.0
    assert math.hypot(*landing.place[:2]) <= math.hypot(ALONG + 1.0, ASIDE)
    assert LOWEST_ASKED - 1.0 < landing.place[2] < HIGHEST_ASKED + 1.0
    assert landing.low > 0.7 * landing.place[2]  # it did not sink before it stood


@pytest.mark.parametrize(("slope", "ground"), [(5.0, 0.0), (0.0, 2.0)])
def test_on_a_slope_and_on_higher_ground_it_ends_as_well_above_the_highest_of_it(slope, ground):
    landing = fly_asked(1, Craft("physical", Navigation.TRUTH), 5.0, 1.0, slope, ground)
    level = fly_asked(1, Craft("physical", Navigation.TRUTH), 5.0, 1.0)
    assert landing.is_good
    if slope:
        assert landing.place[2] > level.place[2] + 0.5
    else:
        assert landing.place[2] == pytest.approx(level.place[2] + ground, abs=0.1)


def test_a_soft_touch_on_a_slope_above_home_is_noticed_at_once():
    landing = fly_asked(21, Craft("physical"), 5.0, 1.0, slope=5.0)
    assert landing.is_good
    assert landing.ground > 2.0
    assert landing.unnoticed < 0.2


@pytest.mark.parametrize(
    "lost",
    [
        WELL._replace(end=AskedLandingEnd.TIPPED),
        WELL._replace(end=AskedLandingEnd.IN_THE_AIR),
        WELL._replace(unnoticed=MAX_UNNOTICED + 0.1),
    ],
)
def test_one_that_is_lost_or_noticed_late_fails_the_study_and_is_named(lost):
    assert asked_passed([WELL, WELL])
    assert not asked_passed([WELL, lost._replace(seed=7)])
    lines = "\n".join(asked_summary([WELL, lost._replace(seed=7)]))
    assert f"{lost.end}: seed 7: RTL in TO_HOVER" in lines
    assert "seed 1:" not in lines
