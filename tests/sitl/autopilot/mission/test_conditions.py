"""Items that wait for a condition: how long, while what is flown, and what becomes of those that still wait at its end.

On a vehicle that moves at a steady speed towards its reference.
"""

import math

import pytest

from protocol.dialect import mavlink as m
from protocol.frames import LocalFrame
from sitl.autopilot.mission.runner import MissionRunner
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import item, waypoint

WORLD = World(LocalFrame(HOME), ARENAS["open"])
SPEED, TICK = 2.0, 0.02  # [m/s], [s]
IMAGE = item(m.MAV_CMD_IMAGE_START_CAPTURE, params=(0.0, 0.0, 1.0, 0.0))
FIRST, SECOND = waypoint(0, 0, 5), waypoint(20, 0, 5)


def condition(command, *params):
    return item(command, params=(*params, *[0.0] * (4 - len(params))), frame=m.MAV_FRAME_MISSION)


def fly(items, seconds=60.0):
    """Gives (runner, orders): time, north and command of each that was carried out."""
    orders, now = [], [0.0, 0.0]
    runner = MissionRunner(
        tuple(items), WORLD, Settings(), None, lambda order: orders.append((now[0], now[1], order.command))
    )
    p, heading = (0.0, 0.0, 5.0), 0.0
    while not runner.finished and now[0] < seconds:
        now[1] = p[0]
        reference = runner.update(VehicleView(now[0], p, (0.0, 0.0, 0.0), heading, 0.0, False, 1.0))
        heading = (
            runner.turn.update(VehicleView(now[0], p, (0.0,) * 3, heading, 0.0, False, 1.0))
            if runner.turn
            else (reference.heading)
        )
        ahead = math.dist(p, reference.position)
        share = min(SPEED * TICK / ahead, 1.0) if ahead else 0.0
        p = tuple(a + share * (b - a) for a, b in zip(p, reference.position, strict=True))
        now[0] += TICK
    return runner, orders


def test_a_delay_lets_items_wait_while_the_next_leg_is_flown():
    runner, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 3.0), IMAGE, SECOND])
    assert runner.reached == [0, 1, 2, 3]
    ((time, north, _),) = orders
    assert time == pytest.approx(3.0, abs=0.05)
    assert north == pytest.approx(6.0, abs=0.2)


def test_a_distance_is_that_to_the_end_of_the_leg():
    _, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_DISTANCE, 5.0), IMAGE, SECOND])
    assert orders[0][1] == pytest.approx(15.0, abs=0.1)


def test_conditions_follow_one_another_on_one_leg():
    waits = [condition(m.MAV_CMD_CONDITION_DISTANCE, 15.0), IMAGE, condition(m.MAV_CMD_CONDITION_DELAY, 2.0), IMAGE]
    runner, orders = fly([FIRST, *waits, SECOND])
    assert [order[1] for order in orders] == pytest.approx([5.0, 9.0], abs=0.2)
    assert runner.reached == [0, 1, 2, 3, 4, 5]


def test_what_still_waits_at_the_end_of_the_leg_is_passed_over_and_said():
    runner, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 30.0), IMAGE, SECOND, waypoint(20, 5, 5)])
    assert orders == []
    assert runner.reached == [0, 3, 4]
    assert runner.notices == ["Passed over, its condition was not met: items 1, 2"]


def test_with_nothing_to_fly_after_it_the_vehicle_waits_where_it_is():
    runner, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 4.0), IMAGE])
    assert runner.finished
    assert orders[0][:2] == pytest.approx((4.0, 0.0), abs=0.05)
    _, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_DISTANCE, 4.0), IMAGE])
    assert orders[0][0] < 0.1


def test_a_heading_is_turned_to_and_waited_for_and_kept_to_the_end_of_the_leg():
    yaw = condition(m.MAV_CMD_CONDITION_YAW, 90.0, 15.0, 1.0)
    runner, orders = fly([FIRST, yaw, IMAGE, SECOND, waypoint(30, 0, 5)], seconds=9.0)
    assert orders[0][0] == pytest.approx(6.0, abs=0.1)
    assert runner.current == 3
    assert math.degrees(runner.turn.heading) == pytest.approx(-90.0)
    runner, _ = fly([FIRST, yaw, IMAGE, SECOND, waypoint(30, 0, 5)])
    assert runner.turn is None


def test_a_heading_turned_to_at_the_end_of_a_mission_stays():
    runner, orders = fly([FIRST, condition(m.MAV_CMD_CONDITION_YAW, 90.0, 0.0, 0.0), IMAGE])
    assert orders[0][0] == pytest.approx(3.0, abs=0.1)
    assert math.degrees(runner._reference.heading) == pytest.approx(-90.0)


def test_an_item_that_is_chosen_forgets_what_waits():
    runner = MissionRunner((FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 30.0), IMAGE, SECOND), WORLD, Settings())
    for time in (0.0, 0.02):
        runner.update(VehicleView(time, (0.0, 0.0, 5.0), (0.0,) * 3, 0.0, 0.0, False, 1.0))
    assert runner.current == 3
    assert runner._waiting.seqs == [1, 2]
    runner.jump_to(0)
    assert runner._waiting.seqs == []


def test_a_speed_may_wait_too():
    slow = condition(m.MAV_CMD_DO_CHANGE_SPEED, 1.0, 0.7, -1.0)
    runner, _ = fly([FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 2.0), slow, SECOND], seconds=1.0)
    assert runner.speed == Settings().hover_speed
    runner, _ = fly([FIRST, condition(m.MAV_CMD_CONDITION_DELAY, 2.0), slow, SECOND], seconds=3.0)
    assert runner.speed == 0.7
