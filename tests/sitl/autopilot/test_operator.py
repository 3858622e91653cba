"""Several ground stations on one vehicle: one in control, the others refused in words, and control handed over."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.base import Peer
from protocol.engines.operator import OperatorControl
from protocol.modes import Mode
from sitl.autopilot.settings import Settings
from tests.support.link import plan
from tests.support.station import Sky

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
FAILED = mavlink.MAV_RESULT_FAILED
REQUEST_CONTROL = mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
NOT_IN_CONTROL = mavlink.MAV_RESULT_NOT_IN_CONTROL
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
REQUEST, RELEASE, LET_OTHERS = (1, 0, 10), (0, 0, 0), (1, 1, 10)  # action, takeover, time-out [s]


@pytest.fixture
def pair(tmp_path):
    """Two stations, the first of which armed the vehicle and is in control by that."""
    sky = Sky(tmp_path, settings=Settings(one_operator=2))
    first, second = sky.station(255, "main"), sky.station(245, "second")
    second.beat()
    assert first.command(ARM, 1) == ACCEPTED
    return sky, first, second


def test_while_nobody_is_in_control_everyone_may_steer(tmp_path):
    sky = Sky(tmp_path)
    first, second = sky.station(255, "main"), sky.station(245, "second")
    assert first.upload(plan(0)) == second.upload(plan(0)) == mavlink.MAV_MISSION_ACCEPTED
    assert first.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED
    assert "in control" not in first.texts()


def test_arming_takes_control_where_the_parameter_says_so(pair):
    _, first, second = pair
    assert "Ground station 255 is in control: armed" in first.texts()
    assert second.command(ARM, 0) == NOT_IN_CONTROL


@pytest.mark.parametrize("kind", ["command", "plan", "part of a plan", "clear", "parameter", "sticks"])
def test_others_are_refused_with_the_protocols_own_word(pair, kind):
    sky, first, second = pair
    before = sky.autopilot.settings
    if kind == "command":
        assert second.command(ARM, 0) == NOT_IN_CONTROL
    elif kind == "plan":
        assert second.upload(plan(2), 1) == mavlink.MAV_MISSION_DENIED
        assert second.last("MISSION_ACK").mission_type == 1
    elif kind == "part of a plan":
        second.send(mavlink.MAVLink_mission_write_partial_list_message(1, 1, 0, 0, 2))
        assert (second.last("MISSION_ACK").type, second.last("MISSION_ACK").mission_type) == (14, 2)
    elif kind == "clear":
        second.send(mavlink.MAVLink_mission_clear_all_message(1, 1, 255))
        assert (second.last("MISSION_ACK").type, second.last("MISSION_ACK").mission_type) == (14, 255)
    elif kind == "parameter":
        second.send(mavlink.MAVLink_param_set_message(1, 1, b"MIS_TAKEOFF_ALT", 9.0, 9))
        assert second.last("PARAM_ERROR").error == mavlink.MAV_PARAM_ERROR_PERMISSION_DENIED
    else:
        second.send(mavlink.MAVLink_manual_control_message(1, 1000, 0, 500, 0, 0))
        assert first.mode(Mode.POSCTL) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert sky.autopilot.armed
    assert sky.autopilot.settings == before
    assert first.texts().count("Ground station 245 refused: 255 is in control") == 1


def test_a_flood_of_refused_commands_is_spoken_of_once(pair):
    _, first, second = pair
    for _ in range(30):
        assert second.command(ARM, 0) == NOT_IN_CONTROL
    assert first.texts().count("245 refused") == 1


def test_asking_for_what_is_only_told_is_free(pair):
    _, _, second = pair
    assert second.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == ACCEPTED
    second.send(mavlink.MAVLink_param_request_read_message(1, 1, b"RTL_RETURN_ALT", -1))
    assert second.last("PARAM_VALUE").param_id == "RTL_RETURN_ALT"
    second.send(mavlink.MAVLink_mission_request_list_message(1, 1))
    assert second.last("MISSION_COUNT").count == 0


def test_control_is_handed_over_when_the_one_in_control_gives_it_back(pair):
    _, first, second = pair
    assert second.command(REQUEST_CONTROL, *REQUEST) == FAILED
    asked = first.last("COMMAND_LONG")
    assert (asked.command, asked.target_system) == (REQUEST_CONTROL, 255)
    assert (asked.param1, asked.param2, asked.param3, asked.param4) == (1.0, 0.0, 10.0, 245.0)
    assert "Ground station 245 asks 255 for control" in first.texts()
    assert first.command(REQUEST_CONTROL, *RELEASE) == ACCEPTED
    assert second.command(REQUEST_CONTROL, *REQUEST) == ACCEPTED
    assert first.command(ARM, 0) == NOT_IN_CONTROL
    assert second.command(ARM, 0) == ACCEPTED


def test_control_is_taken_where_the_one_in_control_lets_others_take_it(pair):
    _, first, second = pair
    assert first.command(REQUEST_CONTROL, *LET_OTHERS) == ACCEPTED
    assert second.command(REQUEST_CONTROL, *REQUEST) == ACCEPTED
    assert first.command(ARM, 0) == NOT_IN_CONTROL
    assert first.command(REQUEST_CONTROL, *REQUEST) == FAILED  # taking it did not pass that on


@pytest.mark.parametrize(
    "wish",
    [(0, 1, 1, 30), (1, 1, 30, 255), (1, 1, 30, 0), (1, 1, 30)],
    ids=["older order", "with its own id", "with no id", "with NaN"],
)
def test_both_orders_of_the_parameters_are_understood(pair, wish):
    sky, first, second = pair
    assert first.command(REQUEST_CONTROL, *wish) == ACCEPTED
    assert sky.node._endpoint.operator.takeover
    assert first.command(REQUEST_CONTROL, 0, 0, 0, 255) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED


def test_only_who_is_in_control_can_give_it_back(pair):
    _, first, second = pair
    assert second.command(REQUEST_CONTROL, *RELEASE) == NOT_IN_CONTROL
    assert second.command(REQUEST_CONTROL, math.nan) == DENIED
    assert first.command(ARM, 0) == ACCEPTED


def test_control_by_arming_ends_with_disarming_and_control_asked_for_does_not(pair):
    sky, first, second = pair
    assert first.command(ARM, 0) == ACCEPTED
    sky.advance(0.1)
    assert second.command(REQUEST_CONTROL, *REQUEST) == ACCEPTED
    assert second.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED
    sky.advance(0.1)
    assert first.command(ARM, 1) == NOT_IN_CONTROL


def test_a_silent_station_loses_control(pair):
    sky, first, second = pair
    sky.advance(6.0)
    first.beat()
    sky.advance(9.0)
    assert second.command(mavlink.MAV_CMD_NAV_TAKEOFF) == NOT_IN_CONTROL
    sky.advance(2.0)
    assert "No ground station is in control: silent for 10 s" in second.texts()
    assert second.command(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED


def test_the_vehicles_own_companion_is_never_refused(pair):
    sky, *_ = pair
    companion = sky.station(1, "companion")
    assert companion.command(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED


def test_one_station_at_a_time_is_a_parameter(tmp_path):
    sky = Sky(tmp_path, settings=Settings(one_operator=0))
    first, second = sky.station(255, "main"), sky.station(245, "second")
    assert first.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED


def test_the_timer_of_a_silent_station_falls_due_exactly():
    engine = OperatorControl(1, 1)
    assert engine.next_deadline() == math.inf
    engine.armed(Peer(255, 190), 5.0)
    engine.handle_timer(engine.next_deadline())
    assert engine.holder is None
    assert engine.next_deadline() == math.inf
