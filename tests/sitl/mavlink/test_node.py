"""The vehicle on MAVLink, byte for byte, without a socket: good requests, bad ones, and determinism."""

import math
from dataclasses import replace

import pytest

from protocol.dialect import mavlink
from protocol.engines.table_values import Parameter, decode_value
from protocol.frames import LocalFrame
from protocol.names import Mode, custom_mode
from protocol.plans import load
from sitl.errors import SitlError
from sitl.tools.persistence import StateFolder
from sitl.vehicle.parameters import WorldSettings
from tests.support.paths import DATA
from tests.support.vehicle.fake_station import HOME, NAN, FakeStation


@pytest.fixture
def ground(tmp_path):
    return FakeStation.with_vehicle(tmp_path)


@pytest.fixture
def airborne(tmp_path):
    return FakeStation.with_vehicle(tmp_path, up=3.0)


@pytest.mark.long
def test_a_whole_mission_from_upload_to_disarming(ground):
    assert ground.upload(load(DATA / "square.plan").items) == mavlink.MAV_MISSION_ACCEPTED
    assert ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == mavlink.MAV_RESULT_ACCEPTED
    assert ground.command(mavlink.MAV_CMD_MISSION_START) == mavlink.MAV_RESULT_ACCEPTED
    ground.advance(45.0)
    reached = [m.seq for m in ground.heard if m.get_type() == "MISSION_ITEM_REACHED"]
    assert reached == [0, 1, 2, 3, 4, 5]
    assert not ground.last("HEARTBEAT").base_mode & mavlink.MAV_MODE_FLAG_SAFETY_ARMED
    assert ground.last("EXTENDED_SYS_STATE").landed_state == mavlink.MAV_LANDED_STATE_ON_GROUND
    position = ground.last("LOCAL_POSITION_NED")
    assert math.hypot(position.x, position.y) < 0.3


def test_an_unknown_command_is_unsupported(ground):
    assert ground.command(31010) == mavlink.MAV_RESULT_UNSUPPORTED


@pytest.mark.parametrize(
    ("command", "params", "result"),
    [
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (7,), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_COMPONENT_ARM_DISARM, (NAN,), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_NAV_LAND, (), mavlink.MAV_RESULT_TEMPORARILY_REJECTED),
        (mavlink.MAV_CMD_MISSION_START, (), mavlink.MAV_RESULT_TEMPORARILY_REJECTED),
        (mavlink.MAV_CMD_DO_SET_MODE, (1, 99, 99), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_DO_SET_MODE, (NAN, 4, 3), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (NAN,), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_DO_SET_MISSION_CURRENT, (math.inf,), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_MISSION_START, (math.inf,), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_DO_CHANGE_SPEED, (1, 50), mavlink.MAV_RESULT_DENIED),
        (mavlink.MAV_CMD_DO_REPOSITION, (-1, 1, 0, NAN, 43.0, 1.0, 9.0), mavlink.MAV_RESULT_COMMAND_INT_ONLY),
    ],
)
def test_a_bad_command_gets_its_result_and_changes_nothing(ground, command, params, result):
    autopilot = ground.node.aircraft.autopilot
    before = (autopilot.mode, autopilot.armed, autopilot.flying, autopilot.reference.heading)
    assert ground.command(command, *params) == result
    assert (autopilot.mode, autopilot.armed, autopilot.flying, autopilot.reference.heading) == before


def reposition(frame, latitude, longitude, z):
    return mavlink.MAVLink_command_int_message(
        1, 1, frame, mavlink.MAV_CMD_DO_REPOSITION, 0, 0, NAN, 1, NAN, NAN, latitude, longitude, z
    )


def test_go_to_flies_there_and_out_of_the_arena_is_denied(airborne):
    point = LocalFrame(HOME).to_geodetic((4.0, -3.0, 0.0))
    place = (round(point.lat_deg * 1e7), round(point.lon_deg * 1e7))
    airborne.send(reposition(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, *place, 5.0))
    assert airborne.last("COMMAND_ACK").result == mavlink.MAV_RESULT_ACCEPTED
    airborne.advance(12.0)
    assert airborne.vehicle.truth.body.position == pytest.approx((4.0, 3.0, 5.0), abs=0.2)
    airborne.send(reposition(mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, place[0] + 10_000_000, place[1], 5.0))
    assert airborne.last("COMMAND_ACK").result == mavlink.MAV_RESULT_DENIED
    assert "arena" in airborne.texts()
    airborne.send(reposition(mavlink.MAV_FRAME_LOCAL_OFFSET_NED, *place, 5.0))
    assert airborne.last("COMMAND_ACK").result == 9  # MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME


def test_streamed_setpoints_are_followed_in_offboard(airborne):
    def setpoint(x, mask=0b0000_1101_1111_1000):
        return mavlink.MAVLink_set_position_target_local_ned_message(
            0, 1, 1, mavlink.MAV_FRAME_LOCAL_NED, mask, x, 0, -3, 0, 0, 0, 0, 0, 0, 0, 0
        )

    airborne.send(setpoint(2.0))
    main, sub = Mode.OFFBOARD.value
    assert airborne.command(mavlink.MAV_CMD_DO_SET_MODE, 1, main, sub) == mavlink.MAV_RESULT_ACCEPTED
    for _ in range(60):
        airborne.send(setpoint(2.0))
        airborne.advance(0.1)
    assert airborne.vehicle.truth.body.position.x == pytest.approx(2.0, abs=0.2)
    assert airborne.last("HEARTBEAT").custom_mode == custom_mode(Mode.OFFBOARD)
    airborne.send(setpoint(math.nan))
    airborne.send(setpoint(1e6))
    airborne.send(setpoint(1.0, mask=0))
    airborne.send(setpoint(1.0, mask=0b0000_1101_1111_1111))
    assert "not a number" in airborne.texts()
    assert "arena" in airborne.texts()
    airborne.advance(1.0)
    assert airborne.last("HEARTBEAT").custom_mode == custom_mode(Mode.HOLD)


def test_a_stream_of_bad_setpoints_is_complained_about_now_and_then(airborne):
    for _ in range(40):
        airborne.send(
            mavlink.MAVLink_set_position_target_local_ned_message(
                0, 1, 1, mavlink.MAV_FRAME_BODY_NED, 0b0000_1101_1111_1000, 1, 0, -3, 0, 0, 0, 0, 0, 0, 0, 0
            )
        )
        airborne.advance(0.1)
    assert airborne.texts().count("Set-point refused") == 1


def test_a_refused_mission_leaves_the_old_one_flying(ground):
    good = load(DATA / "square.plan").items
    ground.upload(good)
    bad = [*good[:2], replace(good[2], x=436_000_000)]
    assert ground.upload(bad) == mavlink.MAV_MISSION_INVALID
    assert "item 2" in ground.texts()
    assert len(ground.node.aircraft.autopilot.mission.items) == len(good)


def test_parameters_take_effect_are_stored_and_bad_ones_refused(ground, tmp_path):
    def put(name, value, kind=mavlink.MAV_PARAM_TYPE_REAL32):
        ground.send(mavlink.MAVLink_param_set_message(1, 1, name, value, kind))
        return ground.last("PARAM_VALUE")

    assert put(b"SIM_WIND_SPD", 4.0).param_value == 4.0
    assert ground.vehicle.wind == pytest.approx((-4.0, 0.0, 0.0))
    assert put(b"SIM_WIND_SPD", -1.0).param_value == 4.0
    assert put(b"SIM_WIND_SPD", NAN).param_value == 4.0
    assert put(b"DRK_VF_ENTER", 300.0).param_value == 5.0
    assert "hysteresis" in ground.texts()
    assert StateFolder(tmp_path).parameters() == {"SIM_WIND_SPD": 4.0}


@pytest.mark.parametrize(("value", "in_force"), [(7.0, 7.0), (1e6, 2.5)])
def test_a_value_is_checked_once_from_its_request_until_it_is_in_force(ground, monkeypatch, value, in_force):
    checked, flaw = [], Parameter.flaw
    monkeypatch.setattr(Parameter, "flaw", lambda row, number: checked.append((row.name, number)) or flaw(row, number))
    ground.set_parameter("MIS_TAKEOFF_ALT", value)
    assert checked == [("MIS_TAKEOFF_ALT", value)]
    assert ground.node.aircraft.configuration.value("MIS_TAKEOFF_ALT") == in_force


@pytest.mark.parametrize(("name", "value"), [(b"DRK_V_ENTER", 60.0), (b"DRK_VF_ENTER", 300.0), (b"GF_ACTION", 4.0)])
def test_a_value_that_does_not_fit_the_others_is_answered_once_by_the_value_in_force(ground, tmp_path, name, value):
    ground.set_parameter("DRK_V_LEAVE", 50.0)
    in_force = ground.node.aircraft.configuration
    before, errors = len(ground.all("PARAM_VALUE")), len(ground.all("PARAM_ERROR"))
    ground.set_parameter(name.decode(), value)
    ground.advance(0.5)
    (answer,) = ground.all("PARAM_VALUE")[before:]
    assert decode_value(answer.param_value, answer.param_type) == in_force.value(name.decode())
    assert len(ground.all("PARAM_ERROR")) == errors + 1
    assert ground.node.aircraft.configuration == in_force
    assert f"{name.decode()} = {value:g} refused: " in ground.texts()
    assert StateFolder(tmp_path).parameters() == {"DRK_V_LEAVE": 50.0}


def test_a_mission_survives_a_restart(ground, tmp_path):
    items = load(DATA / "square.plan").items
    ground.upload(items)
    again = FakeStation.with_vehicle(tmp_path)
    assert again.node.aircraft.autopilot.mission.items == items


@pytest.mark.parametrize("data", [b"", b"\xfd", b"\xfd" * 300, bytes(range(256)), b"GET / HTTP/1.1\r\n\r\n"])
def test_garbage_changes_nothing(airborne, data):
    before = airborne.vehicle.flight
    airborne.node.receive(data, "stranger", 0.0)
    assert airborne.vehicle.flight == before
    assert "stranger" not in {peer for peer, _ in airborne.node.datagrams(0.0)}


def flight(folder, seed):
    ground = FakeStation.with_vehicle(folder, seed=seed, world_settings=WorldSettings(gusts=1.0))
    ground.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1)
    ground.command(mavlink.MAV_CMD_NAV_TAKEOFF)
    ground.advance(8.0)
    return ground.vehicle.flight


@pytest.mark.long
def test_same_seed_and_commands_fly_bit_for_bit_the_same(tmp_path):
    assert flight(tmp_path / "a", 3) == flight(tmp_path / "b", 3)
    assert flight(tmp_path / "a", 3) != flight(tmp_path / "c", 4)


def test_damaged_state_files_are_named(tmp_path):
    (tmp_path / "mission.plan").write_text("{nonsense")
    with pytest.raises(SitlError, match=r"mission\.plan"):
        StateFolder(tmp_path).mission()
    (tmp_path / "parameters.json").write_text('{"A": "x"}')
    with pytest.raises(SitlError, match=r"parameters\.json: A is 'x'"):
        StateFolder(tmp_path).parameters()
