"""Hover or cruise: what is chosen by the predictions."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect.vocabulary import DecisionReason, LegMode
from sitl.model.airframe_files import load
from sitl.prediction.corners import Leg
from sitl.prediction.mode_choice import CHANGE_SHARE, _reason, choose_modes, decide, forbidden
from sitl.prediction.point_mass import Prediction
from sitl.prediction.predictor import Abilities, predict_forward, predict_hover
from tests.support.flights.tunings import BY_REPORT

NOMINAL = load("nominal").parameters
ABLE = Abilities(NOMINAL, BY_REPORT, can_fly_forward=True, hover_speed=3.0, airspeed=15.0)
MIN_LEG = 15.1  # [m]

legs = st.builds(
    Leg,
    distance=st.floats(5.0, 200.0),
    climb=st.floats(-20.0, 20.0),
    tail_wind=st.floats(-3.0, 3.0),
    cross_wind=st.floats(-3.0, 3.0),
    turn=st.floats(0.0, math.pi),
)
ways = st.sampled_from(LegMode)


def cost(decisions):
    """Predicted energy of the ways chosen [J]."""
    return sum((d.forward if d.leg_mode is LegMode.FORWARD else d.hover).energy for d in decisions)


def test_a_long_leg_is_flown_and_a_short_one_after_a_turn_hovered():
    long, short = Leg(120.0, 0.0, turn=1.6), Leg(20.0, 0.0, turn=1.6)
    chosen = [decide(leg, ABLE, MIN_LEG) for leg in (long, short)]
    assert [(d.leg_mode, d.reason) for d in chosen] == [
        (LegMode.FORWARD, DecisionReason.ENERGY),
        (LegMode.HOVER, DecisionReason.ENERGY),
    ]
    assert cost(chosen) == min(d.energy for d in chosen[0][1:3]) + min(d.energy for d in chosen[1][1:3])


@pytest.mark.parametrize(
    ("leg", "able", "reason"),
    [
        (Leg(100.0, 0.0), ABLE._replace(can_fly_forward=False), DecisionReason.NO_TRIM),
        (Leg(100.0, 0.0, height=2.0), ABLE, DecisionReason.TOO_LOW),
        (Leg(20.0, 25.0), ABLE, DecisionReason.TOO_STEEP),
        (Leg(50.0, -20.0), ABLE, DecisionReason.TOO_STEEP),
        (Leg(14.0, 0.0), ABLE, DecisionReason.TOO_SHORT),
    ],
)
def test_what_bars_the_wing_is_said_even_against_a_command(leg, able, reason):
    for asked in (LegMode.NONE, LegMode.FORWARD):
        decision = decide(leg, able, MIN_LEG, asked)
        assert (decision.leg_mode, decision.reason) == (LegMode.HOVER, reason)


def test_a_stop_that_makes_a_leg_late_counts():
    """The leg before one that must be hovered ends at rest, and that has to happen within its deadline."""
    first, steep = Leg(28.0, 0.0, turn=1.6), Leg(5.0, 20.0)
    whole, through = (predict_forward(first, ABLE, end=end) for end in (True, False))
    hover = predict_hover(first, ABLE)
    between = 0.5 * (through.time + min(whole.time, hover.time))
    assert through.time < between < min(whole.time, hover.time)
    chosen = choose_modes([first, steep], ABLE._replace(deadline=between), MIN_LEG, [LegMode.NONE] * 2)
    assert [d.leg_mode for d in chosen] == [
        d.leg_mode for d in choose_modes([first, steep], ABLE, MIN_LEG, [LegMode.NONE] * 2)
    ]


def test_legs_in_a_row_share_their_transitions():
    row = [Leg(60.0, 0.0)] * 3
    together = choose_modes(row, ABLE, MIN_LEG, [LegMode.NONE] * 3)
    assert all(d.leg_mode is LegMode.FORWARD for d in together)
    assert cost(together) < 0.6 * sum(cost([decide(leg, ABLE, MIN_LEG)]) for leg in row)


@given(st.lists(legs, min_size=1, max_size=4))
@settings(max_examples=25)
def test_a_plan_is_never_worse_than_either_pure_way(row):
    count = len(row)
    free, hovered, flown = (
        cost(choose_modes(row, ABLE, MIN_LEG, [leg_mode] * count))
        for leg_mode in (LegMode.NONE, LegMode.HOVER, LegMode.FORWARD)
    )
    assert free <= min(hovered, flown) + 1e-6


@given(st.lists(st.tuples(legs, ways), min_size=1, max_size=4))
@settings(max_examples=25)
def test_what_is_asked_is_done_unless_it_is_impossible(row):
    asked = [leg_mode for _, leg_mode in row]
    for (leg, wanted), made in zip(row, choose_modes([leg for leg, _ in row], ABLE, MIN_LEG, asked), strict=True):
        barred = forbidden(leg, ABLE) is not DecisionReason.NONE or leg.distance < MIN_LEG
        if wanted is LegMode.HOVER or (wanted is LegMode.FORWARD and not barred):
            assert made.leg_mode is wanted
        if barred:
            assert made.leg_mode is LegMode.HOVER


@given(st.lists(legs, min_size=1, max_size=3), st.floats(1.0, 60.0))
@settings(max_examples=15)
def test_a_deadline_never_makes_a_plan_cheaper_nor_later(row, deadline):
    count = len(row)
    free = choose_modes(row, ABLE, MIN_LEG, [LegMode.NONE] * count)
    pressed = choose_modes(row, ABLE._replace(deadline=deadline), MIN_LEG, [LegMode.NONE] * count)

    def late(decisions):
        return sum((d.forward if d.leg_mode is LegMode.FORWARD else d.hover).time > deadline for d in decisions)

    assert late(pressed) <= late(free)
    assert cost(pressed) >= cost(free) - 1e-6


def test_a_way_that_was_told_stays_until_the_other_is_clearly_better():
    """About the report's laws' break-even after a quarter turn."""
    lengths = [22.0 + 0.25 * i for i in range(50)]
    for told in (LegMode.NONE, LegMode.HOVER, LegMode.FORWARD):
        made = [choose_modes([Leg(d, 0.0, turn=1.6)], ABLE, 10.0, [LegMode.NONE], told=[told])[0] for d in lengths]
        for one in made:
            cheaper = LegMode.FORWARD if one.forward.energy < one.hover.energy else LegMode.HOVER
            saved = 1.0 - min(one.forward.energy, one.hover.energy) / max(one.forward.energy, one.hover.energy)
            if saved > CHANGE_SHARE or told is LegMode.NONE:
                assert one.leg_mode is cheaper
            if saved < 0.9 * CHANGE_SHARE and told is not LegMode.NONE:
                assert one.leg_mode is told
        assert {one.leg_mode for one in made} == {LegMode.HOVER, LegMode.FORWARD}


@given(legs, st.floats(15.1, 250.0))
@settings(max_examples=20)
def test_a_greater_least_leg_only_takes_the_wing_away(leg, least):
    now, then = (decide(leg, ABLE, limit).leg_mode for limit in (MIN_LEG, least))
    assert then is LegMode.HOVER or now is LegMode.FORWARD


def test_a_dearer_way_is_told_to_be_the_cheaper_one_in_the_whole_row():
    dear, cheap = Prediction(28.7, 3350.0), Prediction(32.1, 2877.0)
    for mine, other, reason in ((dear, cheap, DecisionReason.ROW), (cheap, dear, DecisionReason.ENERGY)):
        assert _reason(LegMode.HOVER, mine, other, DecisionReason.NONE, LegMode.NONE, 0.0) is reason
