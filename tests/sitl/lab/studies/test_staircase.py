"""The staircase of winds: flown short by each controller, beside the flight's values, with a verdict."""

import argparse

import numpy as np
import pytest

from sitl.lab import study_options
from sitl.lab.studies import staircase
from sitl.lab.studies.seeded_flights import Craft
from sitl.lab.studies.staircase import FLOWN_DEVIATION, FlownStaircase, StairDraw, fly_staircase
from sitl.lab.validation.wall_flight import FLIGHT, SteadyFlight
from sitl.simulation.avionics import Navigation
from sitl.simulation.tuning import CONTROLLERS
from tests.support.paths import DATA

CRAFT = Craft(airframe=str(DATA / "darko-quick-servos.toml"), navigation=Navigation.MOCAP)
WINDS, HOLD, SHORT = [row.flown.wind for row in FLIGHT[1:]], 18.0, 8.0  # the verdict is on the whole flight


@pytest.fixture(scope="module")
def flown():
    holds = {"hybrid": SHORT, "report": SHORT, "indi": SHORT, "robust-pi": HOLD}
    return [fly_staircase(StairDraw(controller, 1), WINDS, holds[controller], CRAFT) for controller in CONTROLLERS]


@pytest.mark.parametrize("study", [study_options.staircase, study_options.claims])
def test_any_controller_may_be_named_also_the_one_that_only_hovers(study):
    options = argparse.ArgumentParser()
    study(options)
    assert [options.parse_args(["--controller", name]).controller for name in CONTROLLERS] == list(CONTROLLERS)


@pytest.mark.long
def test_the_law_that_flew_errs_as_the_flight_did(flown):
    by_law = {flight.controller: flight for flight in flown}
    law = by_law["robust-pi"]
    assert law.laws[-1] == "robust PI"
    assert staircase.is_of_the_flights_size(law.deviation)
    assert law.farthest < 0.3
    assert law.busy < 80.0


def test_facing_the_wind_it_leans_as_the_flight_did(flown):
    (law,) = [flight for flight in flown if flight.controller == "robust-pi"]
    for ours, theirs in zip(law.steps, [row.flown for row in FLIGHT[1:]], strict=True):
        assert ours.pitch == pytest.approx(theirs.pitch, abs=3.0), ours.wind
        assert ours.elevon == pytest.approx(theirs.elevon, abs=3.0), ours.wind
        if theirs.thrust == theirs.thrust:
            assert ours.thrust == pytest.approx(theirs.thrust, rel=0.04), ours.wind


def test_every_controller_holds_the_place_through_all_of_it(flown):
    assert [flight.fault for flight in flown] == [""] * len(CONTROLLERS)
    assert max(flight.farthest for flight in flown) < 0.4


@pytest.mark.long
def test_paparazzis_constants_hold_the_place_as_the_flight_did_with_the_span_into_the_wind():
    flight = fly_staircase(StairDraw("paparazzi-indi", 1), WINDS, HOLD, CRAFT)
    assert flight.fault == ""
    assert flight.farthest < 0.2
    assert np.linalg.norm(flight.deviation) < np.linalg.norm(FLOWN_DEVIATION)
    assert flight.busy < 30.0
    assert flight.steps[0].pitch == pytest.approx(FLIGHT[1].flown.pitch, abs=3.0)
    assert flight.steps[-1].pitch > 80.0  # the flight's was 57 deg, with the belly to it


def test_the_schedule_holds_each_wind_after_its_rise():
    assert staircase.schedule_of((1.0, 2.0, 3.0), 8.0) == (
        (0.0, 1.0), (18.0, 1.0), (20.0, 2.0), (28.0, 2.0), (30.0, 3.0),
    )  # fmt: skip


def made(controller, deviation, fault=""):
    return FlownStaircase(controller, 1, (SteadyFlight(2.57, 80.0, 1.0, 2.9),), deviation, 0.2, 30.0, ("law",), fault)


def test_the_verdict_asks_for_the_flights_size_of_the_law_that_flew_and_no_more_of_ours():
    like = made("robust-pi", FLOWN_DEVIATION)
    assert staircase.faults([like, made("hybrid", (0.02, 0.02, 0.02))]) == []
    assert staircase.faults([made("robust-pi", (0.048, 0.07, 0.028))]) == ["robust-pi does not err as the flight did"]
    assert staircase.faults([like, made("indi", (0.07, 0.0, 0.0))]) == ["indi errs more than robust-pi"]
    assert staircase.faults([like, made("paparazzi-indi", (0.07, 0.0, 0.0))]) == []
    assert staircase.faults([made("indi", (0.07, 0.0, 0.0))]) == ["indi errs more than the flight"]
    assert staircase.faults([made("indi", (0.01, 0.0, 0.0), "crashed")]) == ["indi, seed 1: crashed"]


def test_the_table_has_the_flight_and_each_controller():
    lines = staircase.summary([made("robust-pi", FLOWN_DEVIATION)])
    assert lines[2].split() == ["2.57", "82.2", "2.969", "0.7", "80.0", "2.900", "1.0"]
    assert lines[-1].split(";")[0].split() == ["robust-pi", "0.048", "0.034", "0.028"]
