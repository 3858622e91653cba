"""Turns of the heading: how far, which way round, how fast."""

import math

import pytest

from sitl.guidance.headings import YawTurn
from sitl.guidance.view import MAX_HEADING_RATE, VehicleView


def view(time, clockwise):
    return VehicleView(time, (0.0, 0.0, 5.0), (0.0, 0.0, 0.0), -math.radians(clockwise), 0.0, False, 1.0)


@pytest.mark.parametrize(
    ("params", "now", "turned"),
    [
        ((90.0, 0.0, 0.0, 0.0), 10.0, 80.0),
        ((350.0, 0.0, 0.0, 0.0), 10.0, -20.0),
        ((350.0, 0.0, 1.0, 0.0), 10.0, 340.0),
        ((90.0, 0.0, -1.0, 0.0), 10.0, -280.0),
        ((10.0, 0.0, 1.0, 0.0), 10.0, 0.0),
        ((45.0, 0.0, 1.0, 1.0), 10.0, 45.0),
        ((45.0, 0.0, -1.0, 1.0), 10.0, -45.0),
        ((45.0, math.nan, math.nan, 1.0), 10.0, 45.0),
    ],
)
def test_it_turns_as_far_and_the_way_that_is_asked(params, now, turned):
    turn = YawTurn.of(params, view(0.0, now))
    assert -math.degrees(turn.remaining) == pytest.approx(turned, abs=1e-9)


def test_it_turns_at_its_rate_and_no_faster_than_the_laws_follow():
    slow, fast = (YawTurn.of((90.0, rate, 0.0, 0.0), view(0.0, 0.0)) for rate in (10.0, 200.0))
    assert -math.degrees(slow.update(view(2.0, 0.0))) == pytest.approx(20.0)
    assert -fast.update(view(1.0, 0.0)) == pytest.approx(MAX_HEADING_RATE)


def test_it_is_done_once_the_vehicle_has_the_heading():
    turn = YawTurn.of((30.0, 30.0, 0.0, 0.0), view(0.0, 0.0))
    turn.update(view(0.5, 10.0))
    assert not turn.done(view(0.5, 30.0))
    turn.update(view(1.1, 20.0))
    assert not turn.done(view(1.1, 20.0))
    assert turn.done(view(1.2, 28.0))
