"""How missions are flown, on a vehicle that is at its reference one tick later."""

from itertools import pairwise

import pytest

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.plans.mission_item import MissionItem
from sitl.autopilot.mission.runner import MissionRunner
from sitl.autopilot.safety.arena import ARENAS
from sitl.autopilot.safety.world import World
from sitl.autopilot.settings import Settings
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import LAND, NAN, TAKE_OFF, item, waypoint

WORLD = World(LocalFrame(HOME), ARENAS["open"])


def fly(items, seconds=200.0, settings=None):
    """Fly a mission; returns (runner, path)."""
    runner = MissionRunner(tuple(items), WORLD, settings or Settings())
    p, path, time = (0.0, 0.0, 0.0), [], 0.0
    while not runner.finished and time < seconds:
        view = VehicleView(time, p, (0.0, 0.0, 0.0), 0.0, 0.0, False, 1.0)
        p = runner.update(view).position
        path.append((time, p))
        if runner.landing and p[2] <= 0.0:
            runner.touched_down()
        time += 0.02
    return runner, path


def test_a_mission_reaches_its_items_in_order():
    runner, path = fly([TAKE_OFF, waypoint(5, 0, 3), waypoint(5, -5, 3), LAND])
    assert runner.reached == [0, 1, 2, 3]
    assert runner.finished
    assert path[-1][1][:2] == pytest.approx((5.0, -5.0))


def test_a_hold_time_is_held():
    _, short = fly([TAKE_OFF, waypoint(5, 0, 3), LAND])
    _, long = fly([TAKE_OFF, waypoint(5, 0, 3, hold=7.0), LAND])
    assert long[-1][0] - short[-1][0] == pytest.approx(7.0, abs=0.05)


def test_take_off_climbs_at_the_set_rate():
    _, path = fly([TAKE_OFF, LAND], settings=Settings(climb_rate=0.5))
    assert max(b[1][2] - a[1][2] for a, b in pairwise(path)) <= 0.5 * 0.0201


def test_a_jump_repeats_its_items_the_given_number_of_times():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, 2.0, 0.0, 0.0))
    runner, _ = fly([TAKE_OFF, waypoint(5, 0, 3), waypoint(0, 0, 3), jump, LAND])
    assert runner.reached == [0, 1, 2, 3, 1, 2, 3, 1, 2, 3, 4]


def test_an_endless_loop_without_a_waypoint_is_stopped_and_reported():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(0.0, -1.0, 0.0, 0.0))
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 2.0, -1.0, 0.0))
    runner, _ = fly([speed, jump])
    assert runner.finished
    assert "loop" in runner.notices[-1]


def test_a_speed_above_the_hover_limit_is_limited_and_reported():
    speed = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 12.0, -1.0, 0.0))
    runner, _ = fly([TAKE_OFF, speed, waypoint(5, 0, 3), LAND])
    assert any("12 m/s" in text for text in runner.notices)
    assert runner.speed == Settings().hover_speed


def test_a_return_flies_home_and_lands():
    runner, path = fly([TAKE_OFF, waypoint(20, -10, 3), item(mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH)])
    assert runner.finished
    assert path[-1][1][:2] == (0.0, 0.0)
    assert max(p[2] for _, p in path) == pytest.approx(Settings().return_altitude)


def test_global_and_local_frames_name_the_same_point():
    here = WORLD.frame.to_geodetic((30.0, -12.0, -8.0))
    x, y = round(here.lat_deg * 1e7), round(here.lon_deg * 1e7)
    relative, absolute = (
        MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=frame, params=(0.0, 0.0, 0.0, NAN), x=x, y=y, z=z)
        for frame, z in ((mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, 8.0), (mavlink.MAV_FRAME_GLOBAL, 158.0))
    )
    ends = [fly([one, LAND])[1][0][1] for one in (relative, absolute, waypoint(30, 12, 8))]
    assert ends[0] == pytest.approx(ends[2], abs=0.02)
    assert ends[1] == pytest.approx(ends[2], abs=0.02)
