"""Failures that the vehicle detects in itself, and its reactions."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.wire.codec import Codec
from protocol.wire.signing import Keyring, Signature, sign_frame
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import (
    BACK_TIME,
    FIRST_HELP_TIME,
    LASTING,
    SHAKING_RATIO,
    FailureDetector,
    LinkSilence,
    LinkWatches,
    NavigationWatch,
)
from sitl.guidance.view import VehicleView
from sitl.mavlink.node import Node
from tests.support.vehicle.fake_station import PEER, Bench

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


def test_a_moment_that_shakes_is_a_failed_actuator_at_once():
    """An elevon at random: its moment changes sign too often to last."""
    enough = SHAKING_RATIO * SETTINGS.unexplained_share
    ((after, alarm),) = watch(FailureDetector(), 5.0, unexplained=(0.1, 0.1), shaking=1.01 * enough)
    assert after <= TICK
    assert (alarm.action, alarm.reason) == (SafetyAction.TERMINATE, "A motor or an elevon failed")
    assert not watch(FailureDetector(), 5.0, unexplained=(0.1, 0.1), shaking=0.99 * enough)
    assert not watch(FailureDetector(), 5.0, shaking=2.0 * enough, p=(0.0, 0.0, 0.5))


def test_a_gust_is_no_failed_actuator():
    detector = FailureDetector()
    for gust in range(10):
        assert not watch(detector, 0.9, begin=2.0 * gust, unexplained=(0.9, 0.9))
        assert not watch(detector, 1.1, begin=2.0 * gust + 0.9, unexplained=(0.1, 0.1))


def test_near_the_ground_a_moment_is_the_grounds():
    assert not watch(FailureDetector(), 5.0, unexplained=(2.0, 2.0), p=(0.0, 0.0, 0.5))


# The links to ground stations and to the companion computer: each is watched, and its loss reported once.


ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
ONBOARD_COMPUTER = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
KEY = bytes(range(32))
ACTIVE, CRITICAL = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_CRITICAL
SOON = Settings(link_action=2, link_timeout=3.0, companion_action=3, companion_timeout=2.0)


def heartbeat(kind=mavlink.MAV_TYPE_ONBOARD_CONTROLLER):
    return mavlink.MAVLink_heartbeat_message(kind, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)


def companion(bench, system=1, component=ONBOARD_COMPUTER):
    """A companion computer on a link of its own."""
    station = bench.station(system, f"companion {system}/{component}")
    station.codec = Codec(system, component)
    return station


# The companion


def test_before_its_first_heartbeat_there_is_no_companion_to_lose(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    ground = bench.station()
    bench.advance(4.0)
    assert "companion" not in ground.texts()
    assert bench.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize(
    ("action", "mode", "doing"),
    [(0, Mode.HOLD, "going on"), (1, Mode.HOLD, "holding"), (2, Mode.RTL, "returning"), (3, Mode.LAND, "landing")],
)
def test_a_lost_companion_starts_the_set_action_and_loss_and_return_are_reported_once(tmp_path, action, mode, doing):
    bench = Bench(tmp_path, up=5.0, settings=SOON._replace(companion_action=action))
    ground, aboard = bench.station(), companion(bench)
    aboard.send(heartbeat())
    bench.advance(1.8)
    assert "companion" not in ground.texts()
    bench.advance(1.0)
    assert ground.texts().count(f"No companion for 2 s: {doing}") == 1
    assert bench.autopilot.mode is mode
    aboard.send(heartbeat())
    bench.advance(0.2)
    assert ground.texts().count("Companion is back") == 1
    assert bench.autopilot.mode is mode  # the pilot decides what to do now
    bench.advance(2.5)
    assert ground.texts().count("No companion") == 2


def test_by_default_a_lost_companion_is_reported_after_5_s_and_the_flight_goes_on(tmp_path):
    bench = Bench(tmp_path, up=5.0)
    ground = bench.station()
    companion(bench).send(heartbeat())
    bench.advance(5.4)
    assert "No companion for 5 s: going on" in ground.texts()
    assert bench.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize(
    ("system", "component", "kind"),
    [
        (2, ONBOARD_COMPUTER, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),  # of another vehicle
        (1, mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_TYPE_CAMERA),
        (1, 1, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),  # with the vehicle's own ids
    ],
)
def test_another_component_is_not_taken_for_the_companion(tmp_path, system, component, kind):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    ground, other = bench.station(), companion(bench, system, component)
    companion(bench).send(heartbeat())
    for _ in range(3):
        other.send(heartbeat(kind))
        bench.advance(1.0)
    assert ground.texts().count("No companion for 2 s") == 1


@pytest.mark.parametrize("component", [mavlink.MAV_COMP_ID_PATHPLANNER, mavlink.MAV_COMP_ID_UDP_BRIDGE])
def test_any_component_of_the_vehicles_system_may_be_the_companion(tmp_path, component):
    """MAVSDK takes 195 when it is configured as a companion, MAVROS 240."""
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    ground, aboard = bench.station(), companion(bench, 1, component)
    for _ in range(3):
        aboard.send(heartbeat())
        bench.advance(1.0)
    assert "companion" not in ground.texts()
    bench.advance(1.5)
    assert "No companion for 2 s: landing" in ground.texts()


# A link that is alive does not hide another that is lost


def test_a_ground_station_does_not_hide_a_lost_companion(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    ground = bench.station()
    companion(bench).send(heartbeat())
    for _ in range(5):
        ground.beat()
        bench.advance(1.0)
    assert "No companion for 2 s: landing" in ground.texts()
    assert "No ground station" not in ground.texts()


def test_a_companion_does_not_hide_a_lost_ground_station(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    ground, aboard = bench.station(), companion(bench)
    ground.beat()
    for _ in range(5):
        aboard.send(heartbeat())
        bench.advance(1.0)
    assert "No ground station for 3 s: returning" in ground.texts()
    assert "No companion" not in ground.texts()


def test_heartbeat_is_critical_while_a_link_is_lost_and_active_when_it_is_back(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=Settings(companion_timeout=2.0))
    ground, aboard = bench.station(), companion(bench)
    states = []
    for heard in (True, False, False, True):
        if heard:
            aboard.send(heartbeat())
        bench.advance(1.5)
        states.append([m.system_status for m in ground.heard if m.get_type() == "HEARTBEAT" and m.autopilot != 8][-1])
    assert states == [ACTIVE, CRITICAL, CRITICAL, ACTIVE]


# Which ground station


def pair(folder, **settings):
    """Two stations on a hovering vehicle, the first of them in control."""
    bench = Bench(folder, up=5.0, settings=SOON._replace(control_policy=2, **settings))
    first, second = bench.station(255, PEER), bench.station(245, "second")
    first.beat()
    assert first.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    return bench, first, second


def beat_for(bench, station, seconds):
    for _ in range(seconds):
        station.beat()
        bench.advance(1.0)


def test_while_nobody_is_in_control_any_ground_station_keeps_the_link_alive(tmp_path):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    first, second = bench.station(255, PEER), bench.station(245, "second")
    first.beat()
    beat_for(bench, second, 5)
    assert "silent" not in second.texts()
    assert bench.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize("timeout", [3.0, 12.0])  # before and after silence ends its control
def test_the_loss_of_the_station_in_control_counts_though_others_are_there(tmp_path, timeout):
    bench, first, second = pair(tmp_path, link_timeout=timeout)
    beat_for(bench, second, round(timeout) + 2)
    assert second.texts().count(f"Ground station in control silent for {timeout:g} s: returning") == 1
    assert "No ground station for" not in second.texts()
    assert bench.autopilot.mode is Mode.RTL
    assert first.texts().count("silent for") == second.texts().count("silent for")


def test_after_a_takeover_the_loss_of_the_new_station_counts(tmp_path):
    bench, _, second = pair(tmp_path, link_timeout=12.0)
    beat_for(bench, second, 11)
    assert "No ground station is in control: silent for 10 s" in second.texts()
    assert second.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10) == mavlink.MAV_RESULT_ACCEPTED
    beat_for(bench, second, 4)
    assert "in control silent" not in second.texts()
    assert bench.autopilot.mode is Mode.HOLD


def test_the_loss_of_the_last_station_is_reported_as_well(tmp_path):
    bench, _, second = pair(tmp_path)
    beat_for(bench, second, 4)
    assert second.mode(Mode.HOLD) != mavlink.MAV_RESULT_ACCEPTED  # 255 is in control for 10 s
    beat_for(bench, second, 7)
    assert second.mode(Mode.HOLD) == mavlink.MAV_RESULT_ACCEPTED
    bench.advance(3.5)
    assert second.texts().count("No ground station for 3 s: returning") == 1
    assert bench.autopilot.mode is Mode.RTL


def test_a_station_that_released_control_is_no_longer_missed(tmp_path):
    bench, first, second = pair(tmp_path)
    assert first.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 0, 0, 0) == mavlink.MAV_RESULT_ACCEPTED
    beat_for(bench, second, 5)
    assert "silent" not in second.texts()
    assert bench.autopilot.mode is Mode.HOLD


# With a signing key


class Signed:
    """A sender with a key, or without one."""

    def __init__(self, bench, key, *, system=255, component=190):
        self.bench, self.key, self.codec, self.time = bench, key, Codec(system, component), 10**13

    def send(self, message):
        data = self.codec.encode(message)
        self.time += 1
        if self.key is not None:
            data = sign_frame(data, self.key, Signature(0, self.time))
        self.bench.node.receive(data, self.key, self.bench.now)


@pytest.mark.parametrize(
    ("kind", "ids", "text"),
    [
        (mavlink.MAV_TYPE_GCS, {}, "No ground station for 3 s: returning"),
        (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, {"system": 1, "component": 191}, "No companion for 2 s: landing"),
    ],
)
def test_with_a_key_unsigned_heartbeats_do_not_keep_a_link_alive(tmp_path, kind, ids, text):
    bench = Bench(tmp_path, up=5.0, settings=SOON)
    bench.node = Node(bench.aircraft, bench.node.state_folder, [PEER], Keyring({None: KEY}, timestamp=10**13))
    ground = bench.station()
    Signed(bench, KEY, **ids).send(heartbeat(kind))
    stranger, forger = Signed(bench, None, **ids), Signed(bench, bytes(32)[:-1] + b"x", **ids)
    for _ in range(5):
        stranger.send(heartbeat(kind))
        forger.send(heartbeat(kind))
        bench.advance(1.0)
    assert ground.texts().count(text) == 1


# Arming without them


def test_arming_is_refused_without_a_link_whose_loss_would_end_the_flight(tmp_path):
    bench = Bench(tmp_path, settings=SOON)
    ground, aboard = bench.station(), companion(bench)
    ground.beat()
    aboard.send(heartbeat())
    bench.advance(4.0)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "Arming refused: no ground station for 3 s; no companion for 2 s" in ground.texts()
    ground.beat()
    aboard.send(heartbeat())
    bench.advance(0.1)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert "is back" not in ground.texts()


def test_arming_is_allowed_without_a_link_whose_loss_changes_nothing(tmp_path):
    bench = Bench(tmp_path)
    ground = bench.station()
    ground.beat()
    bench.advance(11.0)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED


# Several alarms at once


def test_all_alarms_of_a_moment_name_the_gravest_action():
    alarms = LinkWatches().check(LinkSilence(ground=9.0, in_control=9.0, companion=9.0), SOON)
    assert [alarm.text(SafetyAction.LAND, SafetyAction.NONE) for alarm in alarms] == [
        "No ground station for 3 s: landing",
        "No companion for 2 s: landing",
    ]


def test_an_alarm_names_what_is_really_being_done():
    (alarm,) = LinkWatches().check(LinkSilence(ground=9.0), SOON)
    assert alarm.text(SafetyAction.RETURN, SafetyAction.LAND) == "No ground station for 3 s: landing continues"
    assert alarm.text(SafetyAction.RETURN, SafetyAction.RETURN) == "No ground station for 3 s: return continues"
    assert alarm.text(SafetyAction.RETURN, SafetyAction.HOLD) == "No ground station for 3 s: returning"


# The watch of navigation: what it raises, once, and when that is over.


FLYING = VehicleView(0.0, (0.0, 0.0, 9.0), (0.0, 0.0, 0.0), heading=0.0, tilt=0.0, landed=False, battery_remaining=1.0)
TIMEOUT = 2.0


def alarms(*views):
    """Texts by what is seen, one view a second."""
    navigation = NavigationWatch()
    return [[a.reason for a in navigation.check(FLYING._replace(time=float(t), **seen), TIMEOUT)] for t, seen in
            enumerate(views)]  # fmt: skip


@pytest.fixture
def navigation():
    navigation = NavigationWatch()
    navigation.check(FLYING, TIMEOUT)
    return navigation


def look(navigation, time, **seen):
    return navigation.check(FLYING._replace(time=time, **seen), TIMEOUT)


def test_a_position_without_aid_asks_for_a_landing_once(navigation):
    assert look(navigation, 1.0, position_age=TIMEOUT) == []
    (alarm,) = look(navigation, 1.1, position_age=2.1)
    assert (alarm.action, alarm.reason) == (SafetyAction.LAND, "No position for 2 s")
    assert navigation.lost
    assert look(navigation, 1.2, position_age=2.2) == []
    (alarm,) = look(navigation, 1.3, position_age=0.1)
    assert (alarm.action, alarm.reason) == (None, "Position is back")
    assert not navigation.lost


def test_a_flight_that_begins_in_the_air_waits_for_the_first_aid(navigation):
    assert look(navigation, 1.9, position_age=math.inf) == []
    assert [alarm.action for alarm in look(navigation, 2.1, position_age=math.inf)] == [SafetyAction.LAND]


def test_instruments_have_a_second_to_help_before_the_flight_is_without_them(navigation):
    assert look(navigation, FIRST_HELP_TIME - 0.1, unfused=("barometer",)) == []
    assert [alarm.reason for alarm in look(navigation, FIRST_HELP_TIME, unfused=("barometer",))] == [
        "Flying without barometer"
    ]


def test_other_instruments_are_only_said():
    seen = alarms({}, {"unfused": ("barometer",)}, {"unfused": ("barometer", "magnetometer")}, {})
    assert seen == [[], ["Flying without barometer"], ["Flying without magnetometer"], []]


def test_an_instrument_that_comes_and_goes_is_said_once(navigation):
    look(navigation, 1.0, unfused=("barometer",))
    for time in (1.5, 2.0, 2.5):
        assert look(navigation, time) == look(navigation, time + 0.2, unfused=("barometer",)) == []
    (alarm,) = look(navigation, 2.7 + BACK_TIME)
    assert (alarm.action, alarm.reason) == (None, "Barometer is back")


def test_one_correction_is_said_and_a_second_one_soon_after_is_not_believed(navigation):
    assert [alarm.action for alarm in look(navigation, 1.0, resets=1)] == [None]
    (alarm,) = look(navigation, 3.0, resets=2)
    assert (alarm.action, alarm.reason) == (SafetyAction.LAND, "Position readings contradict each other")
    assert look(navigation, 4.0, resets=3) == []
    assert [alarm.reason for alarm in look(navigation, 4.1 + LASTING, resets=3)] == ["Position is back"]


def test_corrections_far_apart_are_each_said(navigation):
    look(navigation, 1.0, resets=1)
    assert [alarm.action for alarm in look(navigation, 1.0 + LASTING, resets=2)] == [None]
    assert not navigation.lost
