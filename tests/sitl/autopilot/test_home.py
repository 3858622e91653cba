"""Home that moves and is kept, and the origin of the local frame, over the wire and in flight."""

import math
from dataclasses import replace

import pytest

from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.modes import Mode
from protocol.plans.mission import MissionItem
from sitl.autopilot.alarm import Action
from sitl.autopilot.failsafe import Failsafes
from sitl.autopilot.home import HomeKeeper, move_home
from sitl.autopilot.settings import Settings
from sitl.craft import is_forward
from sitl.errors import SitlError
from sitl.memory import Memory
from tests.support.station import FRAME, HOME, Sky
from tests.support.wing_flight import HIGH, Flight

NAN = math.nan
SET_HOME, SET_ORIGIN = mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_SET_GLOBAL_ORIGIN
WAYPOINT = mavlink.MAV_CMD_NAV_WAYPOINT
SEA, RELATIVE, BODY = 0, 3, mavlink.MAV_FRAME_BODY_NED
FENCE, RALLY = mavlink.MAV_MISSION_TYPE_FENCE, mavlink.MAV_MISSION_TYPE_RALLY
DENIED, REJECTED = mavlink.MAV_RESULT_DENIED, mavlink.MAV_RESULT_TEMPORARILY_REJECTED
UNSUPPORTED_FRAME = mavlink.MAV_RESULT_COMMAND_UNSUPPORTED_MAV_FRAME
ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
ELSEWHERE = Geodetic(48.1, 11.6, 520.0)


@pytest.fixture
def hovering(tmp_path):
    return Sky(tmp_path, up=3.0)


@pytest.fixture
def standing(tmp_path):
    return Sky(tmp_path)


def e7(north, east, up=0.0, frame=FRAME):
    """Latitude and longitude [1e-7 deg] and altitude [m] of a place in a local frame [m]."""
    place = frame.to_geodetic((north, east, -up))
    return round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), place.alt


def set_home(station, north, east, altitude, *, frame=SEA, here=0.0, command=SET_HOME):
    """The result of asking for home at a place."""
    x, y, _ = e7(north, east)
    station.send(mavlink.MAVLink_command_int_message(1, 1, frame, command, 0, 0, here, NAN, NAN, NAN, x, y, altitude))
    return station.last("COMMAND_ACK").result


def asked(station, message_id):
    """A message, as it is sent on request."""
    station.command(mavlink.MAV_CMD_REQUEST_MESSAGE, message_id)
    return station.heard[-1]


def relative_altitude(station):
    return asked(station, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT).relative_alt / 1e3


def waypoint(north, east, height, frame=RELATIVE):
    return MissionItem(WAYPOINT, frame, (0.0, 0.0, 0.0, NAN), *e7(north, east)[:2], height)


# Where home is


def test_home_moves_and_everyone_is_told_at_once(hovering):
    station, other = hovering.station(), hovering.station(254, "other")
    other.beat()
    assert set_home(station, 10.0, -4.0, 152.0) == ACCEPTED
    for told in (station.last("HOME_POSITION"), other.last("HOME_POSITION")):
        assert (told.latitude, told.longitude, told.altitude) == (*e7(10.0, -4.0)[:2], 152_000)
        assert (told.x, told.y, told.z) == pytest.approx((10.0, -4.0, -2.0), abs=0.02)
        assert told.approach_z == pytest.approx(-2.0 - Settings().return_altitude)
    assert "Home is 10.0 m north, -4.0 m east, 2.0 m up" in station.texts()
    assert relative_altitude(station) == pytest.approx(1.0, abs=0.1)


def test_the_local_frame_stays_where_it_is(hovering):
    station = hovering.station()
    set_home(station, 10.0, -4.0, 152.0)
    origin = asked(station, mavlink.MAVLINK_MSG_ID_GPS_GLOBAL_ORIGIN)
    assert (origin.latitude, origin.longitude, origin.altitude) == (*e7(0.0, 0.0)[:2], 150_000)
    assert asked(station, mavlink.MAVLINK_MSG_ID_LOCAL_POSITION_NED).z == pytest.approx(-3.0, abs=0.1)


def test_here_is_where_the_vehicle_is(hovering):
    station = hovering.station()
    assert station.command(SET_HOME, 1) == ACCEPTED
    assert station.last("HOME_POSITION").altitude == pytest.approx(153_000, abs=100)
    assert relative_altitude(station) == pytest.approx(0.0, abs=0.1)


def test_an_altitude_left_open_stays(hovering):
    station = hovering.station()
    set_home(station, 0.0, 0.0, 152.0)
    assert set_home(station, 5.0, 0.0, NAN) == ACCEPTED
    assert station.last("HOME_POSITION").altitude == 152_000


@pytest.mark.parametrize(("altitude", "up"), [(2.0, 2.0), (151.0, 1.0), (150.0, 0.0)])
def test_in_a_relative_frame_an_altitude_above_the_sea_is_known_as_one(hovering, altitude, up):
    station = hovering.station()
    assert set_home(station, 5.0, 0.0, altitude, frame=RELATIVE) == ACCEPTED
    assert station.last("HOME_POSITION").z == pytest.approx(-up, abs=1e-6)


def test_the_message_that_the_command_replaced_moves_home(hovering):
    station = hovering.station()
    x, y, alt = e7(10.0, -4.0, 2.0)
    station.send(mavlink.MAVLink_set_home_position_message(1, x, y, round(alt * 1e3), 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    assert station.last("HOME_POSITION").z == pytest.approx(-2.0)


def test_who_is_not_in_control_moves_no_home(hovering):
    station, other = hovering.station(), hovering.station(254, "other")
    station.command(mavlink.MAV_CMD_REQUEST_OPERATOR_CONTROL, 1, 0, 10)
    other.send(mavlink.MAVLink_set_home_position_message(1, *e7(9.0, 0.0)[:2], 150_000, 0, 0, 0, [1, 0, 0, 0], 0, 0, 0))
    assert set_home(other, 9.0, 0.0, 150.0) == mavlink.MAV_RESULT_NOT_IN_CONTROL
    assert hovering.autopilot.world.home == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("asked_for", "result", "words"),
    [
        ({"frame": BODY}, UNSUPPORTED_FRAME, "frame 8 is not supported"),
        ({"here": 2.0}, DENIED, "param1 is 2"),
        ({"north": 1600.0}, DENIED, "1600.0 m north is outside the arena"),
        ({"altitude": 135.0}, DENIED, "15.0 m under the ground"),
        ({"altitude": 3000.0}, DENIED, "outside the arena"),
        ({"altitude": math.inf}, DENIED, "altitude inf is not a number"),
    ],
)
def test_no_home_is_refused_in_words_and_the_old_one_stays(hovering, asked_for, result, words):
    station = hovering.station()
    assert set_home(station, **({"north": 5.0, "east": 0.0, "altitude": 150.0} | asked_for)) == result
    assert words in station.texts()
    assert station.last("HOME_POSITION") is None or station.last("HOME_POSITION").x == 0.0
    assert hovering.autopilot.world.home == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("lat", "lon"), [(NAN, NAN), (91.0, 0.0), (43.0, 181.0), (math.inf, 0.0)])
def test_a_place_that_is_none_is_denied(hovering, lat, lon):
    station = hovering.station()
    assert station.command(SET_HOME, 0, 0, 0, NAN, lat, lon, 150.0) == DENIED
    assert "Home denied: " in station.texts()


# What home is for


def test_a_return_lands_at_the_home_that_was_moved(hovering):
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


def test_a_return_on_the_wing_turns_to_the_new_home():
    flight = Flight(wind_speed=3.0, wind_from=90.0, gusts=0.5)
    flight.autopilot.go_to((300.0, 0.0, HIGH))
    flight.fly(12.0)
    flight.autopilot.return_to_launch()
    flight.fly(8.0)
    assert is_forward(flight.vehicle.law)
    assert move_home(flight.autopilot, (50.0, 80.0, 0.0)).accepted
    flight.fly_until(lambda: not flight.autopilot.flying, 90.0)
    assert math.dist(flight.p[-1][:2], (50.0, 80.0)) < 0.5
    assert flight.failsafes == 0


def test_a_return_flies_at_its_height_above_home(hovering):
    station = hovering.station()
    set_home(station, 6.0, 0.0, 156.0)
    station.mode(Mode.RTL)
    heights = []
    while hovering.autopilot.flying:
        hovering.advance(0.2)
        heights.append(hovering.autopilot.reference.position[2])
    assert max(heights) == pytest.approx(6.0 + Settings().return_altitude)


def test_take_off_and_go_to_are_relative_to_home(standing):
    station = standing.station()
    set_home(station, 0.0, 0.0, 152.0)
    standing.autopilot.arm()
    assert station.command(mavlink.MAV_CMD_NAV_TAKEOFF, 0, 0, 0, NAN, NAN, NAN, 1.0) == ACCEPTED
    standing.advance_until(lambda: standing.autopilot.mode is Mode.HOLD, 20.0)
    assert standing.autopilot.reference.position[2] == pytest.approx(3.0)
    assert set_home(station, 0.0, 0.0, 4.0, frame=RELATIVE, command=mavlink.MAV_CMD_DO_REPOSITION) == ACCEPTED
    standing.advance(0.1)
    assert standing.autopilot.reference.position[2] == pytest.approx(6.0)


def test_an_orbit_is_flown_at_its_height_above_home(tmp_path):
    sky = Sky(tmp_path, up=30.0)
    station = sky.station()
    set_home(station, 0.0, 0.0, 152.0)
    x, y, _ = e7(40.0, 0.0)
    orbit = mavlink.MAV_CMD_DO_ORBIT
    station.send(mavlink.MAVLink_command_int_message(1, 1, RELATIVE, orbit, 0, 0, 40.0, NAN, 0.0, NAN, x, y, 20.0))
    assert station.last("COMMAND_ACK").result == ACCEPTED
    sky.advance(0.1)
    assert sky.autopilot.reference.path.start == pytest.approx((40.0, 0.0, 22.0), abs=0.02)


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


def test_the_battery_is_held_against_the_way_to_the_new_home_at_once(hovering):
    autopilot, failsafes = hovering.autopilot, Failsafes()
    view = hovering.craft.view()._replace(time=0.0, energy=60e3, energy_left=0.6)

    def alarms(view, world):
        return failsafes.check(view, Mode.HOLD, world, autopilot.settings, autopilot.chooser, landing=False)

    assert alarms(view, autopilot.world) == []
    (alarm,) = alarms(view._replace(time=1.0), autopilot.world._replace(home=(50e3, 0.0, 0.0)))
    assert alarm.action is Action.LAND


def test_the_parameters_of_the_fence_are_about_home(tmp_path):
    sky = Sky(tmp_path, up=3.0, settings=Settings(fence_reach=20.0, fence_ceiling=10.0))
    station = sky.station()
    assert set_home(station, 30.0, 0.0, 150.0) == DENIED
    assert "the vehicle would be farther than 20 m from home" in station.texts()
    assert set_home(station, 15.0, 0.0, 155.0) == ACCEPTED
    assert sky.autopilot.world.refuse((34.0, 0.0, 14.0)) is None
    assert "from home" in sky.autopilot.world.refuse((-6.0, 0.0, 5.0))
    assert "above home" in sky.autopilot.world.refuse((15.0, 0.0, 16.0))


def test_home_outside_the_fence_is_denied(hovering):
    station = hovering.station()
    circle = mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION
    assert station.upload([MissionItem(circle, 0, (50.0, 0.0, 0.0, 0.0), *e7(0.0, 0.0)[:2], 0.0)], FENCE) == 0
    assert set_home(station, 60.0, 0.0, 150.0) == DENIED
    assert "Home denied: it would be outside the fence" in station.texts()


def test_rally_points_above_home_move_along(hovering):
    station = hovering.station()
    point = MissionItem(mavlink.MAV_CMD_NAV_RALLY_POINT, RELATIVE, (0.0,) * 4, *e7(9.0, 0.0)[:2], 8.0)
    station.upload([point], RALLY)
    set_home(station, 0.0, 0.0, 154.0)
    assert hovering.autopilot.world.rally == (pytest.approx((9.0, 0.0, 12.0), abs=0.02),)
    set_home(station, 0.0, 0.0, 150.0 + 1495.0)
    assert "Rally points no longer in force: rally item 0: altitude 1503.0 m" in station.texts()
    assert hovering.autopilot.world.rally == ()
    set_home(station, 0.0, 0.0, 150.0)
    assert len(hovering.autopilot.world.rally) == 1


# Missions


def test_items_flown_from_now_on_are_relative_to_the_new_home(hovering):
    station = hovering.station()
    station.upload([waypoint(4.0, 0.0, 3.0), waypoint(0.0, 0.0, 3.0)])
    assert station.mode(Mode.MISSION) == ACCEPTED
    hovering.advance(0.2)
    assert set_home(station, 0.0, 0.0, 152.0) == ACCEPTED
    hovering.advance(0.2)
    assert hovering.autopilot.reference.position == pytest.approx((4.0, 0.0, 3.0), abs=0.02)  # goes on as it began
    hovering.advance_until(lambda: hovering.autopilot.mission.current == 1, 20.0)
    assert hovering.autopilot.reference.position == pytest.approx((0.0, 0.0, 5.0), abs=0.02)


def test_a_mission_under_way_that_could_not_be_flown_any_more_keeps_home_where_it_is(hovering):
    station = hovering.station()
    station.upload([waypoint(4.0, 0.0, 3.0), waypoint(0.0, 0.0, 1490.0)])
    station.mode(Mode.MISSION)
    assert set_home(station, 0.0, 0.0, 170.0) == DENIED
    assert "the mission under way could not be flown: item 1: altitude 1510.0 m" in station.texts()


def test_a_held_plan_that_can_no_longer_be_flown_is_said_and_not_started(hovering):
    station = hovering.station()
    station.upload([waypoint(4.0, 0.0, 3.0), waypoint(0.0, 0.0, 1490.0)])
    assert set_home(station, 0.0, 0.0, 170.0) == ACCEPTED
    assert "Mission can no longer be flown: item 1: altitude 1510.0 m" in station.texts()
    assert station.mode(Mode.MISSION) == DENIED
    assert "Mission denied: item 1: altitude 1510.0 m" in station.texts()
    set_home(station, 0.0, 0.0, 150.0)
    assert station.mode(Mode.MISSION) == ACCEPTED


# Kept


def test_home_is_where_it_was_after_a_restart_and_what_was_kept_fits_it(tmp_path):
    station = Sky(tmp_path, up=3.0).station()
    set_home(station, 10.0, -4.0, 170.0)
    before = station.last("HOME_POSITION")
    assert station.upload([waypoint(4.0, 0.0, 1475.0)]) == 0
    again = Sky(tmp_path)
    told = asked(again.station(), mavlink.MAVLINK_MSG_ID_HOME_POSITION)
    assert (told.latitude, told.longitude, told.altitude) == (before.latitude, before.longitude, before.altitude)
    assert again.autopilot.world.home == pytest.approx((10.0, 4.0, 20.0), abs=0.02)
    assert again.autopilot.mission is not None


def test_a_kept_home_of_another_site_is_said_and_not_used_but_waits_for_its_own(tmp_path):
    set_home(Sky(tmp_path, up=3.0).station(), 10.0, 0.0, 150.0)
    far = Sky(tmp_path, origin=ELSEWHERE)
    assert far.autopilot.world.home == (0.0, 0.0, 0.0)
    (said,) = HomeKeeper(far.autopilot, Memory(tmp_path)).said
    assert said.text.startswith("Kept home not used: it belongs to a start")
    assert Sky(tmp_path).autopilot.world.home == pytest.approx((10.0, 0.0, 0.0), abs=0.02)


def test_a_kept_origin_that_is_none_any_more_is_said_and_not_used(tmp_path):
    set_home(Sky(tmp_path, up=3.0).station(), 10.0, 0.0, 150.0)
    kept = (tmp_path / "home.json").read_text()
    (tmp_path / "home.json").write_text(kept.replace('"origin": {\n  "lat_deg": 43.5648', '"origin": {"lat_deg": 89.9'))
    sky = Sky(tmp_path)
    assert sky.autopilot.world.home == (0.0, 0.0, 0.0)
    (said,) = HomeKeeper(sky.autopilot, Memory(tmp_path)).said
    assert said.text == "Kept origin not used: latitude 89.9 is too near a pole"


@pytest.mark.parametrize(
    "text",
    ['{"start": 1}', "[]", '{"start": {"lat_deg": 1e400, "lon_deg": 0, "alt": 0}}', "\x00"],
)
def test_a_kept_home_that_is_none_is_one_line_with_the_file_and_the_way_out(tmp_path, text):
    (tmp_path / "home.json").write_text(text)
    with pytest.raises(SitlError, match=r"home\.json: .*delete the file"):
        Sky(tmp_path)


def test_the_same_home_again_is_told_but_not_written(hovering, tmp_path):
    station = hovering.station()
    set_home(station, 10.0, 0.0, 150.0)
    (tmp_path / "home.json").unlink()
    hovering.advance(2.0)  # no repetition of the first
    assert set_home(station, 10.0, 0.0, 150.0) == ACCEPTED
    assert not (tmp_path / "home.json").exists()


# The origin


def set_origin(station, place):
    station.send(
        mavlink.MAVLink_set_gps_global_origin_message(
            1, round(place.lat_deg * 1e7), round(place.lon_deg * 1e7), round(place.alt * 1e3)
        )
    )


def told_origin(station):
    m = station.last("GPS_GLOBAL_ORIGIN")
    return Geodetic(m.latitude / 1e7, m.longitude / 1e7, m.altitude / 1e3)


def test_the_origin_moves_on_the_ground_and_home_along(standing):
    station = standing.station()
    set_home(station, 10.0, 0.0, 152.0)
    set_origin(station, ELSEWHERE)
    assert told_origin(station) == ELSEWHERE
    home = station.last("HOME_POSITION")
    assert (home.x, home.y, home.z) == pytest.approx((10.0, 0.0, -2.0), abs=0.02)
    assert home.altitude == 522_000
    place = asked(station, mavlink.MAVLINK_MSG_ID_GLOBAL_POSITION_INT)
    assert (place.lat, place.lon) == (481000000, 116000000)


def test_the_origin_moves_by_command(standing):
    station = standing.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, 48.0, 11.5, 520.0) == ACCEPTED
    assert told_origin(station) == Geodetic(48.0, 11.5, 520.0)


def test_a_flight_keeps_its_origin(hovering):
    station = hovering.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, 48.0, 11.5, 520.0) == REJECTED
    set_origin(station, ELSEWHERE)
    assert station.texts().count("Origin refused: disarm first") >= 1
    assert hovering.autopilot.world.frame.origin == HOME


@pytest.mark.parametrize(
    ("place", "words"),
    [
        ((NAN, 11.5, 520.0), "no place"),
        ((89.5, 11.5, 520.0), "too near a pole"),
        ((48.0, 181.0, 520.0), "not on the globe"),
        ((48.0, 11.5, NAN), "altitude nan m"),
        ((48.0, 11.5, 1e6), "altitude 1e+06 m"),
    ],
)
def test_an_origin_that_is_none_is_denied(standing, place, words):
    station = standing.station()
    assert station.command(SET_ORIGIN, NAN, NAN, NAN, NAN, *place) == DENIED
    assert words in station.texts()
    assert standing.autopilot.world.frame.origin == HOME


def test_an_origin_in_a_relative_frame_is_refused(standing):
    station = standing.station()
    assert set_home(station, 0.0, 0.0, 0.0, frame=RELATIVE, command=SET_ORIGIN) == UNSUPPORTED_FRAME


def test_plans_of_the_old_origin_are_said_to_be_out_of_reach(standing):
    station = standing.station()
    station.upload([waypoint(4.0, 0.0, 3.0)])
    set_origin(station, ELSEWHERE)
    assert "Mission can no longer be flown: item 0" in station.texts()


def test_the_origin_is_kept(tmp_path):
    station = Sky(tmp_path).station()
    set_home(station, 10.0, 0.0, 152.0)
    set_origin(station, ELSEWHERE)
    again = Sky(tmp_path)
    assert again.autopilot.world.frame.origin == ELSEWHERE
    assert again.autopilot.world.home == pytest.approx((10.0, 0.0, 2.0), abs=0.02)
    said = [notice.text for notice in HomeKeeper(Sky(tmp_path / "other").autopilot, Memory(tmp_path)).said]
    assert said[0] == "Kept origin is 48.1000000, 11.6000000, 520.0 m"


def test_an_origin_that_was_never_moved_is_where_the_vehicle_starts(tmp_path):
    set_home(Sky(tmp_path, up=3.0).station(), 10.0, 0.0, 152.0)
    again = Sky(tmp_path, origin=replace(HOME, alt=149.0))
    assert again.autopilot.world.frame.origin.alt == 149.0
    assert again.autopilot.world.home == pytest.approx((10.0, 0.0, 3.0), abs=0.02)
