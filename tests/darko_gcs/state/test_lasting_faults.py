"""Faults that last after the pilot has seen their alerts."""

import pytest

from darko_gcs.state.alerts import CALM, AlertWatch, acknowledged
from darko_gcs.state.lasting_faults import lasting_faults
from darko_gcs.state.message_log import add_line
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from tests.support.gcs.screens import panel_text
from tests.support.gcs.snapshots import HOVERING, snapshot_with

WARNING, INFO = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_INFO
PITOT = mavlink.MAV_SYS_STATUS_SENSOR_DIFFERENTIAL_PRESSURE


def told(watch, s, text):
    return watch.look(add_line(s, 1.0, WARNING, text), 1.0)


@pytest.mark.parametrize(
    ("begin", "fault", "end"),
    [
        ("Failure injected: pitot tube off", "pitot off", "Healed: pitot tube"),
        ("Failure injected: motor 1 off", "motor 1 off", "Healed: motor 1"),
        ("Failure injected: motor 1 off", "motor 1 off", "Healed: motors"),
        ("Failure injected: barometer wrong", "barometer wrong", "The vehicle restarted"),
        ("Flying without barometer", "barometer off", "Barometer is back"),
    ],
)
def test_a_failure_that_was_seen_stays_quietly_until_the_vehicle_tells_its_end(begin, fault, end):
    watch = AlertWatch()
    s = acknowledged(told(watch, watch.look(HOVERING, 0.0), begin))
    assert s.session.alerts == ()
    assert lasting_faults(s) == (fault,)
    s = told(watch, s, "Healed: something else")
    assert lasting_faults(s) == (fault,)
    assert lasting_faults(told(watch, s, end)) == ()


@pytest.mark.parametrize(
    ("begin", "end"),
    [
        ("Failure injected: motion capture off", "Healed: motion capture"),
        ("Failure injected: link off", "Link is back"),
        ("Flying without barometer", "Barometer is back"),
        ("Failure injected: motor 1 off", "The vehicle restarted"),
    ],
)
@pytest.mark.parametrize("at_once", [False, True])
def test_a_failure_that_ended_before_the_pilot_saw_it_does_not_stay(begin, end, at_once):
    """Healed some seconds later, or both told between two looks; the alert itself waits for the pilot."""
    watch = AlertWatch()
    s = watch.look(HOVERING, 0.0)
    s = add_line(s, 1.0, WARNING, begin)
    s = add_line(s if at_once else watch.look(s, 1.0), 4.0, WARNING, end)
    s = watch.look(s, 4.0)
    assert [alert.text for alert in s.session.alerts] == [begin]
    assert lasting_faults(acknowledged(s)) == ()


def test_one_that_is_injected_again_after_it_was_healed_calls_and_stays_again():
    watch, begin, end = AlertWatch(), "Failure injected: motion capture off", "Healed: motion capture"
    s = watch.look(HOVERING, 0.0)
    for _ in range(2):
        s = acknowledged(told(watch, s, begin))
        assert lasting_faults(s) == ("motion capture off",)
        s = told(watch, s, end)
        assert (s.session.alerts, lasting_faults(s)) == ((), ())
    s = watch.look(add_line(add_line(told(watch, s, begin), 2.0, WARNING, end), 2.0, WARNING, begin), 2.0)
    assert lasting_faults(acknowledged(s)) == ("motion capture off",)


def test_one_fault_that_several_texts_and_bits_tell_is_named_once():
    watch, s = AlertWatch(), snapshot_with(HOVERING, status={"unhealthy": PITOT | mavlink.MAV_SYS_STATUS_AHRS})
    assert lasting_faults(s) == ("pitot off", "!ahrs")
    for text in ("Failure injected: pitot tube off", "Flying without pitot tube"):
        s = told(watch, s, text)
    assert lasting_faults(acknowledged(s)) == ("pitot off", "!ahrs")


def test_a_doubtful_filter_that_was_seen_stays_until_its_reason_is_gone():
    watch, bad = AlertWatch(), snapshot_with(HOVERING, estimates={"test_ratio": 1.5})
    s = acknowledged(watch.look(watch.look(bad, 0.0), 3.0))
    assert lasting_faults(watch.look(s, 9.0)) == ("estimator",)
    calm = snapshot_with(s, estimates={"test_ratio": 0.5})
    assert lasting_faults(watch.look(calm, 9.0 + CALM + 1.0)) == ()


def test_a_single_event_leaves_nothing_once_it_was_seen():
    watch = AlertWatch()
    s = watch.look(add_line(HOVERING, 1.0, mavlink.MAV_SEVERITY_CRITICAL, "Motors cut: tumbling"), 1.0)
    assert s.session.alerts
    assert lasting_faults(acknowledged(s)) == ()


@pytest.mark.parametrize(("width", "words"), [(80, " pitot off +1 (i) "), (120, " pitot off, !ahrs ")])
def test_the_header_shows_what_does_not_work_as_far_as_there_is_room(width, words):
    s = snapshot_with(HOVERING, status={"unhealthy": PITOT | mavlink.MAV_SYS_STATUS_AHRS})
    bar = StatusBar()
    assert words in panel_text(bar, s, width=width, height=1)
    assert (words, "warn") in bar.draw(s, width, 1)[0]
