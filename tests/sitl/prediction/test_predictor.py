"""Time and energy of legs in the hover and in forward flight."""

import math
from itertools import pairwise

import pytest

from sitl.control.governor import ERROR
from sitl.model.airframe_files import load
from sitl.prediction.corners import Leg
from sitl.prediction.predictor import Abilities, alignment, predict_forward, predict_hover
from sitl.simulation.tuning import Tuning
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters
ABLE = Abilities(NOMINAL, BY_REPORT, can_fly_forward=True, hover_speed=3.0, airspeed=15.0)


def test_hovering_along_the_span_is_faster_than_across_it():
    """The wing is a brake when the belly faces the way, and feels nothing along its span."""
    ahead, aside = (predict_hover(Leg(60.0, 0.0, turn=turn), ABLE) for turn in (0.0, 0.5 * math.pi))
    assert aside.time == pytest.approx(60.0 / 3.0, rel=0.15)
    assert ahead.time > 1.1 * aside.time


def test_a_hover_into_the_wind_is_slow_and_takes_less_power():
    calm, against = (predict_hover(Leg(60.0, 0.0, tail_wind=wind), ABLE) for wind in (0.0, -3.0))
    assert against.time > 1.5 * calm.time
    assert against.energy / against.time < 0.92 * calm.energy / calm.time


def test_vertical_legs_are_hovered_at_the_governors_rates():
    up, down = (predict_hover(Leg(0.0, climb), ABLE) for climb in (25.0, -20.0))
    assert up.time == pytest.approx(25.0 / 2.5, rel=0.3)
    assert down.time == pytest.approx(20.0 / 2.0, rel=0.3)


@pytest.mark.parametrize("wind", [-2.0, 0.0, 2.0])
def test_hovering_farther_takes_longer_and_more(wind):
    taken = [predict_hover(Leg(d, 0.0, wind), ABLE) for d in (5.0, 12.0, 30.0, 80.0, 200.0)]
    assert all(a.time < b.time and a.energy < b.energy for a, b in pairwise(taken))


def test_cruising_on_costs_what_the_trim_does():
    near, far = (predict_forward(Leg(d, 0.0), ABLE) for d in (250.0, 400.0))
    assert far.time - near.time == pytest.approx(150.0 / 15.0, rel=0.03)
    assert (far.energy - near.energy) / (far.time - near.time) == pytest.approx(23.4, rel=0.05)  # W, level at 15 m/s


def test_a_leg_flown_through_costs_less_than_one_with_transitions():
    leg = Leg(100.0, 0.0)
    through, begun, ended, whole = (
        predict_forward(leg, ABLE, begin=begin, end=end) for end in (False, True) for begin in (False, True)
    )
    assert through.energy < min(begun.energy, ended.energy)
    assert max(begun.energy, ended.energy) < whole.energy


def test_turning_first_takes_longer():
    times = [predict_forward(Leg(80.0, 0.0, turn=turn), ABLE).time for turn in (0.0, 0.8, 1.6, 3.1)]
    assert times == sorted(times)
    assert times[-1] - times[0] == pytest.approx(5.9, abs=0.2)  # psi' = -sin(psi / 2) to within 12 deg


def test_a_wind_that_cannot_be_flown_against_is_no_way():
    assert math.isinf(predict_forward(Leg(100.0, 0.0, tail_wind=-14.0), ABLE).time)
    assert math.isinf(predict_forward(Leg(100.0, 0.0, cross_wind=15.0), ABLE).energy)


@pytest.mark.parametrize("wind", [0.0, 5.0])
def test_a_leg_without_length_is_over_soon(wind):
    taken = predict_hover(Leg(0.0, 0.0, tail_wind=wind), ABLE)
    assert taken.time < 2.0


def test_the_alignment_is_the_integral_of_its_law():
    """From the turn down to 12 degrees, under psi' = -k sin(psi / 2)."""
    for turn, k in ((0.5, 1.0), (1.6, 2.0), (3.1, 0.7)):
        psi, time, step = turn, 0.0, 1e-4
        while psi > math.radians(12.0):
            psi, time = psi - step * k * math.sin(0.5 * psi), time + step
        assert alignment(turn, k) == pytest.approx(time, abs=2e-3)
        assert alignment(math.tau - turn, k) == pytest.approx(alignment(turn, k), rel=1e-9)
    assert alignment(0.2, 1.0) == 0.0
    assert alignment(1.0, 0.0) == math.inf


# The tuning

AHEAD, AGAINST, TURNED = Leg(40.0, 0.0), Leg(30.0, 0.0, tail_wind=-2.5), Leg(40.0, 0.0, turn=1.6)


@pytest.mark.parametrize(
    ("leg", "tuning", "time"),
    [
        (AHEAD, BY_REPORT, 16.7),
        (AHEAD, BY_REPORT._replace(governor=ERROR), 42.3),
        (AHEAD, BY_REPORT._replace(v_enter=250.0, v_leave=300.0), 15.8),
        (AGAINST, BY_REPORT, 17.9),
        (AGAINST, BY_REPORT._replace(v_enter=5.0), 19.0),
        (AGAINST, BY_REPORT._replace(kpp=2.5, kpd=2.5), 16.9),
        (AGAINST, BY_REPORT._replace(kpd=0.8), 20.9),
        (AGAINST, BY_REPORT._replace(k_delta=2.0), 20.8),
    ],
)
def test_changed_gains_change_the_prediction_of_a_hover_as_they_change_the_flight(leg, tuning, time):
    """Times as flown."""
    assert predict_hover(leg, ABLE._replace(tuning=tuning)).time == pytest.approx(time, rel=0.05)


@pytest.mark.parametrize(("tuning", "time"), [(BY_REPORT, 12.9), (BY_REPORT._replace(k_q=2.0), 10.8)])
def test_the_heading_gain_counts_where_the_vehicle_turns_first(tuning, time):
    able = ABLE._replace(tuning=tuning)
    assert predict_forward(TURNED, able).time == pytest.approx(time, rel=0.08)  # as flown
    assert predict_forward(AHEAD, able).time == predict_forward(AHEAD, ABLE).time


def test_a_heading_gain_of_zero_never_turns():
    never = ABLE._replace(tuning=BY_REPORT._replace(k_q=0.0))
    assert math.isinf(predict_forward(TURNED, never).time)
    assert math.isfinite(predict_forward(AHEAD, never).time)


@pytest.mark.parametrize("tuning", [BY_REPORT._replace(integral=0), BY_REPORT._replace(design=1)])
def test_without_an_integral_legs_still_end(tuning):
    able = ABLE._replace(tuning=tuning)
    for wind in (-2.0, 0.0, 2.0):
        leg = Leg(30.0, 0.0, tail_wind=wind)
        assert predict_hover(leg, able).time < 25.0
        assert predict_forward(leg, able).time < 12.0


# INDI, by which the default controller flies legs

BY_INDI = ABLE._replace(tuning=Tuning())


@pytest.mark.parametrize(
    ("predict", "leg", "time", "energy", "limit"),
    [
        (predict_hover, Leg(40.0, 0.0), 14.7, 2492.0, 0.02),
        (predict_hover, Leg(60.0, 0.0, 2.0, -1.0), 21.54, 3713.0, 0.02),
        (predict_hover, Leg(64.0, 22.0, 1.8, 1.2), 23.04, 3981.0, 0.02),
        (predict_hover, Leg(60.0, 0.0, -3.0, 1.0), 22.42, 3815.0, 0.06),
        (predict_forward, Leg(40.0, 0.0), 8.88, 1258.0, 0.02),
        (predict_forward, Leg(36.0, 0.0, turn=2.0), 8.58, 1254.0, 0.02),
        (predict_forward, Leg(80.0, 0.0, -1.8, -2.7), 13.56, 1341.0, 0.03),
        (predict_forward, Leg(80.0, 20.0), 11.8, 1493.0, 0.06),
        (predict_forward, Leg(200.0, -20.0, 3.0), 17.66, 1448.0, 0.15),
    ],
)
def test_a_leg_under_indi_takes_as_long_and_as_much_as_flown(predict, leg, time, energy, limit):
    """Flown by the whole vehicle (``fly_leg`` of the study of break-even); the prediction is fitted to none of them."""
    taken = predict(leg, BY_INDI)
    assert taken.time == pytest.approx(time, rel=limit)
    assert taken.energy == pytest.approx(energy, rel=limit)
