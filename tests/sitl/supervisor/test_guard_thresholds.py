"""The thresholds of the guards in numbers, and what holds exactly at them."""

import math

import pytest

from sitl.control.forward_flight.forward_guidance import stopping_distance
from sitl.control.reference import along, circle, hover_at, leg
from sitl.design.gains import line_of_sight_gains
from sitl.model.quaternions import Quaternion, hover
from sitl.model.vectors import Vector
from sitl.supervisor import guards as g
from sitl.supervisor.resets import LET_GO_TIME, begin_anew, broken, landed, level_first
from tests.support.flights.estimates import estimate, turned

GUIDANCE = line_of_sight_gains().guidance
USUAL = g.Thresholds(
    v_enter=20.0,
    v_leave=50.0,
    v_waited=20.0,
    v_settled=10.0,
    v_forward_enter=5.0,
    v_forward_leave=20.0,
    single_law=False,
    use_indi=False,
    indi_alone=False,
    use_robust_pi=False,
)
NEAR = {"thresholds": USUAL, "v_integral": 0.0, "inhibited": 0.0, "law_time": 0.0}
SETTLED = {"thresholds": USUAL, "law_time": 0.0}
BELOW = 1.0 - 1e-12
HERE, END = (0.0, 0.0, 50.0), (100.0, 0.0, 50.0)


def nose(height, speed=0.0):
    """An estimate whose nose has exactly this vertical component; its quaternion is not of unit length for that."""
    return estimate(q=Quaternion(1.0, 0.0, -0.5 * height, 0.0), v=(speed, 0.0, 0.0))


def sinking(rate, height):
    return estimate(p=(0.0, 0.0, height), v=(0.0, 0.0, -rate))


def flying_at(airspeed):
    return estimate(v=(airspeed + 2.0, 0.0, 0.0), wind=(2.0, 0.0, 0.0))


def forward(airspeed):
    return along(hover_at(HERE, 0.0), leg(HERE, END, airspeed), 0.0)


@pytest.mark.parametrize(
    ("guard", "threshold", "seen"),
    [
        (g.wind_strong, 4.0, lambda x: {"estimate": estimate(wind=(x, 0.0, 0.0)), "thresholds": USUAL}),
        (g.wing_borne, 8.0, lambda x: {"estimate": flying_at(x), "reference": forward(20.0)}),
        (g.wing_borne, 5.1, lambda x: {"estimate": flying_at(x), "reference": forward(6.0)}),
        (
            g.leg_long_enough,
            15.0,
            lambda x: {"estimate": estimate(p=(100.0 - x, 0.0, 50.0)), "reference": forward(12.0)},
        ),
        (g.sliding, 4.0, lambda x: {"law_time": x, "estimate": nose(0.5, 9.0), "thresholds": USUAL}),
        (g.sliding, 4.0, lambda x: {"law_time": 9.0, "estimate": nose(0.5, x), "thresholds": USUAL}),
        (g.falling, 14.0, lambda x: {"estimate": sinking(x, 1000.0), "thresholds": USUAL}),
        (g.falling, 3.0, lambda x: {"estimate": sinking(x, 0.01), "thresholds": USUAL}),
        (g.attitude_diverged, 0.3, lambda x: {"v_attitude": x}),
        (g.v_above_leave, 50.0, lambda x: {"v_hover": x, "thresholds": USUAL}),
        (g.v_forward_above_leave, 20.0, lambda x: {"v_forward": x, "thresholds": USUAL}),
    ],
)
def test_guards_that_hold_above_a_number_and_not_at_it(guard, threshold, seen):
    assert guard.test(**seen(threshold + 1e-9))
    assert not guard.test(**seen(threshold))


@pytest.mark.parametrize(
    ("guard", "threshold", "seen"),
    [
        (g.wind_calm, 3.0, lambda x: {"estimate": estimate(wind=(0.0, x, 0.0))}),
        (g.upright_and_slow, 3.5, lambda x: {"estimate": nose(0.9, x)}),
        (g.recovered, 3.0, lambda x: {"estimate": sinking(x, 50.0)}),
        (g.recovered, 1.0, lambda x: {"estimate": estimate(w=(0.0, x, 0.0))}),
        (g.standing, 2.0, lambda x: {"estimate": nose(0.9, x)}),
        (g.falling, 8.0, lambda x: {"estimate": sinking(10.0, x), "thresholds": USUAL}),
        (g.sliding, 0.9, lambda x: {"law_time": 9.0, "estimate": nose(x, 9.0), "thresholds": USUAL}),
        (g.v_below_enter, 20.0, lambda x: {"v_hover": x, "estimate": nose(0.9), **NEAR}),
        (g.v_below_settled, 10.0, lambda x: {"v_hover": x, "estimate": nose(0.9), **SETTLED}),
        (g.v_forward_below_enter, 5.0, lambda x: {"v_forward": x, "thresholds": USUAL}),
    ],
)
def test_guards_that_hold_below_a_number_and_not_at_it(guard, threshold, seen):
    assert guard.test(**seen(threshold * BELOW))
    assert not guard.test(**seen(threshold))


@pytest.mark.parametrize(
    ("guard", "height", "rest"),
    [
        (g.v_below_enter, 0.0, {"v_hover": 1.0, **NEAR}),
        (g.v_below_settled, 0.0, {"v_hover": 1.0, **SETTLED}),
        (g.upright_and_slow, 0.5, {}),
        (g.recovered, 0.7, {}),
        (g.standing, 0.3, {}),
        (g.aligned, 0.7, {"course": 0.0, "law_time": 0.0}),
    ],
)
def test_the_nose_has_to_be_higher_than_a_number(guard, height, rest):
    assert guard.test(estimate=nose(height + 1e-9), **rest)
    assert not guard.test(estimate=nose(height), **rest)


@pytest.mark.parametrize(
    ("guard", "time", "seen"),
    [
        (g.dwell_elapsed, 0.5, lambda x: {"law_time": x}),
        (g.aligned, 10.0, lambda x: {"law_time": x, "estimate": nose(0.6), "course": 2.0}),
        (g.resting, 0.02, lambda x: {"at_rest": x, "estimate": nose(0.93 + 1e-9)}),
        (g.resting, 0.3, lambda x: {"at_rest": x, "estimate": nose(0.93 - 1e-9)}),
    ],
)
def test_timers_are_up_exactly_at_their_time(guard, time, seen):
    assert guard.test(**seen(time))
    assert not guard.test(**seen(time * BELOW))


def test_aligned_is_slower_than_two_and_a_half_metres_per_second_and_within_twelve_degrees():
    def holds(speed, degrees):
        tipped = turned(hover(math.radians(degrees)), (0.0, 0.3, 0.0))
        return g.aligned.test(estimate=estimate(q=tipped, v=(0.0, 0.0, speed)), course=0.0, law_time=0.0)

    assert holds(2.5 * BELOW, 0.0)
    assert not holds(2.5, 0.0)
    for side in (1.0, -1.0):
        assert holds(0.0, side * 11.99)
        assert not holds(0.0, side * 12.01)


@pytest.mark.parametrize(("guard", "distances"), [(g.stop_due, 1.0), (g.has_stopping_distance, 2.0)])
def test_braking_begins_with_one_braking_distance_left_and_flying_on_takes_two(guard, distances):
    def holds(left):
        seen = estimate(p=(100.0 - left, 0.0, 50.0), v=(12.0, 0.0, 0.0))
        return guard.test(estimate=seen, reference=forward(15.0), guidance=GUIDANCE)

    left = distances * stopping_distance(12.0, 0.0, 0.0, GUIDANCE)
    assert holds(left - 1e-6) == (guard is g.stop_due)
    assert holds(left + 1e-6) == (guard is g.has_stopping_distance)


def test_a_path_without_an_end_is_worth_a_transition_wherever_it_is():
    here = estimate(p=END)
    assert g.leg_long_enough.test(estimate=here, reference=along(hover_at(HERE, 0.0), circle(HERE, 40.0, 15.0), 0.0))
    assert g.leg_long_enough.test(
        estimate=here, reference=along(hover_at(HERE, 0.0), leg(HERE, END, 15.0, stop=False), 0.0)
    )
    assert not g.leg_long_enough.test(estimate=here, reference=forward(15.0))


def test_what_is_left_of_a_path_is_the_level_way_to_its_end():
    end = (60.0, 80.0, 90.0)
    reference = along(hover_at(HERE, 0.0), leg(HERE, end, 15.0), 0.0)
    for left, worth in ((15.1, True), (14.9, False)):
        for aside in ((0.6, 0.8), (-0.8, 0.6), (0.0, -1.0)):
            here = estimate(p=(end[0] + left * aside[0], end[1] + left * aside[1], 10.0))
            assert g.leg_long_enough.test(estimate=here, reference=reference) == worth


def test_rest_on_the_ground_is_slower_than_sixty_centimetres_per_second():
    assert g.REST_SPEED == 0.6


def test_resets_in_numbers():
    here = estimate()
    assert LET_GO_TIME == 1.0
    assert level_first.map(here)[1] == 1.0
    assert landed.map(here) == (False, Vector(0.0, 0.0, 0.0))
    assert broken.map(here) == (False, False, Vector(0.0, 0.0, 0.0))
    assert begin_anew.map(here)[:3] == (0.0, 0.0, 0.0)


def test_a_law_waits_ten_seconds():
    far = {**NEAR, "thresholds": USUAL._replace(v_enter=1.0), "v_hover": 10.0, "estimate": nose(0.9)}
    assert g.v_below_enter.test(**far | {"law_time": 10.0})
    assert not g.v_below_enter.test(**far | {"law_time": 10.0 * BELOW})


def test_the_linear_forward_law_is_in_use_at_any_entry_threshold_above_nothing():
    for enter, scheduled in ((0.0, False), (1e-9, True)):
        assert g.has_forward_linear.test(thresholds=USUAL._replace(v_forward_enter=enter)) == scheduled
