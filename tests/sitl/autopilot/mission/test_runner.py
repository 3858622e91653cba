"""Execution of missions, on a vehicle that is at its reference one tick later."""

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from protocol.dialect import mavlink
from protocol.dialect import mavlink as m
from protocol.dialect.vocabulary import LegMode
from protocol.frames import LocalFrame
from protocol.plans.plan import MissionItem
from sitl.autopilot.mission.runner import MissionRunner, return_pattern
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import FRAME, LAND, NAN, TAKE_OFF, item, waypoint

GROUND, CLIMB, DESCENT = (
    mavlink.SPEED_TYPE_GROUNDSPEED,
    mavlink.SPEED_TYPE_CLIMB_SPEED,
    mavlink.SPEED_TYPE_DESCENT_SPEED,
)
WORLD = World(LocalFrame(HOME), ARENAS["open"])


def fly(items, seconds=200.0, settings=None, start=(0.0, 0.0, 0.0)):
    """Fly a mission until it ends or pauses; returns (runner, path)."""
    runner = MissionRunner(tuple(items), WORLD, settings or Settings())
    return runner, fly_on(runner, seconds, start)


def fly_on(runner, seconds=200.0, start=(0.0, 0.0, 0.0)):
    """Fly a mission on until it ends or pauses; returns the path."""
    p, path, time = start, [], 0.0
    while not runner.finished and not runner.paused and time < seconds:
        view = VehicleView(time, p, (0.0, 0.0, 0.0), 0.0, 0.0, landed=p[2] <= 0.0, battery_remaining=1.0)
        p = runner.update(view).position
        path.append((time, p))
        if runner.landing and p[2] <= 0.0:
            runner.touched_down()
        time += 0.02
    return path


def speed_item(kind, speed, throttle=-1.0):
    return item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(kind, speed, throttle, 0.0))


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


def test_begun_again_a_mission_repeats_its_jumps_and_starts_at_the_usual_speed_and_way():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, 2.0, 0.0, 0.0))
    hover = item(mavlink.MAV_CMD_DO_VTOL_TRANSITION, params=(mavlink.MAV_VTOL_STATE_MC, 0.0, 0.0, 0.0))
    items = [TAKE_OFF, waypoint(2, 0, 3), waypoint(0, 0, 3), jump, speed_item(GROUND, 0.5), hover, LAND]
    runner, _ = fly(items)
    first = runner.reached.copy()
    assert (runner.speed, runner._requested) == (0.5, LegMode.HOVER)
    runner.reached.clear()
    runner.restart()
    assert (runner.speed, runner._requested) == (Settings().hover_speed, LegMode.NONE)
    fly_on(runner)
    assert runner.reached == first


def test_a_reset_lets_the_jumps_of_the_present_item_begin_anew():
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, 1.0, 0.0, 0.0))
    runner, _ = fly([TAKE_OFF, waypoint(2, 0, 3), jump, waypoint(0, 0, 3)])
    runner.reached.clear()
    runner.jump_to(1)
    fly_on(runner, start=(0.0, 0.0, 3.0))
    assert runner.reached == [1, 2, 3]
    runner.reached.clear()
    runner.jump_to(1)
    runner.reset()
    fly_on(runner, start=(0.0, 0.0, 3.0))
    assert runner.reached == [1, 2, 1, 2, 3]


def test_a_jump_that_is_replaced_counts_anew():
    jumps = [item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, n, 0.0, 0.0)) for n in (1.0, 2.0)]
    plans = [(TAKE_OFF, waypoint(2, 0, 3), jump, waypoint(0, 0, 3)) for jump in jumps]
    runner, _ = fly(plans[0])
    runner.reached.clear()
    runner.jump_to(1)
    runner.revise(plans[1])
    fly_on(runner, start=(0.0, 0.0, 3.0))
    assert runner.reached == [1, 2, 1, 2, 1, 2, 3]


@pytest.mark.parametrize("command", [mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF])
@pytest.mark.parametrize("height", [2.0, 50.0])
def test_a_take_off_met_in_the_air_is_passed_over(command, height):
    items = [waypoint(2, 0, height), item(command, 2, 0, 10.0), waypoint(4, 0, height)]
    runner, path = fly(items, start=(0.0, 0.0, height))
    assert runner.reached == [0, 1, 2]
    assert {p[2] for _, p in path} == {height}
    assert "Take-off of item 1 passed over: already in the air" in runner.notices


def test_a_take_off_after_a_wait_on_the_ground_climbs_whatever_the_law_does_meanwhile():
    wait = item(mavlink.MAV_CMD_NAV_DELAY, params=(2.0, 0.0, 0.0, 0.0))
    runner = MissionRunner((wait, item(mavlink.MAV_CMD_NAV_TAKEOFF, up=10.0), waypoint(9, 0, 3)), WORLD, Settings())
    fly_on(runner, 1.0)
    runner.interrupt()
    path = fly_on(runner, 30.0, start=(0.0, 0.0, 0.2))  # the motors have lifted it a little
    assert max(p[2] for _, p in path) == pytest.approx(10.0, abs=0.3)


def test_a_take_off_that_was_interrupted_goes_on_and_does_not_sink_to_its_height():
    runner = MissionRunner((item(mavlink.MAV_CMD_NAV_TAKEOFF, up=10.0), waypoint(9, 0, 10)), WORLD, Settings())
    fly_on(runner, 2.0)
    runner.interrupt()
    assert fly_on(runner, 3.0, start=(0.0, 0.0, 2.0))[-1][1] == pytest.approx((0.0, 0.0, 5.0), abs=0.1)
    runner.interrupt()
    fly_on(runner, 3.0, start=(0.0, 0.0, 30.0))
    assert runner.current == 1


def test_after_an_item_whose_autocontinue_is_off_the_mission_pauses_and_goes_on_when_told():
    stop = replace(waypoint(2, 0, 3), autocontinue=False)
    runner, path = fly([TAKE_OFF, stop, waypoint(0, 0, 3)])
    assert (runner.paused, runner.finished, runner.current, runner.reached) == (True, False, 2, [0, 1])
    assert path[-1][1] == (2.0, 0.0, 3.0)
    assert "Mission paused after item 1: continue to go on" in runner.notices
    runner.interrupt()
    fly_on(runner, start=(2.0, 0.0, 3.0))
    assert (runner.paused, runner.finished, runner.reached) == (False, True, [0, 1, 2])


def test_the_last_item_completes_the_mission_whatever_its_autocontinue():
    runner, _ = fly([TAKE_OFF, replace(waypoint(2, 0, 3), autocontinue=False)])
    assert (runner.finished, runner.paused) == (True, False)


def test_a_new_speed_acts_within_the_leg_and_so_does_that_of_the_settings():
    runner = MissionRunner((waypoint(200, 0, 3),), WORLD, Settings())
    view = VehicleView(0.0, (0.0, 0.0, 3.0), (0.0, 0.0, 0.0), 0.0, 0.0, landed=False, battery_remaining=1.0)
    assert runner.update(view).speed == Settings().hover_speed
    runner.configure(Settings(hover_speed=2.0))
    assert runner.update(view).speed == 2.0
    runner.change_speed(GROUND, 0.5)
    assert runner.update(view).speed == 0.5
    runner.configure(Settings(hover_speed=4.0))
    assert runner.update(view).speed == 0.5
    runner.change_speed(GROUND, -1.0)
    assert runner.update(view).speed == 0.5
    runner.change_speed(GROUND, -2.0)
    assert runner.update(view).speed == 4.0


@pytest.mark.parametrize(("kind", "up", "rate"), [(CLIMB, 9.0, 0.5), (DESCENT, 3.0, -0.5)])
def test_a_vertical_speed_changes_that_and_leaves_the_horizontal_one(kind, up, rate):
    runner, path = fly([speed_item(kind, 0.5), waypoint(20, 0, up)], start=(0.0, 0.0, 6.0))
    assert runner.speed == Settings().hover_speed
    rates = [(b[1][2] - a[1][2]) / (b[0] - a[0]) for a, b in pairwise(path[1:-1])]
    assert rates == pytest.approx([rate] * len(rates), abs=0.01)
    assert path[-1][0] == pytest.approx(6.0, abs=1.2)  # the acceptance radius is reached a little earlier


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


# Choice of a mission's landing for a return, by RTL_TYPE.


RETURN_PATTERNS_WORLD = World(FRAME, ARENAS["open"])
START = item(m.MAV_CMD_DO_LAND_START, frame=m.MAV_FRAME_MISSION)
CIRCLE = item(m.MAV_CMD_NAV_LOITER_TO_ALT, 200, 0, 25, (1.0, 40.0, 0.0, 1.0))
LANDING = item(m.MAV_CMD_NAV_VTOL_LAND, 100, 0, 0)
ITEMS = (
    waypoint(50, 0, 20),
    START,
    CIRCLE,
    LANDING,
    START,
    waypoint(-200, 0, 30),
    item(m.MAV_CMD_NAV_LAND, -100, 0, 0),
)


def pattern(north, kind=1, items=ITEMS, world=RETURN_PATTERNS_WORLD):
    return return_pattern(items, world, Settings(return_type=kind), (north, 0.0, 20.0))


def test_the_nearest_landing_is_flown():
    assert pattern(30.0).start == 1
    assert pattern(-30.0).start == 4
    assert pattern(-30.0).points == ((-200.0, 0.0, 30.0), (-100.0, 0.0, 30.0))


def test_the_energy_of_a_circle_counts():
    length = sum(math.dist(a, b) for a, b in zip(pattern(30.0).points, pattern(30.0).points[1:], strict=False))
    assert length == pytest.approx(100.0 + 40.0 + 80.0 + 80.0 + 40.0)


@pytest.mark.parametrize(("kind", "north", "start"), [(0, 150.0, None), (3, 150.0, 1), (3, 50.0, None), (1, 1.0, 1)])
def test_rtl_type_says_whether(kind, north, start):
    found = pattern(north, kind)
    assert (None if found is None else found.start) == start


def test_a_rally_point_may_be_nearer():
    assert pattern(150.0, 3, world=RETURN_PATTERNS_WORLD._replace(rally=((140.0, 0.0, 5.0),))) is None


@pytest.mark.parametrize("items", [(), ITEMS[:1], ITEMS[:3], (START, item(m.MAV_CMD_NAV_RETURN_TO_LAUNCH))])
def test_a_start_without_a_landing_is_none(items):
    assert pattern(30.0, items=items) is None


def test_an_item_is_told_once_where_its_hold_begins():
    """MISSION_ITEM_REACHED: the vehicle is there, and "will either hold this position ... or continue"."""
    runner = MissionRunner((waypoint(5, 0, 3, hold=4.0), waypoint(5, -5, 3)), WORLD, Settings())
    seen, p, still = [], (5.0, 0.0, 3.0), (0.0, 0.0, 0.0)
    for tick in range(600):
        if not runner.finished:
            p = runner.update(
                VehicleView(0.02 * tick, p, still, 0.0, 0.0, landed=False, battery_remaining=1.0)
            ).position
        seen += [(seq, 0.02 * tick) for seq in runner.reached]
        runner.reached.clear()
    (first, begun), (second, behind) = seen
    assert (first, begun, second) == (0, pytest.approx(0.0, abs=0.1), 1)
    assert behind >= 4.0


def test_a_delay_is_reached_behind_it():
    delay = item(mavlink.MAV_CMD_NAV_DELAY, params=(2.0, -1.0, -1.0, -1.0))
    runner = MissionRunner((delay,), WORLD, Settings())
    runner.update(VehicleView(0.0, (5.0, 0.0, 3.0), (0.0, 0.0, 0.0), 0.0, 0.0, landed=False, battery_remaining=1.0))
    assert runner.reached == []
