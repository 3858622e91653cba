"""The heading that the hover laws are handed."""

import math

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, along, hover_at, leg, steer
from sitl.guidance.headings import HELD_SPEED, LANDING_WIND, MAX_UNAIDED_WIND, SafeHeading, YawTurn
from sitl.guidance.legs import LIGHT_WIND
from sitl.guidance.view import MAX_HEADING_RATE, MAX_HEADING_STEP, VehicleView
from sitl.model.quaternions import hover
from sitl.model.vectors import Vector

HERE = (0.0, 0.0, 20.0)
STILL = (0.0, 0.0, 0.0)
TICK = 0.02
STRONG = (0.0, LIGHT_WIND + 0.1, 0.0)
EDGE_ON = {"law": Law.TO_HOVER, "wind": STRONG}


def view(time, heading=0.0, **seen):
    given = {
        "p": HERE,
        "v": STILL,
        "tilt": 0.0,
        "landed": False,
        "battery_remaining": 1.0,
        "law": Law.HOVER_LINEAR,
        **seen,
    }
    return VehicleView(time=time, heading=heading, **given)


def wanted(heading):
    return hover_at(HERE, heading)


def handed(safe, reference, ticks, heading=0.0, steered=False, landing=False, **seen):
    """Headings of ticks after that at time 0."""
    return [
        safe.applied(reference, view((i + 1) * TICK, heading, **seen), steered=steered, landing=landing).heading
        for i in range(ticks)
    ]


def held(heading):
    """A safe heading that has already been applied once."""
    safe = SafeHeading()
    assert safe.applied(wanted(heading), view(0.0, heading)).heading == heading
    return safe


@pytest.mark.parametrize(("start", "end", "way"), [(0.0, 3.0, 1.0), (0.5, -2.0, -1.0), (3.0, -3.0, 1.0)])
@pytest.mark.parametrize("turns", [0, 2, -1])
def test_a_step_is_turned_the_short_way_at_the_rate_and_ends_there(start, end, way, turns):
    headings = handed(held(start), wanted(end + turns * math.tau), 400, start)
    steps = [math.remainder(b - a, math.tau) for a, b in zip([start, *headings], headings, strict=False)]
    assert steps[0] == pytest.approx(way * MAX_HEADING_RATE * TICK)
    assert max(abs(step) for step in steps) <= MAX_HEADING_RATE * TICK + 1e-12
    assert headings[-1] == pytest.approx(end)


def test_a_heading_of_many_turns_has_an_end():
    headings = handed(held(0.0), wanted(3.3e38), 500)
    assert headings[-1] == headings[-2] == math.remainder(3.3e38, math.tau)


def test_what_turns_slowly_is_followed_at_once():
    safe, rate = held(0.0), 0.5 * MAX_HEADING_RATE
    for i in range(1, 100):
        assert safe.applied(wanted(rate * i * TICK), view(i * TICK)).heading == rate * i * TICK


def test_small_steps_of_who_steers_are_handed_on():
    assert handed(held(0.0), wanted(0.99 * MAX_HEADING_STEP), 1, steered=True) == [0.99 * MAX_HEADING_STEP]
    assert handed(held(0.0), wanted(1.01 * MAX_HEADING_STEP), 1, steered=True) == [MAX_HEADING_RATE * TICK]


@pytest.mark.parametrize("seen", [{"landed": True}, {"forward": True}])
def test_on_the_ground_and_in_forward_flight_the_heading_is_handed_on(seen):
    safe = held(0.0)
    assert handed(safe, wanted(3.0), 1, **seen) == [3.0]
    after = safe.applied(wanted(3.0), view(2 * TICK, heading=1.0)).heading
    assert after == pytest.approx(1.0 + MAX_HEADING_RATE * TICK)  # the turn begins where the vehicle points


@pytest.mark.parametrize(
    "reference",
    [
        along(wanted(0.0), leg(HERE, (90.0, 0.0, 20.0), 15.0), 3.0),
        steer(wanted(3.0), AttitudeReference(hover(0.0), Vector(0.0, 0.0, 0.0), 0.5)),
    ],
)
def test_paths_and_attitudes_are_handed_on(reference):
    assert held(0.0).applied(reference, view(TICK)) == reference


def test_in_a_wind_that_is_held_the_span_turns_into_it_the_short_way_and_stays():
    safe = held(0.4)
    assert handed(safe, wanted(0.4), 100, 0.4, **EDGE_ON)[-1] == pytest.approx(0.0)
    backed = {"law": Law.TO_HOVER, "wind": (-1.0, 3.0, 0.0)}  # is followed, not flipped over
    assert safe.applied(wanted(3.0), view(9.0, **backed)).heading == pytest.approx(math.atan2(1.0, 3.0))
    assert safe.applied(wanted(0.4), view(18.0)).heading == 0.4


@pytest.mark.parametrize(
    ("law", "wind", "v", "steered"),
    [
        (Law.HOVER_LINEAR, STRONG, STILL, False),
        (Law.TO_HOVER, (0.0, LIGHT_WIND - 0.1, 0.0), STILL, False),
        (Law.TO_HOVER, STRONG, (HELD_SPEED + 0.1, 0.0, 0.0), False),
        (Law.TO_HOVER, STRONG, STILL, True),
    ],
)
def test_elsewhere_the_heading_stays_as_it_is_wanted(law, wind, v, steered):
    assert handed(held(0.4), wanted(0.4), 50, 0.4, law=law, wind=wind, v=v, steered=steered) == [0.4] * 50


@pytest.mark.parametrize("height", [20.0, 0.2])
def test_a_landing_turns_the_span_into_a_light_wind_too_down_to_the_ground(height):
    light, lighter = (0.0, LANDING_WIND + 0.1, 0.0), (0.0, LANDING_WIND - 0.1, 0.0)
    p = (0.0, 0.0, height)
    assert handed(held(0.4), wanted(0.4), 100, 0.4, landing=True, p=p, wind=light)[-1] == pytest.approx(0.0)
    assert handed(held(0.4), wanted(0.4), 100, 0.4, landing=True, p=p, wind=lighter)[-1] == 0.4


@pytest.mark.parametrize(("wind", "turns"), [(MAX_UNAIDED_WIND - 0.1, False), (MAX_UNAIDED_WIND + 0.1, True)])
def test_a_landing_without_position_turns_into_a_strong_wind_only(wind, turns):
    safe = held(0.0)
    seen = [
        safe.applied(wanted(0.0), view(k * TICK, wind=(wind, 0.0, 0.0)), landing=True, unaided=True).heading
        for k in range(1, 50)
    ]
    assert (max(map(abs, seen)) > 0.3) == turns


def test_without_position_it_keeps_the_heading_that_it_comes_out_of_forward_flight_with():
    safe = SafeHeading()
    assert safe.applied(wanted(2.0), view(0.02, 1.0), landing=True, unaided=True).heading == pytest.approx(1.0)


# Turns of the heading: how far, which way round, how fast.


def turning(time, clockwise):
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
    turn = YawTurn.of(params, turning(0.0, now))
    assert -math.degrees(turn.remaining) == pytest.approx(turned, abs=1e-9)


def test_it_turns_at_its_rate_and_no_faster_than_the_laws_follow():
    slow, fast = (YawTurn.of((90.0, rate, 0.0, 0.0), turning(0.0, 0.0)) for rate in (10.0, 200.0))
    assert -math.degrees(slow.update(turning(2.0, 0.0))) == pytest.approx(20.0)
    assert -fast.update(turning(1.0, 0.0)) == pytest.approx(MAX_HEADING_RATE)


def test_it_is_done_once_the_vehicle_has_the_heading():
    turn = YawTurn.of((30.0, 30.0, 0.0, 0.0), turning(0.0, 0.0))
    turn.update(turning(0.5, 10.0))
    assert not turn.done(turning(0.5, 30.0))
    turn.update(turning(1.1, 20.0))
    assert not turn.done(turning(1.1, 20.0))
    assert turn.done(turning(1.2, 28.0))
