"""The controller of three laws: INDI everywhere, the proved law in the calm hover, the zero-moment law in a fall."""

import pytest

from protocol.dialect.vocabulary import Law
from sitl import Simulation, Start, along, hover_at, leg, load_airframe
from sitl.lab.campaigns.specification import load_specification
from sitl.lab.studies.seeded_flights import Craft
from sitl.simulation.tuning import Tuning
from tests.support.campaigns import shipped
from tests.support.flights.falls import fall, falling

HYBRID = Craft()


def vehicle():
    made = Simulation(load_airframe("collage").parameters, start=Start(up=30.0, airborne=True), tuning=Tuning())
    made.begin_flight(Law.INDI)
    return made


def test_in_calm_it_hovers_by_the_proved_law_and_goes_elsewhere_by_indi():
    flown = vehicle()
    flown.reference = hover_at((0.0, 0.0, 30.0), 0.0)
    flown.step(5.0)
    assert flown.law is Law.HOVER_LINEAR
    flown.reference = along(flown.reference, leg((0.0, 0.0, 30.0), (120.0, 0.0, 30.0), 15.0), 0.0)
    flown.step(5.0)
    assert flown.law is Law.INDI
    assert flown.truth.body.velocity.x > 5.0


@pytest.mark.long
@pytest.mark.parametrize("velocity", [(0.0, 0.0, -5.0), (0.0, 0.0, -12.0), (12.0, 0.0, -8.0)])
def test_a_fall_is_caught_by_the_zero_moment_law_as_high_as_by_it_alone(velocity):
    tuning, airframe = Tuning(), load_airframe("collage").parameters
    thrown = [falling(airframe, seed, velocity, tuning=tuning) for seed in (1, 2, 3, 4)]
    lost, away = fall(thrown)
    alone, _ = fall([falling(airframe, seed, velocity) for seed in (1, 2, 3, 4)])
    assert {"catch_fall", "recover_indi"} <= {jump.name for flight in thrown for jump in flight.jumps}
    assert (away < 1.0).all()
    assert lost.max() <= alone.max() + 1.0


@pytest.mark.long
@pytest.mark.parametrize("side", ["head", "tail", "cross"])
@pytest.mark.parametrize(("airframe", "beyond"), [("collage", 3.0), ("darko", 10.0)])
def test_a_leg_in_a_strong_gusty_wind_with_a_wrong_model_ends_where_it_should(side, airframe, beyond):
    vary = load_specification("legs").vary
    azimuth = vary["azimuth"].values[vary["side"].values.index(side)]
    place = {"vary.wind.grid": [10.0], "vary.side.grid": [side], "vary.azimuth.grid": [azimuth]}
    flown = shipped("legs", place, seed=2, craft=HYBRID._replace(airframe=airframe)).measures
    assert flown["done"]
    assert flown["error"] < 1.5
    assert flown["beyond"] <= beyond
    assert flown["above"] <= 10.0
