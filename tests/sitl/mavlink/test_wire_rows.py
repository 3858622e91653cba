"""Rows of docs/wire.md that no other test covers: messages on request, and commands by their effect."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from tests.support.vehicle.fake_station import HOME, PEER, Bench

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED


@pytest.fixture(scope="module")
def bench(tmp_path_factory):
    bench = Bench(tmp_path_factory.mktemp("state"), up=3.0)
    bench.station()
    bench.advance(1.0)
    return bench


@pytest.fixture
def untold(tmp_path):
    """A station whose vehicle has not complained yet."""
    bench = Bench(tmp_path, up=3.0)
    station = bench.station()
    bench.advance(1.0)
    return station


@pytest.fixture
def station(bench):
    station = bench.stations[PEER]
    station.heard.clear()
    return station


MESSAGES = {
    "GPS_RAW_INT": lambda m: m.fix_type == 6 and m.lat == pytest.approx(HOME.lat_deg * 1e7, abs=50),
    "POSITION_TARGET_LOCAL_NED": lambda m: m.z == pytest.approx(-3.0, abs=0.1),
    "VFR_HUD": lambda m: m.alt == pytest.approx(HOME.alt + 3.0, abs=0.2) and 0 < m.throttle < 100,
    "BATTERY_STATUS": lambda m: m.voltages[1] == 65535 and 0 < m.battery_remaining <= 100,
    "HOME_POSITION": lambda m: (m.latitude, m.altitude) == (round(HOME.lat_deg * 1e7), 150_000),
    "GPS_GLOBAL_ORIGIN": lambda m: (m.latitude, m.altitude) == (round(HOME.lat_deg * 1e7), 150_000),
    "WIND_COV": lambda m: math.hypot(m.wind_x, m.wind_y) < 1.0,
    "ACTUATOR_OUTPUT_STATUS": lambda m: m.active == 4 and 0.0 < m.actuator[0] < 1.0,
    "HEARTBEAT": lambda m: m.type == mavlink.MAV_TYPE_VTOL_DUOROTOR and m.autopilot == mavlink.MAV_AUTOPILOT_PX4,
    "NAV_CONTROLLER_OUTPUT": lambda m: (m.nav_roll, m.nav_pitch) == pytest.approx((0.0, 0.0), abs=1.0),
    "NAMED_VALUE_FLOAT": lambda m: m.name == "power" and m.value > 10.0,
    "COMPONENT_METADATA": lambda m: m.uri.startswith("mftp"),
}


@pytest.mark.parametrize("name", MESSAGES)
def test_a_requested_message_is_sent_and_correct(station, name):
    number = getattr(mavlink, f"MAVLINK_MSG_ID_{name}")
    assert station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, number) == ACCEPTED
    assert MESSAGES[name](station.last(name))


def test_older_commands_for_one_message(station):
    assert station.command(mavlink.MAV_CMD_GET_HOME_POSITION) == ACCEPTED
    assert MESSAGES["HOME_POSITION"](station.last("HOME_POSITION"))
    assert station.command(mavlink.MAV_CMD_REQUEST_AUTOPILOT_CAPABILITIES) == ACCEPTED
    older = station.last("AUTOPILOT_VERSION")
    assert older.capabilities & mavlink.MAV_PROTOCOL_CAPABILITY_MAVLINK2
    station.heard.clear()
    assert station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, mavlink.MAVLINK_MSG_ID_AUTOPILOT_VERSION) == ACCEPTED
    assert station.last("AUTOPILOT_VERSION").to_dict() == older.to_dict()


def test_an_interval_is_set_reported_and_kept(bench, station):
    number = mavlink.MAVLINK_MSG_ID_VFR_HUD
    assert station.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 100_000.0) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_GET_MESSAGE_INTERVAL, number) == ACCEPTED
    assert station.last("MESSAGE_INTERVAL").interval_us == 100_000
    station.heard.clear()
    bench.advance(2.0)
    assert sum(m.get_type() == "VFR_HUD" for m in station.heard) == pytest.approx(20, abs=1)
    assert station.command(mavlink.MAV_CMD_SET_MESSAGE_INTERVAL, number, 0.0) == ACCEPTED


def test_an_attitude_setpoint_is_refused_with_a_reason(untold):
    untold.send(mavlink.MAVLink_set_attitude_target_message(0, 1, 1, 0, [0.7071, 0, 0.7071, 0], 0, 0, 0, 0.5))
    refusal = "Set-point refused: nose 90 deg from the vertical exceeds the limit of 45 deg"
    assert untold.texts() == refusal


def test_actuator_setpoints_are_refused_with_a_reason(untold):
    untold.send(mavlink.MAVLink_set_actuator_control_target_message(0, 0, 1, 1, [0.0] * 8))
    assert "Set-point refused: motors and elevons follow the control laws only" in untold.texts()


def test_a_flight_is_paused_and_not_continued_without_a_mission(station):
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 0) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 1) == mavlink.MAV_RESULT_TEMPORARILY_REJECTED
    assert station.command(mavlink.MAV_CMD_DO_PAUSE_CONTINUE, 2) == mavlink.MAV_RESULT_DENIED
    assert station.command(mavlink.MAV_CMD_NAV_LOITER_UNLIM) == ACCEPTED


def test_the_vtol_forms_of_landing_and_take_off(tmp_path):
    bench = Bench(tmp_path)
    station = bench.station()
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_NAV_VTOL_TAKEOFF) == ACCEPTED
    bench.advance(4.0)
    assert bench.aircraft.vehicle.truth.body.position.z > 1.0
    assert station.command(mavlink.MAV_CMD_NAV_VTOL_LAND) == ACCEPTED
    bench.advance_until(lambda: not bench.autopilot.armed, 20.0)


def item(command, *, params=(0.0, 0.0, 0.0, 0.0), frame=3, east=0, north=0, z=0.0):
    x, y = round(HOME.lat_deg * 1e7) + north, round(HOME.lon_deg * 1e7) + east
    return MissionItem(command=command, frame=frame, params=params, x=x, y=y, z=z)


def test_a_setpoint_may_be_a_latitude_and_longitude(bench, station):
    latitude, longitude = round(HOME.lat_deg * 1e7) + 200, round(HOME.lon_deg * 1e7)
    for _ in range(20):
        station.send(
            mavlink.MAVLink_set_position_target_global_int_message(
                0, 1, 1, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, 0b1101_1111_1000, latitude, longitude, 3.0,
                0, 0, 0, 0, 0, 0, 0, 0,
            )
        )  # fmt: skip
        bench.advance(0.1)
    assert "refused" not in station.texts()
    assert station.mode(Mode.OFFBOARD) == ACCEPTED


def test_a_mission_waits_as_long_as_its_waiting_items_say(tmp_path):
    bench = Bench(tmp_path)
    station = bench.station()
    items = [
        item(mavlink.MAV_CMD_NAV_TAKEOFF, z=3.0),
        item(mavlink.MAV_CMD_NAV_DELAY, params=(1.0, -1.0, -1.0, -1.0)),
        item(mavlink.MAV_CMD_NAV_LOITER_TIME, params=(2.0, 0.0, 0.0, 0.0), z=3.0),
        item(mavlink.MAV_CMD_NAV_LAND),
    ]
    assert station.upload(items) == mavlink.MAV_MISSION_ACCEPTED
    assert station.command(mavlink.MAV_CMD_COMPONENT_ARM_DISARM, 1) == ACCEPTED
    assert station.command(mavlink.MAV_CMD_MISSION_START) == ACCEPTED
    begun = []
    for seq in range(1, 4):
        bench.advance_until(lambda seq=seq: bench.autopilot.mission.current == seq, 20.0)
        begun.append(bench.now)
    assert begun[1] - begun[0] == pytest.approx(1.0, abs=0.15)  # looked at every 0.1 s
    assert begun[2] - begun[1] == pytest.approx(2.0, abs=0.15)
    assert [m.seq for m in station.all("MISSION_ITEM_REACHED")] == [0, 1, 2]


def test_a_loiter_is_told_as_reached_where_its_waiting_begins(tmp_path):
    bench = Bench(tmp_path, up=3.0)
    station = bench.station()
    items = [item(mavlink.MAV_CMD_NAV_LOITER_TIME, params=(5.0, 0.0, 0.0, 0.0), z=3.0), item(mavlink.MAV_CMD_NAV_LAND)]
    assert station.upload(items) == mavlink.MAV_MISSION_ACCEPTED
    assert station.command(mavlink.MAV_CMD_MISSION_START) == ACCEPTED
    bench.advance_until(lambda: station.all("MISSION_ITEM_REACHED"), 2.0)
    assert bench.autopilot.mission.current == 0  # it waits there


def test_polygons_and_circles_are_accepted_as_a_fence(tmp_path):
    station = Bench(tmp_path).station()
    corners, inner = ((-5000, -5000), (-5000, 5000), (5000, 0)), ((3000, 3000), (3000, 3500), (3500, 3000))
    within, without = (
        mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION,
        mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION,
    )
    items = [item(within, params=(3.0, 0, 0, 0), frame=0, north=n, east=e) for n, e in corners]
    items += [item(without, params=(3.0, 0, 0, 0), frame=0, north=n, east=e) for n, e in inner]
    items.append(item(mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION, params=(5.0, 0, 0, 0), frame=0, north=-3000))
    assert station.upload(items, kind=mavlink.MAV_MISSION_TYPE_FENCE) == mavlink.MAV_MISSION_ACCEPTED
