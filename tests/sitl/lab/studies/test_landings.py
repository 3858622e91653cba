"""Landings in wind: upright, soon at rest, and told apart where they are not."""

import json
import math

import pytest

from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.lab.studies import landings
from sitl.lab.studies.landings import (
    ALONG,
    ASIDE,
    HIGHEST_ASKED,
    LOWEST_ASKED,
    MAX_BOUNCE,
    MAX_UNNOTICED,
    AskedLanding,
    AskedLandingEnd,
    Landing,
    LandingEnd,
    LongFlight,
    air_passed,
    air_summary,
    asked_passed,
    asked_summary,
    count,
    fly,
    fly_asked,
    fly_in_air,
    on_drawn_ground,
    run,
    summary,
)
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


@pytest.mark.long
def test_landings_in_wind_end_upright_and_soon_at_rest(landed):
    assert [landing.end for landing in landed] == [LandingEnd.UPRIGHT] * 6
    assert max(landing.bounce for landing in landed) < MAX_BOUNCE
    assert max(landing.sink for landing in landed) < 2.0


def test_one_seed_is_one_landing(landed):
    assert run(1, 3, NOMINAL, 5.0, 0.5) == [landed[2]]


def test_the_summary_counts_the_ends_and_names_the_bad_ones():
    lines = "\n".join(summary([WELL, WELL._replace(seed=2, end=LandingEnd.TIPPED), WELL._replace(seed=3, bounce=4.0)]))
    assert "2 upright (9.4 to 99.2 %), 1 tipped over (0.8 to 90.6 %), 0 crashed (0 to 70.8 %)" in lines
    assert "0 late (0 to 70.8 %)" in lines
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
    craft = Craft("collage", Navigation.TRUTH, controller=controller)
    (landing,) = run(1, 2, craft, 5.0, 0.5, slope=slope, ground=ground)
    assert landing.end is LandingEnd.UPRIGHT
    assert landing.bounce < MAX_BOUNCE
    assert run(1, 2, craft, 5.0, 0.5) != [landing]


def test_an_indi_that_slides_through_the_air_it_sinks_into_stops_sinking_and_lands_on_higher_ground():
    (landing,) = run(1, 24, Craft("collage", controller="indi"), 5.0, 0.5, ground=2.0)
    assert landing.end is LandingEnd.UPRIGHT
    assert landing.slide < 0.2


def test_an_indi_that_touches_leaning_by_its_trim_is_let_go_at_once():
    """In 5 m/s it leans by 19 deg; held at that on the ground it bounced, and tipped over."""
    (landing,) = run(1, 48, Craft("collage", controller="indi"), 5.0, 0.5, ground=2.0)
    assert landing.end is LandingEnd.UPRIGHT
    assert landing.bounce < 1.5


@pytest.mark.parametrize(("seed", "controller"), [(5, "hybrid"), (58, "hybrid"), (31, "indi")])
def test_a_gust_from_below_is_no_ground_to_a_vehicle_that_begins_to_land_near_it(seed, controller):
    """Holding 1.5 or 3.5 m over the ground in wind; all stopped their motors in the air once."""
    low = fly(seed, Craft("darko", controller=controller), 5.0, 1.0, height=1.5 if controller == "hybrid" else 3.5)
    assert low.end is LandingEnd.UPRIGHT


def test_where_the_ground_rises_is_drawn_by_the_seed():
    calm = WorldSettings()
    one, other = (on_drawn_ground(calm, seed, 5.0, 2.0).ground for seed in (1, 2))
    assert one == on_drawn_ground(calm, 1, 5.0, 2.0).ground != other
    assert one.height == 2.0
    assert one.normal.z == pytest.approx(math.cos(math.radians(5.0)))
    assert on_drawn_ground(calm, 1, 0.0, 0.0).ground == calm.ground


# Returns and landings asked for on the way: what is drawn, how they end, and what counts as good.


ASKED_LANDINGS_WELL = AskedLanding(
    seed=1, request="RTL", place=(10.0, 3.0, 20.0), wind=5.0, law="TO_HOVER", end=AskedLandingEnd.UPRIGHT, low=19.0,
    unnoticed=0.05, slid=0.0, sink=0.5, level=0.1, off=0.2, time=40.0, ground=0.0,
)  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(("seed", "controller"), [(1, "hybrid"), (3, "indi")])
def test_a_return_or_landing_asked_for_in_forward_flight_stops_stands_upright_and_sinks(seed, controller):
    landing = fly_asked(seed, Craft("collage", Navigation.TRUTH, controller=controller), 5.0, 1.0)
    assert landing.is_good
    assert landing.wind == 0.0
    assert math.hypot(*landing.place[:2]) <= math.hypot(ALONG + 1.0, ASIDE)
    assert LOWEST_ASKED - 1.0 < landing.place[2] < HIGHEST_ASKED + 1.0
    assert landing.low > 0.7 * landing.place[2]  # it did not sink before it stood


@pytest.mark.long
@pytest.mark.parametrize(("slope", "ground"), [(5.0, 0.0), (0.0, 2.0)])
def test_on_a_slope_and_on_higher_ground_it_ends_as_well_above_the_highest_of_it(slope, ground):
    landing = fly_asked(1, Craft("collage", Navigation.TRUTH), 5.0, 1.0, slope, ground)
    level = fly_asked(1, Craft("collage", Navigation.TRUTH), 5.0, 1.0)
    assert landing.is_good
    if slope:
        assert landing.place[2] > level.place[2] + 0.5
    else:
        assert landing.place[2] == pytest.approx(level.place[2] + ground, abs=0.1)


def test_a_soft_touch_on_a_slope_above_home_is_noticed_at_once():
    landing = fly_asked(21, Craft("collage"), 5.0, 1.0, slope=5.0)
    assert landing.is_good
    assert landing.ground > 2.0
    assert landing.unnoticed < 0.2


@pytest.mark.parametrize(
    "lost",
    [
        ASKED_LANDINGS_WELL._replace(end=AskedLandingEnd.TIPPED),
        ASKED_LANDINGS_WELL._replace(end=AskedLandingEnd.IN_THE_AIR),
        ASKED_LANDINGS_WELL._replace(unnoticed=MAX_UNNOTICED + 0.1),
    ],
)
def test_one_that_is_lost_or_noticed_late_fails_the_study_and_is_named(lost):
    assert asked_passed([ASKED_LANDINGS_WELL, ASKED_LANDINGS_WELL])
    assert not asked_passed([ASKED_LANDINGS_WELL, lost._replace(seed=7)])
    lines = "\n".join(asked_summary([ASKED_LANDINGS_WELL, lost._replace(seed=7)]))
    assert f"{lost.end}: seed 7: RTL in TO_HOVER" in lines
    assert "seed 1:" not in lines


# Hours in the air: what is flown, and what is counted.


FALSE_CONTACTS_WELL = LongFlight(seed=1, wind=9.0, gusts=1.5, flown=600.0, lowest=21.0, false_contact="", crashed=False)


def test_a_flight_of_holds_legs_and_descents_stays_in_the_air(monkeypatch):
    monkeypatch.setattr(landings, "LONG_FLIGHT_TIME", 90.0)
    flown = fly_in_air(4, Craft("collage", Navigation.TRUTH), 6.0, 1.0)
    assert flown.flown == pytest.approx(90.0)
    assert flown.lowest > 10.0
    assert air_passed([flown])


def test_a_touch_down_in_the_air_fails_the_study_and_is_named():
    false = FALSE_CONTACTS_WELL._replace(seed=5, flown=61.0, false_contact="TO_HOVER after 61 s, 40 m up")
    assert not air_passed([FALSE_CONTACTS_WELL, false])
    lines = "\n".join(air_summary([FALSE_CONTACTS_WELL, false]))
    assert lines.startswith("2 flights, seeds 1 to 5: 0.2 h in the air, 1 false touch-downs")
    assert "seed 5: wind 9.0 m/s, gusts 1.5 m/s: touch-down in TO_HOVER after 61 s, 40 m up" in lines


# ``darko-sitl study landings``: its arguments and its file.


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--slope", "31"], "--slope 31 is not within 0 and 30"),
        (["--slope", "-1"], "--slope -1 is not within 0 and 30"),
        (["--ground", "-501"], "--ground -501 is not within -500 and 500 m"),
        (["--kind", "air", "--slope", "5"], "--slope and --ground: flights of --kind air do not come to the ground"),
        (["--kind", "air", "--ground", "2"], "--slope and --ground: flights of --kind air do not come to the ground"),
    ],
)
def test_bad_ground_is_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "landings", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_landings_on_a_slope_are_printed_and_written(tmp_path, capsys):
    path = tmp_path / "landings.json"
    arguments = ["--nav", "truth", "--slope", "5", "--ground", "2", "--flights", "1", "--jobs", "1"]
    assert main(["study", "landings", *arguments, "--json", str(path)]) == 0
    assert "1 upright" in capsys.readouterr().out
    (written,) = json.loads(path.read_text())
    assert written["end"] == "upright"
