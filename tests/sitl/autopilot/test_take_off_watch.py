"""A failed motor hinders arming, and a take-off that does not rise is given up, with its reason."""

import pytest

from protocol.dialect import mavlink
from sitl.autopilot.watches import RISE_TIME, TakeOffWatch
from sitl.guidance.view import VehicleView
from tests.support.vehicle.fake_station import make_aircraft

MOTOR, OFF, BOTH = mavlink.FAILURE_UNIT_SYSTEM_MOTOR, 1, 0
SECOND = 500  # control periods


def stuck(*, force=True, instance=BOTH):
    """An aircraft on the ground whose motors do not turn, that was told to take off."""
    aircraft = make_aircraft()
    aircraft.advance(SECOND)
    aircraft.failures.inject(MOTOR, OFF, instance)
    aircraft.advance(20)
    answer = aircraft.autopilot.arming.arm(force=force)
    aircraft.autopilot.guided.take_off(5.0)
    return aircraft, answer


@pytest.mark.parametrize(
    ("instance", "reasons"), [(1, "motor 1 has failed"), (BOTH, "motor 1 has failed; motor 2 has failed")]
)
def test_a_failed_motor_hinders_arming(instance, reasons):
    aircraft, answer = stuck(force=False, instance=instance)
    assert answer.text == f"Arming refused: {reasons}"
    assert aircraft.autopilot.arming.failed_checks()
    aircraft.failures.inject(MOTOR, 0)
    aircraft.advance(20)
    assert aircraft.autopilot.arming.failed_checks() == []


def test_a_take_off_that_does_not_rise_is_given_up_with_an_error():
    aircraft, _ = stuck()
    aircraft.advance(8 * SECOND)
    assert aircraft.autopilot.armed
    aircraft.advance(2 * SECOND)
    assert not aircraft.autopilot.armed
    (error,) = [n for n in aircraft.autopilot.notices() if n.severity == mavlink.MAV_SEVERITY_ERROR]
    assert error.text == "Take-off given up: 0.0 m up after 9 s, motor 1 has failed, motor 2 has failed"


def test_before_it_has_risen_it_is_disarmed_without_force_and_not_in_the_air():
    aircraft, _ = stuck()
    aircraft.advance(2 * SECOND)
    assert not aircraft.autopilot.view.landed
    assert aircraft.autopilot.arming.disarm().accepted
    assert [n.text for n in aircraft.autopilot.notices()][-1] == "Disarmed"


def test_a_take_off_that_rises_is_flown_and_not_disarmed_without_force():
    aircraft = make_aircraft()
    aircraft.advance(SECOND)
    aircraft.autopilot.arming.arm()
    aircraft.autopilot.guided.take_off(1.5)
    aircraft.advance(15 * SECOND)
    assert aircraft.autopilot.flying
    assert not aircraft.autopilot.arming.disarm().accepted


def seen(time, up, *, landed=False):
    return VehicleView(time, (0.0, 0.0, up), (0.0, 0.0, 0.0), 0.0, 0.0, landed=landed, battery_remaining=1.0)


def test_time_counts_from_when_it_is_to_rise_and_a_slow_climb_has_longer():
    for rate in (0.1, 1.0):
        watch, limit = TakeOffWatch(), RISE_TIME + 1.0 / rate
        watch.check(seen(0.0, 0.1, landed=True), 0.1, rate)
        assert watch.check(seen(100.0, 0.1), 0.1, rate) == ""  # it is not to rise yet
        assert watch.check(seen(100.5, 0.1), 5.0, rate) == ""
        assert watch.check(seen(100.4 + limit, 0.3), 5.0, rate) == ""
        assert watch.check(seen(100.6 + limit, 0.3), 5.0, rate) == f"0.2 m up after {limit:.0f} s"


def test_a_low_take_off_has_risen_at_a_share_of_its_height():
    watch = TakeOffWatch()
    watch.check(seen(0.0, 0.1, landed=True), 0.1, 1.0)
    watch.check(seen(1.0, 0.45), 0.6, 1.0)
    assert watch.has_risen
