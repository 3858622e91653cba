"""Several ground stations on one vehicle: one in control, the others refused, and control handed over."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.engines.server.operator_control import OperatorControl
from protocol.names import Mode
from protocol.wire.message import Peer
from sitl.autopilot.settings import Settings
from tests.support.links.link import plan
from tests.support.vehicle.fake_station import PEER, Bench

ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
FAILED = mavlink.MAV_RESULT_FAILED
REQUEST_CONTROL = mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL
NOT_IN_CONTROL = mavlink.MAV_RESULT_NOT_IN_CONTROL
ARM = mavlink.MAV_CMD_COMPONENT_ARM_DISARM
REQUEST, RELEASE, LET_OTHERS = (1, 0, 10), (0, 0, 0), (1, 1, 10)  # action, takeover, time-out [s]


@pytest.fixture
def pair(tmp_path):
    """Two stations; the first has armed the vehicle and is in control by that."""
    bench = Bench(tmp_path, settings=Settings(control_policy=2))
    first, second = bench.station(255, PEER), bench.station(245, "second")
    second.beat()
    assert first.command(ARM, 1) == ACCEPTED
    return bench, first, second


def test_while_nobody_is_in_control_everyone_may_command(tmp_path):
    bench = Bench(tmp_path)
    first, second = bench.station(255, PEER), bench.station(245, "second")
    assert first.upload(plan(0)) == second.upload(plan(0)) == mavlink.MAV_MISSION_ACCEPTED
    assert first.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED
    assert "in control" not in first.texts()


def test_arming_takes_control_if_the_parameter_says_so(pair):
    _, first, second = pair
    assert "Ground station 255 is in control: armed" in first.texts()
    assert second.command(ARM, 0) == NOT_IN_CONTROL


@pytest.mark.parametrize("kind", ["command", "plan", "part of a plan", "clear", "parameter", "sticks"])
def test_other_stations_are_refused_by_each_service(pair, kind):
    bench, first, second = pair
    before = bench.autopilot.settings
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
    assert bench.autopilot.armed
    assert bench.autopilot.settings == before
    assert first.texts().count("Ground station 245 refused: 255 is in control") == 1


def test_a_flood_of_refused_commands_is_reported_once(pair):
    _, first, second = pair
    for _ in range(30):
        assert second.command(ARM, 0) == NOT_IN_CONTROL
    assert first.texts().count("245 refused") == 1


def test_other_stations_may_read(pair):
    _, _, second = pair
    assert second.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == ACCEPTED
    second.send(mavlink.MAVLink_param_request_read_message(1, 1, b"RTL_RETURN_ALT", -1))
    assert second.last("PARAM_VALUE").param_id == "RTL_RETURN_ALT"
    second.send(mavlink.MAVLink_mission_request_list_message(1, 1))
    assert second.last("MISSION_COUNT").count == 0


def test_control_is_handed_over_when_the_station_in_control_releases_it(pair):
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


def test_control_is_taken_if_the_station_in_control_allows_it(pair):
    _, first, second = pair
    assert first.command(REQUEST_CONTROL, *LET_OTHERS) == ACCEPTED
    assert second.command(REQUEST_CONTROL, *REQUEST) == ACCEPTED
    assert first.command(ARM, 0) == NOT_IN_CONTROL
    assert first.command(REQUEST_CONTROL, *REQUEST) == FAILED  # the permission ended with the takeover


@pytest.mark.parametrize(
    "wish",
    [(0, 1, 1, 30), (1, 1, 30, 255), (1, 1, 30, 0), (1, 1, 30)],
    ids=["older order", "with its own id", "with no id", "with NaN"],
)
def test_both_orders_of_the_parameters_are_understood(pair, wish):
    bench, first, second = pair
    assert first.command(REQUEST_CONTROL, *wish) == ACCEPTED
    assert bench.node.endpoint.operator.takeover
    assert first.command(REQUEST_CONTROL, 0, 0, 0, 255) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED


def test_only_the_station_in_control_can_release_it(pair):
    _, first, second = pair
    assert second.command(REQUEST_CONTROL, *RELEASE) == NOT_IN_CONTROL
    assert second.command(REQUEST_CONTROL, math.nan) == DENIED
    assert first.command(ARM, 0) == ACCEPTED


def test_control_by_arming_ends_with_disarming_and_requested_control_does_not(pair):
    bench, first, second = pair
    assert first.command(ARM, 0) == ACCEPTED
    bench.advance(0.1)
    assert second.command(REQUEST_CONTROL, *REQUEST) == ACCEPTED
    assert second.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED
    bench.advance(0.1)
    assert first.command(ARM, 1) == NOT_IN_CONTROL


@pytest.mark.long
def test_a_silent_station_loses_control(pair):
    bench, first, second = pair
    bench.advance(6.0)
    first.beat()
    bench.advance(9.0)
    assert second.command(mavlink.MAV_CMD_NAV_TAKEOFF) == NOT_IN_CONTROL
    bench.advance(2.0)
    assert "No ground station is in control: silent for 10 s" in second.texts()
    assert second.command(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED


def test_the_vehicles_own_companion_is_never_refused(pair):
    bench, *_ = pair
    companion = bench.station(1, "companion")
    assert companion.command(mavlink.MAV_CMD_NAV_TAKEOFF) == ACCEPTED


def test_a_parameter_lets_everyone_command(tmp_path):
    bench = Bench(tmp_path, settings=Settings(control_policy=0))
    first, second = bench.station(255, PEER), bench.station(245, "second")
    assert first.command(ARM, 1) == ACCEPTED
    assert second.command(ARM, 0) == ACCEPTED


def test_the_timer_of_a_silent_station_expires_exactly():
    engine = OperatorControl(1, 1)
    assert engine.next_deadline() == math.inf
    engine.armed(Peer(255, 190), 5.0)
    engine.handle_timer(engine.next_deadline())
    assert engine.holder is None
    assert engine.next_deadline() == math.inf
