"""The heading that the hover laws are handed."""

import math

import pytest

from protocol.dialect.vocabulary import Law
from sitl.control.reference import AttitudeReference, along, hover_at, leg, steer
from sitl.guidance.heading_slew import HELD_SPEED, HeadingSlew
from sitl.guidance.legs import LIGHT_WIND
from sitl.guidance.limits import MAX_HEADING_RATE
from sitl.guidance.view import VehicleView
from sitl.model.quaternions import hover
from sitl.model.vectors import Vector

HERE = (0.0, 0.0, 20.0)
TICK = 0.02
STRONG = (0.0, LIGHT_WIND + 0.1, 0.0)


def view(time, heading=0.0, **seen):
    given = {"tilt": 0.0, "landed": False, "battery_left": 1.0, "law": Law.HOVER_LINEAR, **seen}
    return VehicleView(time, HERE, given.pop("v", (0.0, 0.0, 0.0)), heading, **given)


def wanted(heading):
    return hover_at(HERE, heading)


def handed(slew, reference, ticks, **seen):
    """Headings of ticks after that at time 0."""
    return [slew.turned(reference, view((i + 1) * TICK, **seen)).heading for i in range(ticks)]


def held(heading):
    """A slew that has handed out a heading."""
    slew = HeadingSlew()
    slew.turned(wanted(heading), view(0.0, heading))
    return slew


@pytest.mark.parametrize(("start", "end", "way"), [(0.0, 3.0, 1.0), (0.5, -2.0, -1.0), (3.0, -3.0, 1.0)])
def test_a_step_is_turned_the_short_way_at_the_rate_and_ends_there(start, end, way):
    headings = handed(held(start), wanted(end), 400)
    steps = [math.remainder(b - a, math.tau) for a, b in zip([start, *headings], headings, strict=False)]
    assert steps[0] == pytest.approx(way * MAX_HEADING_RATE * TICK)
    assert max(abs(step) for step in steps) <= MAX_HEADING_RATE * TICK + 1e-12
    assert headings[-1] == end


def test_what_turns_slowly_is_followed_at_once():
    slew, rate = held(0.0), 0.5 * MAX_HEADING_RATE
    for i in range(1, 100):
        assert slew.turned(wanted(rate * i * TICK), view(i * TICK)).heading == rate * i * TICK


@pytest.mark.parametrize("seen", [{"landed": True}, {"forward": True}])
def test_on_the_ground_and_in_forward_flight_the_heading_is_handed_on(seen):
    slew = held(0.0)
    assert handed(slew, wanted(3.0), 1, **seen) == [3.0]
    after = slew.turned(wanted(3.0), view(2 * TICK, heading=1.0)).heading
    assert after == pytest.approx(1.0 + MAX_HEADING_RATE * TICK)  # the turn begins where the vehicle points


@pytest.mark.parametrize(
    "reference",
    [
        along(wanted(0.0), leg(HERE, (90.0, 0.0, 20.0), 15.0), 3.0),
        steer(wanted(3.0), AttitudeReference(hover(0.0), Vector(0.0, 0.0, 0.0), 0.5)),
    ],
)
def test_paths_and_attitudes_are_handed_on(reference):
    assert held(0.0).turned(reference, view(TICK)) == reference


def test_in_a_wind_that_is_held_the_span_turns_into_it_the_short_way_and_stays():
    slew = HeadingSlew()
    seen = {"law": Law.TO_HOVER, "wind": STRONG}
    assert slew.turned(wanted(0.4), view(0.0, 0.4, **seen)).heading == 0.4
    assert handed(slew, wanted(0.4), 100, **seen)[-1] == pytest.approx(0.0)
    # a wind that backs is followed, not flipped over
    assert handed(slew, wanted(3.0), 1, law=Law.TO_HOVER, wind=(-1.0, 3.0, 0.0), v=(1.0, 0.0, 0.0))[0] < 0.4


@pytest.mark.parametrize(
    ("law", "wind", "v", "may_turn"),
    [
        (Law.HOVER_LINEAR, STRONG, (0.0, 0.0, 0.0), True),
        (Law.TO_HOVER, (0.0, LIGHT_WIND - 0.1, 0.0), (0.0, 0.0, 0.0), True),
        (Law.TO_HOVER, STRONG, (HELD_SPEED + 0.1, 0.0, 0.0), True),
        (Law.TO_HOVER, STRONG, (0.0, 0.0, 0.0), False),
    ],
)
def test_elsewhere_the_heading_stays_as_it_is_wanted(law, wind, v, may_turn):
    slew = held(0.4)
    for i in range(50):
        seen = view(i * TICK, 0.4, law=law, wind=wind, v=v)
        assert slew.turned(wanted(0.4), seen, may_turn=may_turn).heading == 0.4
