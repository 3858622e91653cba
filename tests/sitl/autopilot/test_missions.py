"""What missions are accepted, and how they are flown, on a vehicle that is where it is told to be."""

import math
from itertools import pairwise

import pytest

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.plans.mission import MissionItem
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.guidance import View
from sitl.autopilot.mission import MissionRunner, World, validate
from sitl.autopilot.settings import Settings

HOME = Geodetic(43.5648, 1.4811, 150.0)
WORLD = World(LocalFrame(HOME), ARENAS["open"])
NAN = math.nan
LOCAL = mavlink.MAV_FRAME_LOCAL_NED


def item(command, x=0.0, y=0.0, z=0.0, params=(0.0, 0.0, 0.0, NAN), frame=LOCAL):
    """An item in metres north, east, down."""
    return MissionItem(command, frame, params, round(x * 1e4), round(y * 1e4), z)


def waypoint(north, east, up, hold=0.0):
    return item(mavlink.MAV_CMD_NAV_WAYPOINT, north, east, -up, (hold, 0.0, 0.0, NAN))


TAKE_OFF = item(mavlink.MAV_CMD_NAV_TAKEOFF, z=-3.0)
LAND = item(mavlink.MAV_CMD_NAV_LAND, frame=mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT)  # 0, 0: right here


def fly(items, seconds=200.0, settings=None):
    """Fly a mission with a vehicle that is at its reference one tick later; returns (runner, path)."""
    runner = MissionRunner(tuple(items), WORLD, settings or Settings())
    p, path, time = (0.0, 0.0, 0.0), [], 0.0
    while not runner.finished and time < seconds:
        view = View(time, p, (0.0, 0.0, 0.0), 0.0, 0.0, False, 1.0)
        p = runner.update(view).position
        path.append((time, p))
        if runner.landing and p[2] <= 0.0:
            runner.touched_down()
        time += 0.02
    return runner, path


def test_a_mission_reaches_its_items_in_order():
    runner, path = fly([TAKE_OFF, waypoint(5, 0, 3), waypoint(5, 5, 3), LAND])
    assert runner.reached == [0, 1, 2, 3]
    assert runner.finished
    assert path[-1][1][:2] == pytest.approx((5.0, -5.0))  # NWU: 5 m east is -5 west


def test_a_hold_time_is_held():
    _, short = fly([TAKE_OFF, waypoint(5, 0, 3), LAND])
    _, long = fly([TAKE_OFF, waypoint(5, 0, 3, hold=7.0), LAND])
    assert long[-1][0] - short[-1][0] == pytest.approx(7.0, abs=0.05)


def test_take_off_climbs_at_the_set_rate():
    _, path = fly([TAKE_OFF, LAND], settings=Settings(climb_rate=0.5))
    assert max(b[1][2] - a[1][2] for a, b in pairwise(path)) <= 0.5 * 0.0201


def test_a_jump_repeats_its_items_as_often_as_it_says():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, 2.0, 0.0, 0.0))
    runner, _ = fly([TAKE_OFF, waypoint(5, 0, 3), waypoint(0, 0, 3), jump, LAND])
    assert runner.reached == [0, 1, 2, 3, 1, 2, 3, 1, 2, 3, 4]


def test_an_endless_loop_without_a_waypoint_stops_with_a_word():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(0.0, -1.0, 0.0, 0.0))
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 2.0, -1.0, 0.0))
    runner, _ = fly([speed, jump])
    assert runner.finished
    assert "loop" in runner.notices[-1]


def test_a_speed_above_the_hover_limit_is_said_not_silent():
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 12.0, -1.0, 0.0))
    runner, _ = fly([TAKE_OFF, speed, waypoint(5, 0, 3), LAND])
    assert any("12 m/s" in text for text in runner.notices)
    assert runner.speed == Settings().hover_speed


def test_returning_flies_home_and_lands():
    runner, path = fly([TAKE_OFF, waypoint(20, 10, 3), item(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)])
    assert runner.finished
    assert path[-1][1][:2] == (0.0, 0.0)
    assert max(p[2] for _, p in path) == pytest.approx(Settings().return_altitude)


def test_global_and_local_frames_name_the_same_point():
    here = WORLD.frame.to_geodetic((30.0, -12.0, -8.0))
    common = (mavlink.MAV_CMD_NAV_WAYPOINT, (0.0, 0.0, 0.0, NAN))
    x, y = round(here.lat_deg * 1e7), round(here.lon_deg * 1e7)
    relative = MissionItem(common[0], mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, common[1], x, y, 8.0)
    absolute = MissionItem(common[0], mavlink.MAV_FRAME_GLOBAL, common[1], x, y, 158.0)
    ends = [fly([one, LAND])[1][0][1] for one in (relative, absolute, waypoint(30, -12, 8))]
    assert ends[0] == pytest.approx(ends[2], abs=0.02)
    assert ends[1] == pytest.approx(ends[2], abs=0.02)


@pytest.mark.parametrize(
    ("bad", "result", "word"),
    [
        (item(mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST), mavlink.MAV_MISSION_UNSUPPORTED, "206"),
        (
            item(mavlink.MAV_CMD_NAV_WAYPOINT, 1, 1, -3, frame=mavlink.MAV_FRAME_BODY_FRD),
            mavlink.MAV_MISSION_UNSUPPORTED_FRAME,
            "frame",
        ),
        (item(mavlink.MAV_CMD_NAV_WAYPOINT, 1, 1, NAN), mavlink.MAV_MISSION_INVALID_PARAM7, "altitude"),
        (waypoint(2000, 0, 3), mavlink.MAV_MISSION_INVALID, "arena"),
        (waypoint(0, 0, -3), mavlink.MAV_MISSION_INVALID, "altitude"),
        (waypoint(1, 1, 3, hold=-1.0), mavlink.MAV_MISSION_INVALID_PARAM1, "hold"),
        (
            item(mavlink.MAV_CMD_DO_JUMP, params=(9.0, 1.0, 0.0, 0.0)),
            mavlink.MAV_MISSION_INVALID_PARAM1,
            "jump",
        ),
        (
            item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, NAN, 0.0, 0.0)),
            mavlink.MAV_MISSION_INVALID_PARAM2,
            "speed",
        ),
        (
            MissionItem(mavlink.MAV_CMD_NAV_WAYPOINT, 3, (0.0, 0.0, 0.0, NAN), 0, 0, 3.0),
            mavlink.MAV_MISSION_INVALID_PARAM5_X,
            "position",
        ),
    ],
)
def test_a_bad_item_is_refused_with_its_number_and_the_right_result(bad, result, word):
    refusal = validate([TAKE_OFF, bad], WORLD)
    assert refusal is not None
    assert refusal.result == result
    assert "item 1" in refusal.text
    assert word in refusal.text


def test_a_good_mission_is_accepted():
    assert validate([TAKE_OFF, waypoint(5, 5, 3), LAND], WORLD) is None
