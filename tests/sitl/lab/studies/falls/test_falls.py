"""Falls: what is drawn, what they cost beside the law alone, and that they end at home."""

import numpy as np
import pytest

from sitl import Law, SitlError, Vector, load_airframe
from sitl.lab.studies import falls
from sitl.lab.studies.falls import (
    FALL_HEIGHT,
    MAX_TUMBLE,
    SAME_HEIGHT,
    SINKS,
    AircraftFall,
    FallEnd,
    HeightLost,
    MapCell,
    drawn_velocity,
    fall,
    falling,
    thrown,
)
from sitl.lab.studies.seeded_flights import Craft
from sitl.model.quaternions import x_axis
from sitl.simulation.avionics import Navigation

NOMINAL = load_airframe("nominal").parameters
DOWN = (0.0, 0.0, -15.0)


def test_attitudes_are_drawn_from_all_of_them_and_tumbles_up_to_the_limit():
    draws = [thrown(np.random.default_rng(seed)) for seed in range(400)]
    noses = np.array([x_axis(draw.attitude) for draw in draws])
    rates = np.array([np.linalg.norm(draw.rates) for draw in draws])
    assert np.abs(noses.mean(axis=0)).max() < 0.1
    assert noses[:, 2].std() == pytest.approx(1.0 / np.sqrt(3.0), rel=0.1)
    assert 0.95 * MAX_TUMBLE < rates.max() <= MAX_TUMBLE
    assert np.linalg.norm(thrown(np.random.default_rng(3), 2.5).rates) == pytest.approx(2.5)


@pytest.fixture(scope="module")
def sixteen():
    """Sixteen falls at 15 m/s, under the supervisor and under the law alone."""
    flights = [falling(NOMINAL, seed, DOWN) for seed in range(16)]
    supervisor, away = fall(flights)
    alone, _ = fall([falling(NOMINAL, seed, DOWN, tuning=falls.ALONE) for seed in range(16)])
    return flights, HeightLost("15 m/s down", supervisor, alone, away)


def test_the_supervisor_catches_a_fall_without_losing_more_height_than_the_law_alone(sixteen):
    flights, lost = sixteen
    assert all("catch_fall" in [jump.name for jump in flight.jumps] for flight in flights)
    assert lost.worse == 0
    assert np.median(lost.supervisor) < 40.0


def test_every_fall_ends_at_home_under_the_linear_law(sixteen):
    flights, lost = sixteen
    assert lost.not_home == 0
    assert {flight.law for flight in flights} == {Law.HOVER_LINEAR}


@pytest.mark.parametrize("law", [law for law in Law if law not in {Law.LANDED, Law.CRASHED, Law.HOVER_ZERO_MOMENT}])
def test_a_dive_is_no_equilibrium_whatever_law_it_begins_under(law):
    """Nose down at 40 m/s, where a law that follows the air stream would stay."""
    flight = falling(NOMINAL, 1, (0.0, 0.0, -40.0), tumble=0.0, law=law)
    body = flight.truth.body
    flight.place(body._replace(attitude=type(body.attitude)(0.5**0.5, 0.0, 0.5**0.5, 0.0)))
    flight.step(12.0)
    assert flight.truth.body.position.z > FALL_HEIGHT - 250.0
    assert abs(flight.truth.body.velocity.z) < 5.0


def test_the_counts_are_of_what_is_beyond_the_limits():
    none = np.zeros(3)
    assert HeightLost("", np.array([1.0, 2.0, 3.0]), none, none).worse == 2 + (SAME_HEIGHT < 1.0)
    assert HeightLost("", none, none, np.array([0.5, 1.5, np.nan])).not_home == 2


def test_tables_have_a_line_for_each_kind_and_sink_rate():
    lost = HeightLost("18 m/s level", np.array([1.0, 3.0]), np.array([2.0, 2.0]), np.zeros(2))
    assert falls.summary([lost])[1].split() == [
        "18",
        "m/s",
        "level",
        "2.0",
        "2.9",
        "3.0",
        "2.0",
        "2.0",
        "2.0",
        "0",
        "0",
    ]
    cells = [MapCell(s, t, np.array([s, t])) for s in falls.MAP_SINKS for t in falls.MAP_TUMBLES]
    assert len(falls.map_lines(cells)) == 1 + len(falls.MAP_SINKS)


def test_velocities_are_of_the_three_kinds():
    drawn = [drawn_velocity(np.random.default_rng(seed)) for seed in range(200)]
    sinks = [-v.z for v in drawn if v.x == v.y == 0.0]
    assert all(SINKS[0] <= sink <= SINKS[1] for sink in sinks)
    assert 120 < len(sinks) < 180
    assert {round(float(np.hypot(v.x, v.y)), 6) for v in drawn} == {0.0, 12.0, 18.0}


@pytest.mark.parametrize("windy", [False, True])
def test_the_whole_vehicle_comes_home_and_one_seed_is_one_fall(windy):
    flown = falls.fly(2, Craft("nominal", Navigation.TRUTH), windy=windy)
    assert flown.end is FallEnd.HOME
    assert flown == falls.run(1, 2, Craft("nominal", Navigation.TRUTH), windy=windy)[0]


def test_the_summary_names_what_did_not_come_home():
    rows = [
        AircraftFall(seed, Vector(0.0, 0.0, -9.0), end, 20.0, 9.0, 0.1, ("catch_fall",))
        for seed, end in enumerate((FallEnd.HOME, FallEnd.CRASHED, FallEnd.LATE))
    ]
    text = "\n".join(falls.aircraft_summary(rows))
    assert "1 crashed, 1 home" in text
    assert "crashed: seed 1: thrown at (0.0, 0.0, -9.0) m/s, 20 m lost" in text
    assert "late: seed 2" in text


@pytest.mark.parametrize(("flights", "first"), [(0, 1), (3, -1)])
def test_a_study_of_nothing_is_refused(flights, first):
    with pytest.raises(SitlError):
        falls.heights(NOMINAL, flights, first)
