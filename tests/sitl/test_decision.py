"""Hover or fly: what the predictions do with a leg, and what is chosen by them."""

import math
from itertools import pairwise

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sitl.airframe import load
from sitl.autopilot.choice import Chooser, Stop
from sitl.autopilot.decision import Abilities, Leg, Way, Why, decide, forbidden, plan, predict_forward, predict_hover
from sitl.autopilot.guidance import View
from sitl.autopilot.settings import Settings

NOMINAL = load("nominal").parameters
ABLE = Abilities(NOMINAL, can_fly_forward=True, hover_speed=3.0, airspeed=15.0)
LEAST = 15.1  # [m]
# Uphill into a strong wind that carries the upright vehicle: the hover is cheap but slow.
UPHILL = Leg(60.0, 57.0, -6.8, -1.7, 3.0)

legs = st.builds(
    Leg,
    distance=st.floats(5.0, 200.0),
    climb=st.floats(-20.0, 20.0),
    tail_wind=st.floats(-3.0, 3.0),
    cross_wind=st.floats(-3.0, 3.0),
    turn=st.floats(0.0, math.pi),
)
ways = st.sampled_from(Way)


def cost(decisions):
    """Predicted energy of the ways chosen [J]."""
    return sum((d.forward if d.way is Way.FORWARD else d.hover).energy for d in decisions)


# The predictions


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


# The choice


def test_a_long_leg_is_flown_and_a_short_one_after_a_turn_hovered():
    long, short = Leg(120.0, 0.0, turn=1.6), Leg(20.0, 0.0, turn=1.6)
    chosen = [decide(leg, ABLE, LEAST) for leg in (long, short)]
    assert [(d.way, d.why) for d in chosen] == [(Way.FORWARD, Why.ENERGY), (Way.HOVER, Why.ENERGY)]
    assert cost(chosen) == min(d.energy for d in chosen[0][1:3]) + min(d.energy for d in chosen[1][1:3])


@pytest.mark.parametrize(
    ("leg", "able", "why"),
    [
        (Leg(100.0, 0.0), ABLE._replace(can_fly_forward=False), Why.NO_TRIM),
        (Leg(100.0, 0.0, height=2.0), ABLE, Why.TOO_LOW),
        (Leg(20.0, 25.0), ABLE, Why.TOO_STEEP),
        (Leg(50.0, -20.0), ABLE, Why.TOO_STEEP),
        (Leg(14.0, 0.0), ABLE, Why.TOO_SHORT),
    ],
)
def test_what_bars_the_wing_is_said_even_against_a_command(leg, able, why):
    for asked in (Way.NONE, Way.FORWARD):
        decision = decide(leg, able, LEAST, asked)
        assert (decision.way, decision.why) == (Way.HOVER, why)


def test_a_leg_the_hover_wins_is_flown_when_only_the_wing_keeps_the_deadline():
    view = View(0.0, (0.0, 0.0, 20.0), (0.0, 0.0, 0.0), 0.0, 0.0, False, 1.0)
    course = UPHILL.turn
    c, s = math.cos(course), math.sin(course)
    wind = (c * UPHILL.tail_wind - s * UPHILL.cross_wind, s * UPHILL.tail_wind + c * UPHILL.cross_wind, 0.0)
    end = (c * UPHILL.distance, s * UPHILL.distance, 20.0 + UPHILL.climb)

    def choose(leg_time):
        chooser = Chooser(NOMINAL, can_fly_forward=True)
        asked = Settings(least_leg=LEAST, leg_time=leg_time)
        return chooser.choose(view._replace(wind=wind), view.p, [Stop(end)], asked, 18.6)[0]

    free = choose(0.0)
    assert (free.way, free.why) == (Way.HOVER, Why.ENERGY)
    assert free.forward.time < free.hover.time
    pressed = choose(0.5 * (free.forward.time + free.hover.time))
    assert (pressed.way, pressed.why) == (Way.FORWARD, Why.DEADLINE)
    assert pressed.forward.energy > pressed.hover.energy
    assert choose(1.1 * free.hover.time).way is Way.HOVER


def test_a_stop_that_makes_a_leg_late_counts():
    """The leg before one that must be hovered ends at rest, and that has to happen within its deadline."""
    first, steep = Leg(28.0, 0.0, turn=1.6), Leg(5.0, 20.0)
    whole, through = (predict_forward(first, ABLE, end=end) for end in (True, False))
    hover = predict_hover(first, ABLE)
    between = 0.5 * (through.time + min(whole.time, hover.time))
    assert through.time < between < min(whole.time, hover.time)
    chosen = plan([first, steep], ABLE._replace(deadline=between), LEAST, [Way.NONE] * 2)
    assert [d.way for d in chosen] == [d.way for d in plan([first, steep], ABLE, LEAST, [Way.NONE] * 2)]


def test_legs_in_a_row_share_their_transitions():
    row = [Leg(60.0, 0.0)] * 3
    together = plan(row, ABLE, LEAST, [Way.NONE] * 3)
    assert all(d.way is Way.FORWARD for d in together)
    assert cost(together) < 0.6 * sum(cost([decide(leg, ABLE, LEAST)]) for leg in row)


@given(st.lists(legs, min_size=1, max_size=4))
@settings(max_examples=25)
def test_a_plan_is_never_worse_than_either_pure_way(row):
    count = len(row)
    free, hovered, flown = (cost(plan(row, ABLE, LEAST, [way] * count)) for way in (Way.NONE, Way.HOVER, Way.FORWARD))
    assert free <= min(hovered, flown) + 1e-6


@given(st.lists(st.tuples(legs, ways), min_size=1, max_size=4))
@settings(max_examples=25)
def test_what_is_asked_is_done_unless_it_is_impossible(row):
    asked = [way for _, way in row]
    for (leg, wanted), made in zip(row, plan([leg for leg, _ in row], ABLE, LEAST, asked), strict=True):
        barred = forbidden(leg, ABLE) is not Why.NONE or leg.distance < LEAST
        if wanted is Way.HOVER or (wanted is Way.FORWARD and not barred):
            assert made.way is wanted
        if barred:
            assert made.way is Way.HOVER


@given(st.lists(legs, min_size=1, max_size=3), st.floats(1.0, 60.0))
@settings(max_examples=15)
def test_a_deadline_never_makes_a_plan_cheaper_nor_later(row, deadline):
    count = len(row)
    free = plan(row, ABLE, LEAST, [Way.NONE] * count)
    pressed = plan(row, ABLE._replace(deadline=deadline), LEAST, [Way.NONE] * count)

    def late(decisions):
        return sum((d.forward if d.way is Way.FORWARD else d.hover).time > deadline for d in decisions)

    assert late(pressed) <= late(free)
    assert cost(pressed) >= cost(free) - 1e-6


@given(legs, st.floats(15.1, 250.0))
@settings(max_examples=20)
def test_a_greater_least_leg_only_takes_the_wing_away(leg, least):
    now, then = (decide(leg, ABLE, limit).way for limit in (LEAST, least))
    assert then is Way.HOVER or now is Way.FORWARD
