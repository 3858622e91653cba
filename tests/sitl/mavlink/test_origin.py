"""The origin of the local frame, moved by command and by message."""

import pytest

from protocol.dialect import mavlink
from protocol.frames import Geodetic
from tests.support.vehicle.fake_station import HOME, Bench
from tests.support.vehicle.home_messages import NAN, RELATIVE, global_waypoint, request_message, set_home, set_origin

SET_ORIGIN = mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN
ACCEPTED, DENIED = mavlink.MAV_RESULT_ACCEPTED, mavlink.MAV_RESULT_DENIED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
UNSUPPORTED_FRAME = mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
ELSEWHERE = Geodetic(48.1, 11.6, 520.0)


@pytest.fixture
def hovering(tmp_path):
    return Bench(tmp_path, up=3.0)


@pytest.fixture
def standing(tmp_path):
    return Bench(tmp_path)


def sent_origin(station):
    m = station.last("GPS_GLOBAL_ORIGIN")
    return Geodetic(m.latitude / 1e7, m.longitude / 1e7, m.altitude / 1e3)


def test_on_the_ground_the_origin_moves_and_home_moves_along(standing):
    station = standing.station()
    set_home(station, 10.0, 0.0, 152.0)
    set_origin(station, ELSEWHERE)
    assert sent_origin(station) == ELSEWHERE
    home = station.last("HOME_POSITION")
    assert (home.x, home.y, home.z) == pytest.approx((10.0, 0.0, -2.0), abs=0.02)
    assert home.altitude == 522_000
    place = request_message(station, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    assert (place.lat, place.lon) == (481000000, 116000000)


def test_the_origin_moves_by_command(standing):
    station = standing.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, 48.0, 11.5, 520.0) == ACCEPTED
    assert sent_origin(station) == Geodetic(48.0, 11.5, 520.0)


def test_in_flight_the_origin_stays(hovering):
    station = hovering.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, 48.0, 11.5, 520.0) == REJECTED
    set_origin(station, ELSEWHERE)
    assert station.texts().count("Origin refused: disarm first") >= 1
    assert hovering.autopilot.world.frame.origin == HOME


@pytest.mark.parametrize(
    ("place", "reason"),
    [
        ((NAN, 11.5, 520.0), "latitude nan, longitude 11.5 is not a valid position"),
        ((89.5, 11.5, 520.0), "too near a pole"),
        ((48.0, 181.0, 520.0), "param6 is 181, not a number from -180 to 180 deg (longitude)"),
        ((48.0, 11.5, NAN), "param7 is nan"),
        ((48.0, 11.5, 1e6), "param7 is 1e+06, not a number from -20000 to 20000 m (altitude)"),
    ],
)
def test_an_invalid_origin_is_denied(standing, place, reason):
    station = standing.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, *place) == DENIED
    assert reason in station.texts()
    assert standing.autopilot.world.frame.origin == HOME


def test_an_origin_in_a_relative_frame_is_refused(standing):
    station = standing.station()
    assert set_home(station, 0.0, 0.0, 0.0, frame=RELATIVE, command=SET_ORIGIN) == UNSUPPORTED_FRAME


def test_a_mission_at_the_old_origin_is_reported_as_out_of_reach(standing):
    station = standing.station()
    station.upload([global_waypoint(4.0, 0.0, 3.0)])
    set_origin(station, ELSEWHERE)
    assert "Mission can no longer be flown: item 0" in station.texts()
