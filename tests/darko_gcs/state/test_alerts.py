"""Reasons to call the pilot: each once, and again only after it was gone for a while."""

import pytest

from darko_gcs.state.alerts import MAX_FAILURES, AlertWatch, acknowledged
from darko_gcs.state.message_log import add_line
from darko_gcs.state.values import Simulator
from darko_gcs.tui.widgets.status_bar import StatusBar
from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from tests.support.gcs.screens import panel_text
from tests.support.gcs.snapshots import HOVERING, HYBRID_HOVER, snapshot_with


def with_law(law):
    return snapshot_with(HOVERING, hybrid={"state": HYBRID_HOVER._replace(law=law)})


def charged(share):
    return snapshot_with(
        HOVERING, battery={"battery_status": HOVERING.battery.battery_status._replace(charge_left=share)}
    )


REASONS = {
    "link": snapshot_with(HOVERING, link={"lost": True}),
    "failsafe": snapshot_with(HOVERING, status={"critical": True}),
    "crash": with_law(Law.CRASHED),
    "battery": charged(0.15),
    "estimator": snapshot_with(HOVERING, estimates={"test_ratio": 1.5}),
    "failure": add_line(HOVERING, 1.0, mavlink.MAV_SEVERITY_CRITICAL, "Left motor failed"),
}


def seen(watch, shots):
    """The kinds of the alerts after looks at (time, snapshot)."""
    kept = ()
    for now, s in shots:
        kept = watch.look(s._replace(session=s.session._replace(alerts=kept)), now).session.alerts
    return [alert.kind for alert in kept]


@pytest.mark.parametrize("kind", REASONS)
def test_each_reason_calls_once(kind):
    assert seen(AlertWatch(), [(0.1 * k, REASONS[kind]) for k in range(200)]) == [kind]


def test_a_crash_calls_once_in_the_vehicle_s_words_whatever_else_follows_from_it():
    told = add_line(REASONS["failsafe"], 1.0, mavlink.MAV_SEVERITY_CRITICAL, "Crashed at 18.0 m/s")
    doubting = {"estimates": {"test_ratio": 9.0}, "status": {"critical": True}}
    crashed = snapshot_with(with_law(Law.CRASHED), **doubting)._replace(log=told.log)
    shots = [(1.0, REASONS["failsafe"]), (1.1, told), (1.2, told), *((1.3 + 0.1 * k, crashed) for k in range(100))]
    assert seen(AlertWatch(), shots) == ["crash"]
    assert seen(AlertWatch(), [(0.1, crashed._replace(log=HOVERING.log)), (0.2, crashed)]) == ["crash"]


OTHERS = "Ground station 254 commanded: land"


def test_the_command_of_another_station_calls_once_until_it_has_been_seen():
    watch, notice = AlertWatch(), mavlink.MAV_SEVERITY_NOTICE
    s = watch.look(add_line(HOVERING, 1.0, notice, OTHERS), 1.0)
    s = watch.look(add_line(s, 2.0, notice, OTHERS), 2.0)
    assert [(alert.kind, alert.text) for alert in s.session.alerts] == [("command", OTHERS)]
    s = watch.look(add_line(acknowledged(s), 3.0, notice, OTHERS), 3.0)
    assert [alert.kind for alert in s.session.alerts] == ["command"]


def test_invented_commands_of_others_do_not_call_without_end():
    watch, s = AlertWatch(), HOVERING
    for k in range(3 * MAX_FAILURES):
        s = watch.look(add_line(s, 1.0, mavlink.MAV_SEVERITY_NOTICE, f"Ground station {k} commanded: arm"), 1.0)
        s = s if k < MAX_FAILURES else acknowledged(s)
    assert s.session.alerts == ()


def test_nothing_calls_in_a_good_flight():
    assert seen(AlertWatch(), [(0.1 * k, HOVERING) for k in range(200)]) == []


def test_a_silence_that_the_pilot_wanted_does_not_call():
    restarting = snapshot_with(REASONS["link"], session={"simulator": Simulator.STARTING})
    assert seen(AlertWatch(), [(0.1 * k, restarting) for k in range(50)]) == []


def test_the_cause_of_a_failsafe_is_what_the_vehicle_has_said_since_it_restarted():
    old = add_line(HOVERING, 1.0, mavlink.MAV_SEVERITY_CRITICAL, "Battery: returning")
    anew = add_line(old, 2.0, mavlink.MAV_SEVERITY_NOTICE, "The vehicle restarted")
    told = add_line(anew, 3.0, mavlink.MAV_SEVERITY_WARNING, "Fence: about to be outside the fence: holding")
    texts = []
    for s in (old, anew, told):
        watch = AlertWatch()
        alerts = watch.look(watch.look(snapshot_with(s, status={"critical": True}), 4.0), 9.0).session.alerts
        texts += [alert.text for alert in alerts if alert.kind == "failsafe"]
    assert "(Battery: returning)" in texts[0]
    assert "(" not in texts[1]
    assert "(Fence: about to be outside the fence: holding)" in texts[2]


def test_a_failsafe_law_calls_too():
    assert seen(AlertWatch(), [(0.1 * k, with_law(Law.FAILSAFE)) for k in range(7)]) == ["failsafe"]


def test_a_reason_that_flickers_calls_no_second_time_and_one_that_was_gone_does():
    bad, good, watch = REASONS["link"], HOVERING, AlertWatch()
    assert seen(watch, [(0.0, bad), (1.0, good), (2.0, bad), (3.0, good)]) == ["link"]
    assert seen(watch, [(9.0, good), (10.0, bad)]) == ["link"]


def test_a_single_refused_reading_calls_nobody():
    bad = REASONS["estimator"]
    assert seen(AlertWatch(), [(0.0, bad), (1.0, bad), (1.5, HOVERING), (3.0, bad)]) == []


def test_the_vehicle_s_own_limit_of_the_battery_counts():
    low = charged(0.28)
    assert seen(AlertWatch(), [(float(k), low) for k in range(5)]) == []
    told = snapshot_with(low, parameters={"values": {"BAT_LOW_THR": 0.3}})
    assert seen(AlertWatch(), [(float(k), told) for k in range(5)]) == ["battery"]


def test_each_text_of_a_failure_calls_once_and_lesser_texts_do_not():
    watch, s = AlertWatch(), add_line(HOVERING, 0.0, mavlink.MAV_SEVERITY_ERROR, "not ready")
    shots = [(0.0, s)]
    for now, text in ((1.0, "Left motor failed"), (2.0, "GPS lost"), (3.0, "Left motor failed")):
        s = add_line(s, now, mavlink.MAV_SEVERITY_ALERT, text)
        shots.append((now, s))
    assert seen(watch, shots) == ["failure", "failure"]


@pytest.mark.parametrize("text", ["Failure injected: barometer off", "Flying without barometer"])
def test_a_warning_that_is_a_failure_calls_too(text):
    told = add_line(HOVERING, 1.0, mavlink.MAV_SEVERITY_WARNING, text)
    assert seen(AlertWatch(), [(1.0, HOVERING), (1.1, told)]) == ["failure"]


def test_the_reading_that_the_filter_refuses_is_named():
    s = snapshot_with(HOVERING, estimates={"test_ratio": 1.5, "worst_reading": "airspeed"})
    watch = AlertWatch()
    alerts = [watch.look(s, now).session.alerts for now in (0.0, 3.0)][-1]
    assert "refuses the airspeed" in alerts[0].text


def test_an_alert_whose_reason_is_gone_stays_and_is_marked_as_past():
    watch, s = AlertWatch(), HOVERING
    for now in range(30):
        s = watch.look(s._replace(link=s.link._replace(lost=5 <= now < 15)), float(now))
    assert [(alert.kind, alert.over) for alert in s.session.alerts] == [("link", 14.0)]
    assert [line.text for line in s.log.lines if "Over" in line.text] == [
        "Over: link lost: the vehicle is silent (9 s)"
    ]
    assert "!link (over)" in panel_text(StatusBar(), s, width=160)


def test_a_flood_of_texts_ends_in_silence():
    watch, s, called = AlertWatch(), HOVERING, 0
    for k in range(200):
        s = watch.look(add_line(s, float(k), mavlink.MAV_SEVERITY_ALERT, f"text {k}"), float(k))
        called += bool(s.session.alerts)
        s = acknowledged(s)
    assert called == MAX_FAILURES


def test_what_has_no_line_in_the_log_gets_one():
    watch, s = AlertWatch(), REASONS["battery"]
    for now in (0.0, 1.0, 2.0):
        s = watch.look(s, now)
    assert s.log.lines[-1].text == "Alert: battery low: 15 % left"
    assert s.log.lines[-1].severity == mavlink.MAV_SEVERITY_ALERT


def test_seen_alerts_are_gone_and_do_not_come_again_while_their_reason_lasts():
    watch = AlertWatch()
    s = acknowledged(watch.look(REASONS["link"], 0.0))
    assert s.session.alerts == ()
    assert watch.look(s, 100.0).session.alerts == ()
