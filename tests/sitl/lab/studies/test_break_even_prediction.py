"""The predicted break-even distance and the statistics of the prediction's errors."""

import math

import pytest

from protocol.dialect.vocabulary import DecisionReason, LegMode
from sitl.errors import SitlError
from sitl.lab.studies.break_even import (
    FlownLeg,
    abilities,
    draw,
    fly_leg,
    predicted,
    prediction_error,
    save_plot,
    why_not_forward,
)
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Leg, predict_forward, predict_hover


@pytest.fixture(scope="module")
def able():
    return abilities()


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
