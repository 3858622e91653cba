"""Measures: expressions of a recording, by hand and by numpy."""

import numpy as np
import pytest

from sitl import Recording, load_airframe
from sitl.lab.campaigns.measures import FlightSetting, Measure, check_measures, measured
from sitl.lab.campaigns.number_expressions import ExpressionError, NumberWalker
from sitl.model.ground import LEVEL_GROUND

SETTING = FlightSetting(LEVEL_GROUND, load_airframe("nominal").parameters)
TIME = np.arange(6) * 0.5
UP = np.array([10.0, 12.0, 11.0, 7.0, 8.0, 9.0])
NORTH = np.array([0.0, 1.0, 2.0, 3.0, 4.0, 5.0])


def recording():
    position = np.stack((NORTH, -NORTH, UP), axis=1)
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (6, 1))
    law = np.array([1, 1, 2, 2, 2, 1])
    none = np.zeros((6, 3))
    return Recording(
        TIME, position, none, attitude, none, np.ones((6, 4)), law, UP, UP, none, np.zeros((6, 5)), none, ()
    )


def value(text, series=None, **numbers):
    return measured({"m": Measure(text)}, series or {}, numbers, recording(), SETTING)[0]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("max(-DARKO_TRUTH.position[2])", 12.0),
        ("min(-DARKO_TRUTH.position[2], after=1)", 7.0),
        ("min(-DARKO_TRUTH.position[2], after=1.5)", 8.0),
        ("max(abs(DARKO_TRUTH.position[2] + 10))", 3.0),
        ("final(DARKO_TRUTH.position[0]) - first(DARKO_TRUTH.position[0])", 5.0),
        ("final(DARKO_TRUTH.position[1])", 5.0),
        ("at(DARKO_TRUTH.position[0], 1.2)", 2.0),
        ("mean(DARKO_TRUTH.position[0])", 2.5),
        ("rms(DARKO_TRUTH.position[0] - 2.5)", np.sqrt(35.0 / 12.0)),
        ("quantile(-DARKO_TRUTH.position[2], 0.5)", 9.5),
        ("share(-DARKO_TRUTH.position[2] >= 10)", 0.5),
        ("share(-DARKO_TRUTH.position[2] >= 10 and DARKO_TRUTH.position[0] > 0)", 1.0 / 3.0),
        ("max(DARKO_TRUTH.position[0], where=DARKO_HYBRID_STATE.law == 2)", 4.0),
        ("max(DARKO_TRUTH.position[0], after=0.5, where=not DARKO_HYBRID_STATE.law == 2)", 5.0),
        ("max(0, final(DARKO_TRUTH.position[0]) - 9)", 0.0),
        ("max(max(DARKO_TRUTH.position[0], DARKO_TRUTH.position[1] + 1))", 6.0),
        ("max(DARKO_ACTUATORS.elevon[1]) + max(DARKO_ENERGY.energy)", 13.0),
        ("final(DARKO_TRUTH.position[0]) > 4 and limit < 2", 1.0),
        ("max(DARKO_TRUTH.position[0] * limit)", 5.0),
    ],
)
def test_measures_by_hand(text, expected):
    assert value(text, limit=1.0) == pytest.approx(expected, rel=1e-12)


def test_distances_are_from_the_nearest_stretch_of_a_way():
    """The last sample is 5 m north and east, and 9 m up."""
    assert value("max(from_level_way(0, 0, 5, 0))") == pytest.approx(5.0)
    assert value("max(from_way(0, 0, 10, 2, -2, 10))") == pytest.approx(np.sqrt(19.0))
    assert value("first(from_way(far, 4, 10))", far=3.0) == 5.0


def test_words_are_compared_and_the_time_is_a_series():
    assert value("pick(goal == 'land', 1, 2)", goal="land") == 2.0
    assert value("first(t, where=DARKO_TRUTH.position[0] > 2)") == 1.5
    assert value("7 % 4 + remainder(7, 4)") == 2.0


def test_the_ground_is_touched_where_a_foot_is_in_it():
    """A foot is as far below the centre of mass as the airframe says."""
    low = SETTING.airframe.foot_x
    at, measures = (
        recording(),
        {"m": Measure("first(t, where=GROUND.touching > 0)"), "h": Measure("max(GROUND.height)")},
    )
    at.attitude[:] = (np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0)
    at.position[:, 2] = [3.0, low + 0.01, low - 0.01, low - 0.01, 0.5, 0.5]
    assert measured(measures, {}, {}, at, SETTING) == [1.0, 3.0]


def test_nothing_within_the_time_is_no_value():
    assert np.isnan(value("max(DARKO_TRUTH.position[0], after=99)"))


def test_measures_and_series_stand_on_those_before_them():
    measures = {"high": Measure("max(up)"), "margin": Measure("high - max(twice) / 2")}
    series = {"up": "-DARKO_TRUTH.position[2]", "twice": "2 * up"}
    assert measured(measures, series, {}, recording(), SETTING) == [12.0, 0.0]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("DARKO_TRUTH.position[0]", "m: DARKO_TRUTH.position"),
        ("quantile(DARKO_TRUTH.position[0])", "m: quantile over time takes a series and a number"),
        ("max(DARKO_TRUTH.position[0], before=3)", "m: max over time takes a series, and after= and where="),
        ("share(DARKO_TRUTH.position[0])", "is not a condition of series"),
        ("max(DARKO_TRUTH.position)", "m: DARKO_TRUTH.position"),
        ("max(speed)", "m: "),
        ("1 +", "'1 +' is not an expression"),
        ("pick(-1, 2, 3)", "pick takes a number from 0 on"),
        ("x" * 401, "is longer than 400 characters"),
        ("__import__('os')", "there is no function __import__"),
    ],
)
def test_what_has_no_meaning_is_refused_before_any_flight(text, words):
    with pytest.raises(ExpressionError, match=words.replace("(", r"\(").replace("+", r"\+")):
        check_measures({"m": Measure(text)}, {}, ["limit"], SETTING.airframe)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("2 * pi", 2.0 * np.pi),
        ("pick(x, 5, 6, 7)", 7.0),
        ("not x > 2", 0.0),
        ("-x ** 2", -9.0),
        ("1 / (x - 3)", np.inf),
    ],
)
def test_numbers(text, expected):
    assert NumberWalker({"x": 3.0}).number(text) == expected
