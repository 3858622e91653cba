"""Hover or fly in flight: the prediction against flown legs, the break-even distance, a mission that mixes both."""

import json
import math
from pathlib import Path

import pytest

from protocol.plans import files
from sitl.__main__ import main
from sitl.autopilot.decision import Leg, Prediction, Way, Why, predict_forward, predict_hover
from sitl.errors import SitlError
from sitl.studies.break_even import (
    SHORTEST,
    Flown,
    abilities,
    barred,
    draw,
    error,
    flown,
    fly_all,
    fly_leg,
    fly_mission,
    predicted,
)
from sitl.studies.break_even_plot import save_plot

MIXED = Path(__file__).parent.parent / "data" / "mixed.plan"
SHORT, LONG = 20.0, 100.0  # [m]


@pytest.fixture(scope="module")
def able():
    return abilities()


@pytest.fixture(scope="module")
def journeys():
    items = files.load(MIXED).items
    return {way: fly_mission(items, way, least_leg=SHORTEST) for way in Way}


# One leg


@pytest.mark.parametrize(
    ("leg", "way", "limit"),
    [
        (Leg(20.0, 0.0), Way.HOVER, 0.03),
        (Leg(60.0, 12.0, turn=1.6), Way.HOVER, 0.03),
        (Leg(30.0, 0.0, tail_wind=-2.5), Way.HOVER, 0.05),
        (Leg(20.0, 0.0), Way.FORWARD, 0.12),
        (Leg(100.0, 0.0), Way.FORWARD, 0.08),
        (Leg(80.0, 20.0, turn=1.6), Way.FORWARD, 0.08),
        (Leg(150.0, -25.0), Way.FORWARD, 0.10),
        (Leg(120.0, 0.0, tail_wind=2.0), Way.FORWARD, 0.10),
    ],
)
def test_a_leg_takes_the_time_and_energy_the_vehicle_predicted(leg, way, limit):
    flight = fly_leg(leg, way)
    assert flight.tipped == (way is Way.FORWARD)
    assert flight.predicted.time == pytest.approx(flight.time, rel=limit)
    assert flight.predicted.energy == pytest.approx(flight.energy, rel=limit)


def test_legs_of_all_kinds_in_calm_are_predicted_within_a_tenth(able):
    calm = [(leg._replace(tail_wind=0.0, cross_wind=0.0), speed) for leg, speed in draw(8, able, 3, forward=True)]
    made = error(fly_all(calm, Way.FORWARD))
    assert (made.legs, made.lost) == (8, 0)
    assert made.time[0] < 0.05
    assert made.energy[0] < 0.06
    assert made.energy[1] < 0.15


def test_the_drawn_legs_may_all_be_flown_on_the_wing(able):
    drawn = draw(50, able, forward=True)
    assert all(barred(leg, able) is Why.NONE for leg, _ in drawn)
    assert drawn == draw(50, able, forward=True)
    assert any(barred(leg, able) is not Why.NONE for leg, _ in draw(50, able, forward=False))


def test_errors_are_relative_to_what_was_flown_and_lost_legs_are_counted_apart():
    one = Flown(Leg(10.0, 0.0), Way.HOVER, 10.0, 1000.0, Prediction(11.0, 800.0), False, 0.0, 0.0)
    lost = one._replace(time=math.inf, energy=math.inf)
    made = error([one, lost])
    assert (made.legs, made.lost) == (1, 1)
    assert made.time == pytest.approx((0.1, 0.1, 0.1))
    assert made.energy == pytest.approx((0.2, 0.2, -0.2))
    with pytest.raises(SitlError, match="none"):
        error([lost])


# The break-even distance


def test_turned_away_the_wing_breaks_even_where_it_is_predicted_to(able):
    """In calm, level, after a quarter turn: some 30 m; flown a tenth shorter than predicted."""
    expected = predicted(able, 0.0, turn=0.5 * math.pi)
    assert expected.barred is Why.NONE
    assert expected.distance == pytest.approx(33.0, abs=3.0)
    hover, wing = (
        [fly_leg(Leg(d, 0.0, turn=0.5 * math.pi), way).energy for d in (0.8 * expected.distance, expected.distance)]
        for way in (Way.HOVER, Way.FORWARD)
    )
    assert hover[0] < wing[0]
    assert hover[1] > wing[1]


def test_straight_ahead_in_calm_the_wing_wins_wherever_it_is_flown(able):
    expected, found = predicted(able, 0.0), flown(able, "nominal", 0.0)
    assert expected.distance == found.distance == pytest.approx(SHORTEST)
    assert expected.barred is found.barred is Why.TOO_SHORT


def test_at_the_break_even_distance_both_ways_take_the_same(able):
    cell = predicted(able, 10.0, 3.0, 1.0, 2.0)
    leg = Leg(cell.distance, 10.0, 3.0, 1.0, 2.0)
    assert predict_hover(leg, able).energy == pytest.approx(predict_forward(leg, able).energy, rel=0.02)


def test_a_steep_leg_is_barred_until_it_is_long_enough(able):
    down, up = predicted(able, -30.0), predicted(able, 30.0)
    assert (down.barred, up.barred) == (Why.TOO_STEEP, Why.TOO_STEEP)
    assert down.distance == pytest.approx(30.0 / 0.35, rel=0.01)
    assert up.distance == pytest.approx(30.0, rel=0.01)


# A mission


def test_the_vehicle_hovers_the_short_legs_and_flies_the_long_ones_by_its_own_choice(journeys):
    made = [decision for _, decision in journeys[Way.NONE].decisions]
    short = [d for d in made if d.leg.distance < SHORT]
    long = [d for d in made if d.leg.distance > LONG]
    assert (len(short), len(long)) == (8, 2)
    assert all((d.way, d.why) == (Way.HOVER, Why.ENERGY) for d in short)
    assert all((d.way, d.why) == (Way.FORWARD, Why.ENERGY) for d in long)


def test_mixing_both_ways_takes_less_energy_than_either(journeys):
    assert all(journey.complete for journey in journeys.values())
    mixed, hovered, flown_ = (journeys[way].energy for way in (Way.NONE, Way.HOVER, Way.FORWARD))
    assert mixed < 0.95 * flown_
    assert mixed < 0.65 * hovered
    for journey in journeys.values():
        assert sum(journey.energy_by_law.values()) == pytest.approx(journey.energy)


def test_the_pure_ways_are_pure(journeys):
    for way in (Way.HOVER, Way.FORWARD):
        assert {d.way for _, d in journeys[way].decisions} == {way}


# The command


def test_the_command_tells_the_table_as_json(capsys):
    assert main(["breakeven", "--json", "--airspeed", "12"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert len(told["predicted"]) == 90
    assert {cell["barred"] for cell in told["predicted"]} <= {"NONE", "TOO_SHORT", "TOO_STEEP", "ENERGY"}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--airframe", "published"], "published"),
        (["--airframe", "nowhere"], "nowhere"),
        (["--airspeed", "30"], "30"),
        (["--airspeed", "nan"], "nan"),
    ],
)
def test_a_bad_argument_is_one_line(capsys, arguments, word):
    assert main(["breakeven", *arguments]) == 2
    said = capsys.readouterr().err
    assert word in said
    assert said.count("\n") == 1


def test_a_leg_into_the_ground_is_refused():
    with pytest.raises(SitlError, match="ground"):
        fly_leg(Leg(100.0, -60.0), Way.HOVER)


def test_a_plot_that_cannot_be_written_is_said(able, tmp_path):
    with pytest.raises(SitlError, match="nothere"):
        save_plot(able, [], [], tmp_path / "nothere" / "x.png")
