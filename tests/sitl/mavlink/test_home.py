"""Home moved by command and by message, and what it changes in flight."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode
from protocol.plans.plan import MissionItem
from sitl.autopilot.settings import Settings
from tests.support.vehicle.fake_station import Bench
from tests.support.vehicle.home_messages import NAN, RELATIVE, SET_HOME, e7, global_waypoint, request_message, set_home

BODY = mavlink.MAV_FRAME_BODY_NED
FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
UNSUPPORTED_FRAME = mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME


@pytest.fixture
def hovering(tmp_path):
    return Bench(tmp_path, up=3.0)


@pytest.fixture
def standing(tmp_path):
    return Bench(tmp_path)


def relative_altitude(station):
    return request_message(station, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT).relative_alt / 1e3


# Where home is


def test_a_moved_home_is_sent_to_everyone_at_once(hovering):
    station, other = hovering.station(), hovering.station(254, "other")
    other.beat()
    assert set_home(station, 10.0, -4.0, 152.0) == ACCEPTED
    for sent in (station.last("HOME_POSITION"), other.last("HOME_POSITION")):
        assert (sent.latitude, sent.longitude, sent.altitude) == (*e7(10.0, -4.0)[:2], 152_000)
        assert (sent.x, sent.y, sent.z) == pytest.approx((10.0, -4.0, -2.0), abs=0.02)
        assert sent.approach_z == pytest.approx(-2.0 - Settings().return_altitude)
    assert "Home is 10.0 m north, -4.0 m east, 2.0 m up" in station.texts()
    assert relative_altitude(station) == pytest.approx(1.0, abs=0.1)


def test_the_local_frame_stays_where_it_is(hovering):
    station = hovering.station()
    set_home(station, 10.0, -4.0, 152.0)
    origin = request_message(station, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
    assert (origin.latitude, origin.longitude, origin.altitude) == (*e7(0.0, 0.0)[:2], 150_000)
    assert request_message(station, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED).z == pytest.approx(-3.0, abs=0.1)


def test_here_means_the_position_of_the_vehicle(hovering):
    station = hovering.station()
    assert station.command(SET_HOME, 1) == ACCEPTED
    assert station.last("HOME_POSITION").altitude == pytest.approx(153_000, abs=100)
    assert relative_altitude(station) == pytest.approx(0.0, abs=0.1)


def test_an_altitude_that_is_left_open_stays(hovering):
    station = hovering.station()
    set_home(station, 0.0, 0.0, 152.0)
    assert set_home(station, 5.0, 0.0, NAN) == ACCEPTED
    assert station.last("HOME_POSITION").altitude == 152_000


@pytest.mark.parametrize(("altitude", "up"), [(2.0, 2.0), (151.0, 1.0), (150.0, 0.0)])
def test_in_a_relative_frame_an_altitude_above_the_sea_is_recognised(hovering, altitude, up):
    station = hovering.station()
    assert set_home(station, 5.0, 0.0, altitude, frame=RELATIVE) == ACCEPTED
    assert station.last("HOME_POSITION").z == pytest.approx(-up, abs=1e-6)


def test_the_old_message_moves_home_too(hovering):
    station = hovering.station()
    x, y, alt = e7(10.0, -4.0, 2.0)
    station.send(mavlink.MAVLink_set_home_position_message(1, x, y, round(alt * 1e3), 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    assert station.last("HOME_POSITION").z == pytest.approx(-2.0)


def test_a_station_that_is_not_in_control_cannot_move_home(hovering):
    station, other = hovering.station(), hovering.station(254, "other")
    station.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10)
    other.send(mavlink.MAVLink_set_home_position_message(1, *e7(9.0, 0.0)[:2], 150_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    assert set_home(other, 9.0, 0.0, 150.0) == mavlink.MAV_RESULT_NOT_IN_CONTROL
    assert hovering.autopilot.world.home == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("changed", "result", "reason"),
    [
        ({"frame": BODY}, UNSUPPORTED_FRAME, "frame 8 is not supported"),
        ({"here": 2.0}, DENIED, "param1 is 2"),
        ({"north": 1600.0}, DENIED, "1600.0 m north is outside the arena"),
        ({"altitude": 135.0}, DENIED, "15.0 m under the ground"),
        ({"altitude": 3000.0}, DENIED, "outside the arena"),
        ({"altitude": math.inf}, DENIED, "param7 is inf, not a number from -20000 to 20000 m (altitude)"),
    ],
)
def test_an_impossible_home_is_refused_with_a_reason_and_the_old_one_stays(hovering, changed, result, reason):
    station = hovering.station()
    assert set_home(station, **({"north": 5.0, "east": 0.0, "altitude": 150.0} | changed)) == result
    assert reason in station.texts()
    assert station.last("HOME_POSITION") is None or station.last("HOME_POSITION").x == 0.0
    assert hovering.autopilot.world.home == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("lat", "lon"), [(NAN, NAN), (91.0, 0.0), (43.0, 181.0), (math.inf, 0.0)])
def test_an_invalid_position_is_denied(hovering, lat, lon):
    station = hovering.station()
    assert station.command(SET_HOME, 0, 0, 0, NAN, lat, lon, 150.0) == DENIED
    assert "Home denied: " in station.texts()


# What home is for


def test_a_return_lands_at_the_moved_home(hovering):
    station = hovering.station()
    set_home(station, 6.0, 3.0, 150.0)
    assert station.mode(Mode.RTL) == ACCEPTED
    hovering.advance_until(lambda: not hovering.autopilot.flying, 60.0)
    north, west, _ = hovering.autopilot.view.p
    assert math.dist((north, west), (6.0, -3.0)) < 0.5


def test_a_return_under_way_turns_to_the_new_home_but_a_landing_is_finished(hovering):
    station = hovering.station()
    station.mode(Mode.RTL)
    hovering.advance(1.0)
    set_home(station, 8.0, 0.0, 150.0)
    hovering.advance_until(lambda: hovering.autopilot.landing, 60.0)
    set_home(station, 0.0, 0.0, 150.0)
    hovering.advance_until(lambda: not hovering.autopilot.flying, 60.0)
    assert hovering.autopilot.view.p[0] == pytest.approx(8.0, abs=0.5)


@pytest.mark.long
def test_a_return_flies_at_its_height_above_home(hovering):
    station = hovering.station()
    set_home(station, 6.0, 0.0, 156.0)
    station.mode(Mode.RTL)
    heights = []
    while hovering.autopilot.flying:
        hovering.advance(0.2)
        heights.append(hovering.autopilot.reference.position[2])
    assert max(heights) == pytest.approx(6.0 + Settings().return_altitude, abs=0.3)


def test_take_off_and_go_to_are_relative_to_home(standing):
    station = standing.station()
    set_home(station, 0.0, 0.0, 152.0)
    standing.autopilot.arming.arm()
    assert station.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 1.0) == ACCEPTED
    standing.advance_until(lambda: standing.autopilot.mode is Mode.HOLD, 20.0)
    assert standing.autopilot.reference.position[2] == pytest.approx(3.0)
    assert set_home(station, 0.0, 0.0, 4.0, frame=RELATIVE, command=mavlink.MAV_CMD_DO_REPOSITION) == ACCEPTED
    standing.advance(0.1)
    assert standing.autopilot.reference.position[2] == pytest.approx(6.0)


def test_an_orbit_is_flown_at_its_height_above_home(tmp_path):
    bench = Bench(tmp_path, up=30.0)
    station = bench.station()
    set_home(station, 0.0, 0.0, 152.0)
    x, y, _ = e7(40.0, 0.0)
    orbit = mavlink.MAV_CMD_DO_ORBIT
    station.send(mavlink.MAVLink_command_int_message(1, 1, RELATIVE, orbit, 0, 0, 40.0, NAN, 0.0, NAN, x, y, 20.0))
    assert station.last("COMMAND_ACK").result == ACCEPTED
    bench.advance(0.1)
    assert bench.autopilot.reference.path.start == pytest.approx((40.0, 0.0, 22.0), abs=0.02)


@pytest.mark.parametrize(("frame", "alt", "up"), [(6, 4.0, 6.0), (5, 154.0, 4.0)])
def test_streamed_set_points_are_above_home_or_above_the_sea(hovering, frame, alt, up):
    station = hovering.station()
    set_home(station, 0.0, 0.0, 152.0)
    x, y, _ = e7(2.0, 1.0)
    mask = 0b1101_1111_1000
    station.send(mavlink.MAVLink_set_position_target_global_int_message(0, 1, 1, frame, mask, x, y, alt, *(0.0,) * 8))
    assert station.mode(Mode.OFFBOARD) == ACCEPTED
    hovering.advance(0.1)
    assert hovering.autopilot.reference.position == pytest.approx((2.0, -1.0, up), abs=0.02)


def test_the_parameters_of_the_fence_are_about_home(tmp_path):
    bench = Bench(tmp_path, up=3.0, settings=Settings(fence_distance=20.0, fence_height=10.0))
    station = bench.station()
    assert set_home(station, 30.0, 0.0, 150.0) == DENIED
    assert "the vehicle would be farther than 20 m from home" in station.texts()
    assert set_home(station, 15.0, 0.0, 155.0) == ACCEPTED
    assert bench.autopilot.world.refuse((34.0, 0.0, 14.0)) is None
    assert "from home" in bench.autopilot.world.refuse((-6.0, 0.0, 5.0))
    assert "above home" in bench.autopilot.world.refuse((15.0, 0.0, 16.0))


def test_home_outside_the_fence_is_denied(hovering):
    station = hovering.station()
    circle = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
    lat, lon, _ = e7(0.0, 0.0)
    fence = MissionItem(command=circle, frame=0, params=(50.0, 0.0, 0.0, 0.0), x=lat, y=lon, z=0.0)
    assert station.upload([fence], FENCE) == 0
    assert set_home(station, 60.0, 0.0, 150.0) == DENIED
    assert "Home denied: it would be outside the fence" in station.texts()


def test_rally_points_above_home_move_along(hovering):
    station = hovering.station()
    lat, lon, _ = e7(9.0, 0.0)
    command = mavlink.MAV_CMD_NAV_RALLY_POINT
    point = MissionItem(command=command, frame=RELATIVE, params=(0.0,) * 4, x=lat, y=lon, z=8.0)
    station.upload([point], RALLY)
    set_home(station, 0.0, 0.0, 154.0)
    assert hovering.autopilot.world.rally == (pytest.approx((9.0, 0.0, 12.0), abs=0.02),)
    set_home(station, 0.0, 0.0, 150.0 + 1495.0)
    assert "Rally points no longer in force: rally item 0: altitude 1503.0 m" in station.texts()
    assert hovering.autopilot.world.rally == ()
    set_home(station, 0.0, 0.0, 150.0)
    assert len(hovering.autopilot.world.rally) == 1


# Missions


def test_items_that_begin_later_are_relative_to_the_new_home(hovering):
    station = hovering.station()
    station.upload([global_waypoint(4.0, 0.0, 3.0), global_waypoint(0.0, 0.0, 3.0)])
    assert station.mode(Mode.MISSION) == ACCEPTED
    hovering.advance(0.2)
    assert set_home(station, 0.0, 0.0, 152.0) == ACCEPTED
    hovering.advance(0.2)
    assert hovering.autopilot.reference.position == pytest.approx((4.0, 0.0, 3.0), abs=0.02)  # goes on as it began
    hovering.advance_until(lambda: hovering.autopilot.mission.current == 1, 20.0)
    assert hovering.autopilot.reference.position == pytest.approx((0.0, 0.0, 5.0), abs=0.02)


def test_home_is_not_moved_if_the_mission_under_way_could_not_be_flown(hovering):
    station = hovering.station()
    station.upload([global_waypoint(4.0, 0.0, 3.0), global_waypoint(0.0, 0.0, 1490.0)])
    station.mode(Mode.MISSION)
    assert set_home(station, 0.0, 0.0, 170.0) == DENIED
    assert "the mission under way could not be flown: item 1: altitude 1510.0 m" in station.texts()


def test_a_mission_that_can_no_longer_be_flown_is_reported_and_not_started(hovering):
    station = hovering.station()
    station.upload([global_waypoint(4.0, 0.0, 3.0), global_waypoint(0.0, 0.0, 1490.0)])
    assert set_home(station, 0.0, 0.0, 170.0) == ACCEPTED
    assert "Mission can no longer be flown: item 1: altitude 1510.0 m" in station.texts()
    assert station.mode(Mode.MISSION) == DENIED
    assert "Mission denied: item 1: altitude 1510.0 m" in station.texts()
    set_home(station, 0.0, 0.0, 150.0)
    assert station.mode(Mode.MISSION) == ACCEPTED
