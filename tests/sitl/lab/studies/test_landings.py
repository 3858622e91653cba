"""Landings in wind: upright, soon at rest, and told apart where they are not."""

import math

import pytest

from sitl.errors import SitlError
from sitl.lab.studies.landings import MAX_BOUNCE, Landing, LandingEnd, count, on_drawn_ground, run, summary
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation
from sitl.vehicle.parameters import WorldSettings

NOMINAL = Craft("nominal", Navigation.TRUTH)
WELL = Landing(
    seed=1, wind=2.0, heading=0.5, end=LandingEnd.UPRIGHT, bounce=0.1, sink=0.5, slide=0.1, away=0.2, time=13.0
)


@pytest.fixture(scope="module")
def landed():
    return run(6, 1, NOMINAL, 5.0, 0.5)


def test_landings_in_wind_end_upright_and_soon_at_rest(landed):
    assert [landing.end for landing in landed] == [LandingEnd.UPRIGHT] * 6
    assert max(landing.bounce for landing in landed) < MAX_BOUNCE
    assert max(landing.sink for landing in landed) < 2.0


def test_one_seed_is_one_landing(landed):
    assert run(1, 3, NOMINAL, 5.0, 0.5) == [landed[2]]


def test_the_summary_counts_the_ends_and_names_the_bad_ones():
    lines = "\n".join(summary([WELL, WELL._replace(seed=2, end=LandingEnd.TIPPED), WELL._replace(seed=3, bounce=4.0)]))
    assert "2 upright, 1 tipped over, 0 crashed, 0 late" in lines
    assert "tipped over: seed 2: wind 2.0 m/s" in lines
    assert "upright: seed 3" in lines
    assert "seed 1:" not in lines
    assert count([WELL, WELL], LandingEnd.CRASHED) == 0


@pytest.mark.parametrize(("flights", "jobs"), [(0, 1), (1, 0)])
def test_no_landings_are_refused(flights, jobs):
    with pytest.raises(SitlError, match="at least 1"):
        run(flights, 1, NOMINAL, 5.0, 0.5, jobs)


@pytest.mark.parametrize(
    ("controller", "slope", "ground"), [("hybrid", 5.0, 0.0), ("indi", 5.0, 0.0), ("hybrid", 0.0, 2.0)]
)
def test_on_a_slope_and_on_higher_ground_it_lands_upright_too(controller, slope, ground):
    craft = Craft("physical", Navigation.TRUTH, controller=controller)
    (landing,) = run(1, 2, craft, 5.0, 0.5, slope=slope, ground=ground)
    assert landing.end is LandingEnd.UPRIGHT
    assert landing.bounce < MAX_BOUNCE
    assert run(1, 2, craft, 5.0, 0.5) != [landing]


def test_an_indi_that_slides_through_the_air_it_sinks_into_stops_sinking_and_lands_on_higher_ground():
    (landing,) = run(1, 24, Craft("physical", controller="indi"), 5.0, 0.5, ground=2.0)
    assert landing.end is LandingEnd.UPRIGHT
    assert landing.slide < 0.2


def test_where_the_ground_rises_is_drawn_by_the_seed():
    calm = WorldSettings()
    one, other = (on_drawn_ground(calm, seed, 5.0, 2.0).ground for seed in (1, 2))
    assert one == on_drawn_ground(calm, 1, 5.0, 2.0).ground != other
    assert one.height == 2.0
    assert one.normal.z == pytest.approx(math.cos(math.radians(5.0)))
    assert on_drawn_ground(calm, 1, 0.0, 0.0).ground == calm.ground
