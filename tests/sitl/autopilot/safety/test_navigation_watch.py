"""The watch of navigation: what it raises, once, and when that is over."""

import math

import pytest

from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.watches import BACK_TIME, FIRST_HELP_TIME, LASTING, NavigationWatch
from sitl.guidance.view import VehicleView

FLYING = VehicleView(0.0, (0.0, 0.0, 9.0), (0.0, 0.0, 0.0), heading=0.0, tilt=0.0, landed=False, battery_remaining=1.0)
TIMEOUT = 2.0


def alarms(*views):
    """Texts by what is seen, one view a second."""
    watch = NavigationWatch()
    return [[a.reason for a in watch.check(FLYING._replace(time=float(t), **seen), TIMEOUT)] for t, seen in
            enumerate(views)]  # fmt: skip


@pytest.fixture
def watch():
    watch = NavigationWatch()
    watch.check(FLYING, TIMEOUT)
    return watch


def look(watch, time, **seen):
    return watch.check(FLYING._replace(time=time, **seen), TIMEOUT)


def test_a_position_without_aid_asks_for_a_landing_once(watch):
    assert look(watch, 1.0, position_age=TIMEOUT) == []
    (alarm,) = look(watch, 1.1, position_age=2.1)
    assert (alarm.action, alarm.reason) == (SafetyAction.LAND, "No position for 2 s")
    assert watch.lost
    assert look(watch, 1.2, position_age=2.2) == []
    (alarm,) = look(watch, 1.3, position_age=0.1)
    assert (alarm.action, alarm.reason) == (None, "Position is back")
    assert not watch.lost


def test_a_flight_that_begins_in_the_air_waits_for_the_first_aid(watch):
    assert look(watch, 1.9, position_age=math.inf) == []
    assert [alarm.action for alarm in look(watch, 2.1, position_age=math.inf)] == [SafetyAction.LAND]


def test_instruments_have_a_second_to_help_before_the_flight_is_without_them(watch):
    assert look(watch, FIRST_HELP_TIME - 0.1, unfused=("barometer",)) == []
    assert [alarm.reason for alarm in look(watch, FIRST_HELP_TIME, unfused=("barometer",))] == [
        "Flying without barometer"
    ]


def test_other_instruments_are_only_said():
    seen = alarms({}, {"unfused": ("barometer",)}, {"unfused": ("barometer", "magnetometer")}, {})
    assert seen == [[], ["Flying without barometer"], ["Flying without magnetometer"], []]


def test_an_instrument_that_comes_and_goes_is_said_once(watch):
    look(watch, 1.0, unfused=("barometer",))
    for time in (1.5, 2.0, 2.5):
        assert look(watch, time) == look(watch, time + 0.2, unfused=("barometer",)) == []
    (alarm,) = look(watch, 2.7 + BACK_TIME)
    assert (alarm.action, alarm.reason) == (None, "Barometer is back")


def test_one_correction_is_said_and_a_second_one_soon_after_is_not_believed(watch):
    assert [alarm.action for alarm in look(watch, 1.0, resets=1)] == [None]
    (alarm,) = look(watch, 3.0, resets=2)
    assert (alarm.action, alarm.reason) == (SafetyAction.LAND, "Position readings contradict each other")
    assert look(watch, 4.0, resets=3) == []
    assert [alarm.reason for alarm in look(watch, 4.1 + LASTING, resets=3)] == ["Position is back"]


def test_corrections_far_apart_are_each_said(watch):
    look(watch, 1.0, resets=1)
    assert [alarm.action for alarm in look(watch, 1.0 + LASTING, resets=2)] == [None]
    assert not watch.lost
