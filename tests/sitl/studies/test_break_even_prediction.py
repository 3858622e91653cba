"""The break-even distance as predicted, the figures of the prediction's error, and the command that tells them."""

import json
import math

import pytest

from protocol.dialect.vocabulary import DecisionReason, Way
from sitl.__main__ import main
from sitl.errors import SitlError
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Leg, predict_forward, predict_hover
from sitl.studies.break_even import predicted
from sitl.studies.break_even_flights import Flown, abilities, barred, draw, error, fly_leg
from sitl.studies.break_even_plot import save_plot


@pytest.fixture(scope="module")
def able():
    return abilities()


def test_the_drawn_legs_may_all_be_flown_on_the_wing(able):
    drawn = draw(50, able, forward=True)
    assert all(barred(leg, able) is DecisionReason.NONE for leg, _ in drawn)
    assert drawn == draw(50, able, forward=True)
    assert any(barred(leg, able) is not DecisionReason.NONE for leg, _ in draw(50, able, forward=False))


def test_errors_are_relative_to_what_was_flown_and_lost_legs_are_counted_apart():
    one = Flown(Leg(10.0, 0.0), Way.HOVER, 10.0, 1000.0, Prediction(11.0, 800.0), False, 0.0, 0.0)
    lost = one._replace(time=math.inf, energy=math.inf)
    made = error([one, lost])
    assert (made.legs, made.lost) == (1, 1)
    assert made.time == pytest.approx((0.1, 0.1, 0.1))
    assert made.energy == pytest.approx((0.2, 0.2, -0.2))
    with pytest.raises(SitlError, match="none"):
        error([lost])


def test_at_the_break_even_distance_both_ways_take_the_same(able):
    cell = predicted(able, 10.0, 3.0, 1.0, 2.0)
    leg = Leg(cell.distance, 10.0, 3.0, 1.0, 2.0)
    assert predict_hover(leg, able).energy == pytest.approx(predict_forward(leg, able).energy, rel=0.02)


def test_a_steep_leg_is_barred_until_it_is_long_enough(able):
    down, up = predicted(able, -30.0), predicted(able, 30.0)
    assert (down.barred, up.barred) == (DecisionReason.TOO_STEEP, DecisionReason.TOO_STEEP)
    assert down.distance == pytest.approx(30.0 / 0.35, rel=0.01)
    assert up.distance == pytest.approx(30.0, rel=0.01)


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
