"""Landings in wind, on slopes and on higher ground; hours in the air without a false contact."""

import json

import pytest

from sitl.__main__ import main
from sitl.lab.studies import landings
from sitl.lab.studies.landings import LongFlight, air_passed, air_summary, fly_in_air
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.avionics import Navigation
from tests.support.campaigns import shipped

ON_TRUTH = Craft("collage", Navigation.TRUTH)


def landed(seed, craft, **changes):
    return shipped("landings", changes, seed=seed, craft=craft).measures


def asked_for(seed, craft, **derived):
    return shipped(
        "returns", {f"derived.{key}": value for key, value in derived.items()}, seed=seed, craft=craft
    ).measures


@pytest.mark.long
@pytest.mark.parametrize("seed", [1, 2, 3])
def test_landings_in_wind_end_upright_and_soon_at_rest(seed):
    flown = landed(seed, Craft("nominal", Navigation.TRUTH))
    assert (flown["upright"], flown["steady"], flown["noticed"]) == (1, 1, 1)
    assert flown["sink"] < 2.0


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("controller", "slope", "ground"), [("hybrid", 5.0, 0.0), ("indi", 5.0, 0.0), ("hybrid", 0.0, 2.0)]
)
def test_on_a_slope_and_on_higher_ground_it_lands_upright_too(controller, slope, ground):
    craft = Craft("collage", Navigation.TRUTH, controller=controller)
    place = {"parameters.SIM_GND_SLOPE": slope, "parameters.SIM_GND_ALT": ground, "start.up": 8.0 + ground}
    flown = landed(2, craft, **place)
    assert (flown["upright"], flown["steady"]) == (1, 1)
    assert flown != landed(2, craft)


def on_higher_ground(seed):
    indi = Craft("collage", controller="indi")
    return landed(seed, indi, **{"parameters.SIM_GND_ALT": 2.0, "start.up": 10.0})


def test_an_indi_that_slides_through_the_air_it_sinks_into_stops_sinking_and_lands_on_higher_ground():
    flown = on_higher_ground(24)
    assert flown["upright"]
    assert flown["slide"] < 0.2


def test_an_indi_that_touches_leaning_by_its_trim_is_let_go_at_once():
    """In 5 m/s it leans by 19 deg; held at that on the ground it bounced, and tipped over."""
    flown = on_higher_ground(48)
    assert flown["upright"]
    assert flown["bounce"] < 1.5


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("seed", "controller"), [(5, "hybrid"), (58, "hybrid"), (31, "indi")])
def test_a_gust_from_below_is_no_ground_to_a_vehicle_that_begins_to_land_near_it(seed, controller):
    """Holding 1.5 or 3.5 m over the ground in wind; all stopped their motors in the air once."""
    low = {"parameters.SIM_GUST_RMS": 1.0, "start.up": 1.5 if controller == "hybrid" else 3.5}
    assert landed(seed, Craft("darko", controller=controller), **low)["upright"]


# Returns and landings asked for on the way.


@pytest.mark.long
@pytest.mark.parametrize(("seed", "controller"), [(1, "hybrid"), (3, "indi")])
def test_a_return_or_landing_asked_for_in_forward_flight_stands_upright(seed, controller):
    assert asked_for(seed, ON_TRUTH._replace(controller=controller))["good"]


@pytest.mark.long
@pytest.mark.parametrize(("slope", "ground"), [(5.0, 0.0), (0.0, 2.0)])
def test_on_a_slope_and_on_higher_ground_what_is_asked_for_ends_as_well(slope, ground):
    assert asked_for(1, ON_TRUTH, slope=slope, ground_height=ground)["good"]


@pytest.mark.long
def test_a_soft_touch_on_a_slope_above_home_is_noticed_at_once():
    flown = asked_for(21, Craft("collage"), slope=5.0)
    assert flown["good"]
    assert flown["unnoticed"] < 0.2


# Hours in the air: what is flown, and what is counted.


WELL = LongFlight(seed=1, wind=9.0, gusts=1.5, flown=600.0, lowest=21.0, false_contact="", crashed=False)


def test_a_flight_of_holds_legs_and_descents_stays_in_the_air(monkeypatch):
    monkeypatch.setattr(landings, "LONG_FLIGHT_TIME", 90.0)
    flown = fly_in_air(4, ON_TRUTH, 6.0, 1.0)
    assert flown.flown == pytest.approx(90.0)
    assert flown.lowest > 10.0
    assert air_passed([flown])


def test_a_touch_down_in_the_air_fails_the_study_and_is_named():
    false = WELL._replace(seed=5, flown=61.0, false_contact="TO_HOVER after 61 s, 40 m up")
    assert not air_passed([WELL, false])
    lines = "\n".join(air_summary([WELL, false]))
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
        (["--kind", "asked", "--height", "3"], "--height: only landings of --kind hover"),
    ],
)
def test_bad_ground_is_refused_before_any_flight(arguments, message, capsys):
    assert main(["study", "landings", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_landings_on_a_slope_are_printed_and_written(tmp_path, capsys):
    path = tmp_path / "landings.json"
    arguments = ["--nav", "truth", "--slope", "5", "--ground", "2", "--flights", "1", "--jobs", "1"]
    assert main(["study", "landings", *arguments, "--json", str(path)]) == 0
    assert "| 1 | 1 of 1 (2.5 to 100 %) |" in capsys.readouterr().out
    (written,) = json.loads(path.read_text())
    assert written["upright"] is True


@pytest.mark.long
def test_landings_asked_for_on_the_way_are_printed_and_written(tmp_path, capsys):
    table = tmp_path / "l.json"
    arguments = ["--kind", "asked", "--flights", "2", "--jobs", "1", "--nav", "truth", "--wind", "3"]
    assert main(["study", "landings", *arguments, "--json", str(table)]) == 0
    assert "| 0 | 1 | 1 of 1 (2.5 to 100 %) |" in capsys.readouterr().out
    assert [(row["wind"], row["good"]) for row in json.loads(table.read_text())] == [(0.0, True), (3.0, True)]
