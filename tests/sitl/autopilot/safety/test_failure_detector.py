"""Failures that the vehicle detects in itself, and its reactions."""

import math

import pytest

from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import FailureDetector
from sitl.guidance.view import VehicleView

TICK = 0.02
SETTINGS = Settings()
STILL = VehicleView(
    time=0.0, p=(0.0, 0.0, 20.0), v=(0.0, 0.0, 0.0), heading=0.0, tilt=0.0, landed=False, battery_remaining=1
)


def watch(detector, seconds, settings=SETTINGS, begin=0.0, **view):
    """Alarms of a time, with the time of each since its beginning."""
    raised = []
    for tick in range(1, round(seconds / TICK) + 1):
        now = begin + tick * TICK
        raised += [(now - begin, alarm) for alarm in detector.check(STILL._replace(time=now, **view), settings)]
    return raised


def rates(deg_per_s):
    return (0.0, 0.0, math.radians(deg_per_s))


def test_tumbling_for_its_time_cuts_the_motors_once():
    ((after, alarm),) = watch(FailureDetector(), 5.0, rates=rates(SETTINGS.tumble_rate + 1.0))
    assert after == pytest.approx(SETTINGS.tumble_time + TICK)
    assert alarm.action is SafetyAction.TERMINATE
    assert alarm.reason == "Tumbling at 361 deg/s"


def test_what_is_caught_in_time_is_no_failure():
    detector = FailureDetector()
    for thrown in range(10):
        tumbles, turns = 0.8 * SETTINGS.tumble_time, 1.2 * SETTINGS.tumble_time
        begin = (tumbles + turns) * thrown
        assert not watch(detector, tumbles, begin=begin, rates=rates(600.0))
        assert not watch(detector, turns, begin=begin + tumbles, rates=rates(50.0))


def test_a_tumble_with_short_breaks_adds_up():
    detector, raised = FailureDetector(), []
    for turn in range(10):
        raised += watch(detector, 0.4, begin=0.5 * turn, rates=rates(600.0))
        raised += watch(detector, 0.1, begin=0.5 * turn + 0.4, rates=rates(100.0))
    assert len(raised) == 1


def test_by_the_parameter_it_only_warns():
    ((_, alarm),) = watch(FailureDetector(), 3.0, SETTINGS._replace(detector_action=0), rates=rates(600.0))
    assert alarm.action is SafetyAction.NONE


def test_without_gyroscope_the_motors_are_cut_and_without_accelerometer_it_lands():
    detector = FailureDetector()
    ((_, blind),) = watch(detector, 1.0, gyroscope_failed=True)
    assert (blind.action, blind.reason) == (SafetyAction.TERMINATE, "Gyroscope failed")
    assert detector.is_critical
    ((_, numb),) = watch(FailureDetector(), 1.0, accelerometer_failed=True)
    assert (numb.action, numb.reason) == (SafetyAction.LAND, "Accelerometer failed")


def test_a_failure_is_reported_again_after_it_was_gone():
    detector = FailureDetector()
    watch(detector, 1.0, accelerometer_failed=True)
    watch(detector, 1.0, begin=1.0)
    assert len(watch(detector, 1.0, begin=2.0, accelerometer_failed=True)) == 1


@pytest.mark.parametrize("unexplained", [(0.9, 0.1), (0.1, 0.9)])
def test_a_moment_that_nothing_explains_for_its_time_is_a_failed_actuator(unexplained):
    ((after, alarm),) = watch(FailureDetector(), 5.0, unexplained=unexplained)
    assert after == pytest.approx(SETTINGS.unexplained_time + TICK)
    assert (alarm.action, alarm.reason) == (SafetyAction.TERMINATE, "A motor or an elevon failed")


def test_a_gust_is_no_failed_actuator():
    detector = FailureDetector()
    for gust in range(10):
        assert not watch(detector, 0.9, begin=2.0 * gust, unexplained=(0.9, 0.9))
        assert not watch(detector, 1.1, begin=2.0 * gust + 0.9, unexplained=(0.1, 0.1))


def test_near_the_ground_a_moment_is_the_grounds():
    assert not watch(FailureDetector(), 5.0, unexplained=(2.0, 2.0), p=(0.0, 0.0, 0.5))
