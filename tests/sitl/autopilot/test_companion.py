"""Two links beside the pilot's set-points, each watched for itself: the companion computer and the ground stations."""

import pytest

from protocol.codec import Codec
from protocol.dialect import mavlink
from protocol.keyring import Keyring
from protocol.modes import Mode
from protocol.signing import Signature, sign_frame
from sitl.autopilot.alarm import Action
from sitl.autopilot.link_watch import LinkWatches, Silence
from sitl.autopilot.settings import Settings
from sitl.wire.node import Node
from tests.support.station import Sky

ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
ONBOARD_COMPUTER = mavlink.MAV_COMP_ID_ONBOARD_COMPUTER
KEY = bytes(range(32))
ACTIVE, CRITICAL = mavlink.MAV_STATE_ACTIVE, mavlink.MAV_STATE_CRITICAL
SOON = Settings(link_action=2, link_timeout=3.0, companion_action=3, companion_timeout=2.0)


def heartbeat(kind=mavlink.MAV_TYPE_ONBOARD_CONTROLLER):
    return mavlink.MAVLink_heartbeat_message(kind, mavlink.MAV_AUTOPILOT_INVALID, 0, 0, 4, 3)


def companion(sky, system=1, component=ONBOARD_COMPUTER):
    """A companion of that system, on a link of its own."""
    station = sky.station(system, f"companion {system}/{component}")
    station.codec = Codec(system, component)
    return station


# The companion


def test_before_its_first_heartbeat_there_is_no_companion_to_lose(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    ground = sky.station()
    sky.advance(4.0)
    assert "companion" not in ground.texts()
    assert sky.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize(
    ("action", "mode", "said"),
    [(0, Mode.HOLD, "going on"), (1, Mode.HOLD, "holding"), (2, Mode.RTL, "returning"), (3, Mode.LAND, "landing")],
)
def test_a_lost_companion_starts_the_action_set_and_its_loss_and_return_are_said_once(tmp_path, action, mode, said):
    sky = Sky(tmp_path, up=5.0, settings=SOON._replace(companion_action=action))
    ground, aboard = sky.station(), companion(sky)
    aboard.send(heartbeat())
    sky.advance(1.8)
    assert "companion" not in ground.texts()
    sky.advance(1.0)
    assert ground.texts().count(f"No companion for 2 s: {said}") == 1
    assert sky.autopilot.mode is mode
    aboard.send(heartbeat())
    sky.advance(0.2)
    assert ground.texts().count("Companion is back") == 1
    assert sky.autopilot.mode is mode  # what to do now is the pilot's to say
    sky.advance(2.5)
    assert ground.texts().count("No companion") == 2


def test_by_default_a_lost_companion_is_said_after_5_s_and_the_flight_goes_on(tmp_path):
    sky = Sky(tmp_path, up=5.0)
    ground = sky.station()
    companion(sky).send(heartbeat())
    sky.advance(5.4)
    assert "No companion for 5 s: going on" in ground.texts()
    assert sky.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize(
    ("system", "component", "kind"),
    [
        (2, ONBOARD_COMPUTER, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),  # of another vehicle
        (1, mavlink.MAV_COMP_ID_CAMERA, mavlink.MAV_TYPE_CAMERA),
        (1, 1, mavlink.MAV_TYPE_ONBOARD_CONTROLLER),  # with the vehicle's own ids
    ],
)
def test_what_is_no_companion_of_this_vehicle_keeps_none_alive(tmp_path, system, component, kind):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    ground, other = sky.station(), companion(sky, system, component)
    companion(sky).send(heartbeat())
    for _ in range(3):
        other.send(heartbeat(kind))
        sky.advance(1.0)
    assert ground.texts().count("No companion for 2 s") == 1


@pytest.mark.parametrize("component", [mavlink.MAV_COMP_ID_PATHPLANNER, mavlink.MAV_COMP_ID_UDP_BRIDGE])
def test_any_component_of_the_vehicles_system_may_be_the_companion(tmp_path, component):
    """MAVSDK says 195 when it is told that it flies along, MAVROS 240."""
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    ground, aboard = sky.station(), companion(sky, 1, component)
    for _ in range(3):
        aboard.send(heartbeat())
        sky.advance(1.0)
    assert "companion" not in ground.texts()
    sky.advance(1.5)
    assert "No companion for 2 s: landing" in ground.texts()


# Neither hides the other


def test_a_ground_station_that_is_there_hides_no_lost_companion(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    ground = sky.station()
    companion(sky).send(heartbeat())
    for _ in range(5):
        ground.beat()
        sky.advance(1.0)
    assert "No companion for 2 s: landing" in ground.texts()
    assert "No ground station" not in ground.texts()


def test_a_companion_that_is_there_hides_no_lost_ground_station(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    ground, aboard = sky.station(), companion(sky)
    ground.beat()
    for _ in range(5):
        aboard.send(heartbeat())
        sky.advance(1.0)
    assert "No ground station for 3 s: returning" in ground.texts()
    assert "No companion" not in ground.texts()


def test_heartbeat_says_critical_while_a_link_is_lost_and_active_when_it_is_back(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=Settings(companion_timeout=2.0))
    ground, aboard = sky.station(), companion(sky)
    states = []
    for heard in (True, False, False, True):
        if heard:
            aboard.send(heartbeat())
        sky.advance(1.5)
        states.append([m.system_status for m in ground.heard if m.get_type() == "HEARTBEAT" and m.autopilot != 8][-1])
    assert states == [ACTIVE, CRITICAL, CRITICAL, ACTIVE]


# Which ground station


def pair(folder, **settings):
    """Two stations on a hovering vehicle, the first of them in control."""
    sky = Sky(folder, up=5.0, settings=SOON._replace(one_operator=2, **settings))
    first, second = sky.station(255, "main"), sky.station(245, "second")
    first.beat()
    assert first.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    return sky, first, second


def watched_by(sky, station, seconds):
    for _ in range(seconds):
        station.beat()
        sky.advance(1.0)


def test_while_nobody_is_in_control_any_ground_station_keeps_the_link(tmp_path):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    first, second = sky.station(255, "main"), sky.station(245, "second")
    first.beat()
    watched_by(sky, second, 5)
    assert "silent" not in second.texts()
    assert sky.autopilot.mode is Mode.HOLD


@pytest.mark.parametrize("timeout", [3.0, 12.0])  # before and after silence ends its control
def test_the_loss_of_the_one_in_control_counts_though_others_look_on(tmp_path, timeout):
    sky, first, second = pair(tmp_path, link_timeout=timeout)
    watched_by(sky, second, round(timeout) + 2)
    assert second.texts().count(f"The ground station in control is silent for {timeout:g} s: returning") == 1
    assert "No ground station for" not in second.texts()
    assert sky.autopilot.mode is Mode.RTL
    assert first.texts().count("silent for") == second.texts().count("silent for")


def test_who_takes_over_is_the_one_whose_loss_counts_from_then_on(tmp_path):
    sky, _, second = pair(tmp_path, link_timeout=12.0)
    watched_by(sky, second, 11)
    assert "No ground station is in control: silent for 10 s" in second.texts()
    assert second.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10) == mavlink.MAV_RESULT_ACCEPTED
    watched_by(sky, second, 4)
    assert "in control is silent" not in second.texts()
    assert sky.autopilot.mode is Mode.HOLD


def test_when_the_last_one_is_lost_too_that_is_said_as_well(tmp_path):
    sky, _, second = pair(tmp_path)
    watched_by(sky, second, 4)
    assert second.mode(Mode.HOLD) != mavlink.MAV_RESULT_ACCEPTED  # 255 is in control for 10 s
    watched_by(sky, second, 7)
    assert second.mode(Mode.HOLD) == mavlink.MAV_RESULT_ACCEPTED
    sky.advance(3.5)
    assert second.texts().count("No ground station for 3 s: returning") == 1
    assert sky.autopilot.mode is Mode.RTL


def test_one_that_gave_control_back_is_no_longer_waited_for(tmp_path):
    sky, first, second = pair(tmp_path)
    assert first.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 0, 0, 0) == mavlink.MAV_RESULT_ACCEPTED
    watched_by(sky, second, 5)
    assert "silent" not in second.texts()
    assert sky.autopilot.mode is Mode.HOLD


# What is heard and not believed


class Signed:
    """A speaker with the key, or without one."""

    def __init__(self, sky, key, *, system=255, component=190):
        self.sky, self.key, self.codec, self.time = sky, key, Codec(system, component), 10**13

    def send(self, message):
        data = self.codec.encode(message)
        self.time += 1
        if self.key is not None:
            data = sign_frame(data, self.key, Signature(0, self.time))
        self.sky.node.receive(data, self.key, self.sky.now)


@pytest.mark.parametrize(
    ("kind", "ids", "said"),
    [
        (mavlink.MAV_TYPE_GCS, {}, "No ground station for 3 s: returning"),
        (mavlink.MAV_TYPE_ONBOARD_CONTROLLER, {"system": 1, "component": 191}, "No companion for 2 s: landing"),
    ],
)
def test_with_a_key_unsigned_strangers_keep_no_link_alive(tmp_path, kind, ids, said):
    sky = Sky(tmp_path, up=5.0, settings=SOON)
    sky.node = Node(sky.craft, sky.node.memory, ["main"], Keyring({None: KEY}, timestamp=10**13))
    ground = sky.station()
    Signed(sky, KEY, **ids).send(heartbeat(kind))
    stranger, forger = Signed(sky, None, **ids), Signed(sky, bytes(32)[:-1] + b"x", **ids)
    for _ in range(5):
        stranger.send(heartbeat(kind))
        forger.send(heartbeat(kind))
        sky.advance(1.0)
    assert ground.texts().count(said) == 1


# Beginning a flight without them


def test_the_motors_stay_off_without_a_link_whose_loss_would_end_the_flight(tmp_path):
    sky = Sky(tmp_path, settings=SOON)
    ground, aboard = sky.station(), companion(sky)
    ground.beat()
    aboard.send(heartbeat())
    sky.advance(4.0)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert "Arming refused: no ground station for 3 s; no companion for 2 s" in ground.texts()
    ground.beat()
    aboard.send(heartbeat())
    sky.advance(0.1)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert "is back" not in ground.texts()


def test_a_link_whose_loss_changes_nothing_keeps_no_motors_off(tmp_path):
    sky = Sky(tmp_path)
    ground = sky.station()
    ground.beat()
    sky.advance(11.0)
    assert ground.command(ARM, 1) == mavlink.MAV_RESULT_ACCEPTED


# What is said of several at once


def test_of_several_alarms_the_gravest_is_flown_and_all_say_so():
    alarms = LinkWatches().check(Silence(ground=9.0, in_control=9.0, companion=9.0), SOON)
    assert [alarm.text(Action.LAND, Action.NONE) for alarm in alarms] == [
        "No ground station for 3 s: landing",
        "No companion for 2 s: landing",
    ]


def test_an_alarm_never_says_that_something_is_done_which_is_not():
    (alarm,) = LinkWatches().check(Silence(ground=9.0), SOON)
    assert alarm.text(Action.RETURN, Action.LAND) == "No ground station for 3 s: the landing goes on"
    assert alarm.text(Action.RETURN, Action.RETURN) == "No ground station for 3 s: the return goes on"
    assert alarm.text(Action.RETURN, Action.HOLD) == "No ground station for 3 s: returning"
