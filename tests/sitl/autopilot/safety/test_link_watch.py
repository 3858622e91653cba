"""The links to ground stations and to the companion computer: each is watched, and its loss reported once."""

import pytest

from protocol.dialect import mavlink
from protocol.names.modes import Mode
from protocol.wire.codec import Codec
from protocol.wire.keyring import Keyring
from protocol.wire.signing import Signature, sign_frame
from sitl.autopilot.answers import SafetyAction
from sitl.autopilot.settings import Settings
from sitl.autopilot.watches import LinkSilence, LinkWatches
from sitl.mavlink.node import Node
from tests.support.vehicle.fake_station import PEER, Bench

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
