"""Hover or fly in flight: predictions against flown legs, the break-even distance, a mission that mixes both."""

import json
import math
from dataclasses import replace

import pytest

from protocol.dialect.vocabulary import DecisionReason, LegMode
from protocol.plans import plan_files as files
from sitl.__main__ import main
from sitl.defaults import AIRFRAME
from sitl.errors import SitlError
from sitl.lab.studies.break_even import (
    MIN_DISTANCE,
    FlownLeg,
    abilities,
    draw,
    flown,
    fly_all,
    fly_leg,
    fly_mission,
    predicted,
    prediction_error,
    save_plot,
    why_not_forward,
)
from sitl.prediction.corners import Leg
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import predict_forward, predict_hover
from tests.support.flights.tunings import BY_REPORT
from tests.support.paths import DATA

MIXED = DATA / "mixed.plan"
HALF = 6  # items of it: the take-off, the first zigzag and the first long leg
SHORT, LONG = 20.0, 100.0  # [m]


@pytest.fixture(scope="module")
def able():
    return abilities()


@pytest.fixture(scope="module")
def missions():
    items = files.load(MIXED).items
    there = items[HALF - 1]
    items = (*items[:HALF], replace(items[-1], x=there.x, y=there.y))
    return {leg_mode: fly_mission(items, leg_mode, min_leg=MIN_DISTANCE) for leg_mode in LegMode}


# One leg


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("leg", "leg_mode", "limit"),
    [
        (Leg(20.0, 0.0), LegMode.HOVER, 0.04),
        (Leg(60.0, 12.0, turn=1.6), LegMode.HOVER, 0.07),
        (Leg(30.0, 0.0, tail_wind=-2.5), LegMode.HOVER, 0.14),
        (Leg(20.0, 0.0), LegMode.FORWARD, 0.27),
        (Leg(100.0, 0.0), LegMode.FORWARD, 0.12),
        (Leg(80.0, 20.0, turn=1.6), LegMode.FORWARD, 0.08),
        (Leg(150.0, -25.0), LegMode.FORWARD, 0.17),
        (Leg(120.0, 0.0, tail_wind=2.0), LegMode.FORWARD, 0.10),
    ],
)
def test_a_leg_takes_the_time_and_energy_the_vehicle_predicted(leg, leg_mode, limit):
    flight = fly_leg(leg, leg_mode)
    assert flight.flew_forward == (leg_mode is LegMode.FORWARD)
    assert flight.predicted.time == pytest.approx(flight.time, rel=limit)
    assert flight.predicted.energy == pytest.approx(flight.energy, rel=limit)


@pytest.mark.long
def test_most_legs_in_calm_are_predicted_within_a_tenth(able):
    calm = [(leg._replace(tail_wind=0.0, cross_wind=0.0), speed) for leg, speed in draw(8, able, 3, forward=True)]
    error = prediction_error(fly_all(calm, LegMode.FORWARD))
    assert (error.legs, error.lost) == (8, 0)
    assert error.time.median < 0.05
    assert error.energy.median < 0.12
    assert error.energy.p90 < 0.27  # short legs, whose end takes up to 2 s longer than predicted


# The break-even distance


def test_after_a_quarter_turn_too_the_shortest_leg_costs_less_forward(able):
    """In calm and level: INDI turns while it goes."""
    expected = predicted(able, 0.0, turn=0.5 * math.pi)
    assert expected.barred is DecisionReason.TOO_SHORT
    hover, forward = (
        fly_leg(Leg(expected.distance, 0.0, turn=0.5 * math.pi), mode) for mode in (LegMode.HOVER, LegMode.FORWARD)
    )
    assert forward.flew_forward
    assert forward.energy < hover.energy


def test_the_report_s_laws_break_even_farther_away_after_a_quarter_turn(able):
    """In calm and level: about 27 m."""
    expected = predicted(able._replace(tuning=BY_REPORT), 0.0, turn=0.5 * math.pi)
    assert expected.barred is DecisionReason.NONE
    assert expected.distance == pytest.approx(27.0, abs=4.0)


@pytest.mark.long
def test_straight_ahead_in_calm_forward_flight_soon_costs_less(able):
    expected, found = predicted(able, 0.0), flown(able, AIRFRAME, 0.0)
    assert expected.distance == pytest.approx(MIN_DISTANCE)
    assert expected.barred is DecisionReason.TOO_SHORT
    assert found.distance < 20.0  # the end of so short a leg takes the vehicle 2 s longer than it predicts


# A mission


@pytest.mark.long
def test_the_vehicle_chooses_what_costs_less_and_flies_long_legs_forward(missions):
    decisions = [decision for _, decision in missions[LegMode.NONE].decisions]
    short = [d for d in decisions if d.leg.distance < SHORT]
    long = [d for d in decisions if d.leg.distance > LONG]
    assert (len(short), len(long)) == (4, 1)
    for d in short:
        assert d.reason is DecisionReason.ENERGY
        assert d.leg_mode is (LegMode.HOVER if d.hover.energy < d.forward.energy else LegMode.FORWARD)
    assert all((d.leg_mode, d.reason) == (LegMode.FORWARD, DecisionReason.ENERGY) for d in long)


@pytest.mark.long
def test_the_way_that_is_chosen_takes_no_more_energy_than_either_alone(missions):
    assert all(mission.complete for mission in missions.values())
    chosen, hovered, forward = (missions[mode].energy for mode in (LegMode.NONE, LegMode.HOVER, LegMode.FORWARD))
    assert chosen <= forward
    assert chosen < 0.65 * hovered
    for mission in missions.values():
        assert sum(mission.energy_by_law.values()) == pytest.approx(mission.energy)


@pytest.mark.long
def test_a_mission_asked_for_one_way_flies_that_way_alone(missions):
    for leg_mode in (LegMode.HOVER, LegMode.FORWARD):
        assert {d.leg_mode for _, d in missions[leg_mode].decisions} == {leg_mode}


# The predicted break-even distance and the statistics of the prediction's errors.


def test_legs_drawn_for_forward_flight_may_all_be_flown_forward(able):
    drawn = draw(50, able, forward=True)
    assert all(why_not_forward(leg, able) is DecisionReason.NONE for leg, _ in drawn)
    assert drawn == draw(50, able, forward=True)
    assert any(why_not_forward(leg, able) is not DecisionReason.NONE for leg, _ in draw(50, able, forward=False))


def test_errors_are_relative_to_the_flight_and_lost_legs_are_only_counted():
    arrived = FlownLeg(
        leg=Leg(10.0, 0.0), leg_mode=LegMode.HOVER, time=10.0, energy=1000.0, predicted=Prediction(11.0, 800.0),
        flew_forward=False, sunk=0.0, risen=0.0,
    )  # fmt: skip
    lost = arrived._replace(time=math.inf, energy=math.inf)
    error = prediction_error([arrived, lost])
    assert (error.legs, error.lost) == (1, 1)
    assert error.time == pytest.approx((0.1, 0.1, 0.1))
    assert error.energy == pytest.approx((0.2, 0.2, -0.2))
    with pytest.raises(SitlError, match="no leg arrived"):
        prediction_error([lost])


def test_at_the_break_even_distance_both_ways_cost_the_same_energy(able):
    able = able._replace(tuning=BY_REPORT)
    cell = predicted(able, 10.0, 3.0, 1.0, 2.0)
    leg = Leg(cell.distance, 10.0, 3.0, 1.0, 2.0)
    assert predict_hover(leg, able).energy == pytest.approx(predict_forward(leg, able).energy, rel=0.02)


def test_a_steep_leg_is_barred_until_it_is_long_enough(able):
    down, up = predicted(able, -30.0), predicted(able, 30.0)
    assert (down.barred, up.barred) == (DecisionReason.TOO_STEEP, DecisionReason.TOO_STEEP)
    assert down.distance == pytest.approx(30.0 / 0.35, rel=0.01)
    assert up.distance == pytest.approx(30.0, rel=0.01)


def test_a_leg_into_the_ground_is_refused():
    with pytest.raises(SitlError, match="ground"):
        fly_leg(Leg(100.0, -60.0), LegMode.HOVER)


def test_a_plot_into_a_missing_folder_is_an_error(able, tmp_path):
    with pytest.raises(SitlError, match="nothere"):
        save_plot(able, [], [], tmp_path / "nothere" / "x.png")


# ``darko-sitl study breakeven``: JSON output and refused arguments.


@pytest.mark.long
def test_the_command_prints_the_table_as_json(capsys):
    assert main(["study", "breakeven", "--json", "--airspeed", "12"]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert len(printed["predicted"]) == 90
    assert {cell["barred"] for cell in printed["predicted"]} <= {"NONE", "TOO_SHORT", "TOO_STEEP", "ENERGY"}


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["--airframe", "published"], "published"),
        (["--airframe", "nowhere"], "nowhere"),
        (["--airspeed", "30"], "30"),
    ],
)
def test_a_bad_argument_is_a_one_line_error(capsys, arguments, word):
    assert main(["study", "breakeven", *arguments]) == 2
    error = capsys.readouterr().err
    assert word in error
    assert error.count("\n") == 1
