"""Missions that are accepted, and refusals that name the item and the reason."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect import mavlink as m
from protocol.frames import LocalFrame
from protocol.plans.plan import MissionItem
from protocol.ranges import ITEM_RANGES
from sitl.autopilot.mission.items import SUPPORTED_COMMANDS, height_of, position_of, validate
from sitl.autopilot.mission.runner import MissionRunner
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import LAND, NAN, TAKE_OFF, item, waypoint

WORLD = World(LocalFrame(HOME), ARENAS["open"])


def speed(kind, value, throttle=-1.0):
    return item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(kind, value, throttle, 0.0))


@pytest.mark.parametrize(
    ("bad", "result", "word"),
    [
        (
            item(mavlink.MAV_CMD_DO_SET_SERVO),
            mavlink.MAV_MISSION_UNSUPPORTED,
            "DO_SET_SERVO (183)",
        ),
        (
            item(mavlink.MAV_CMD_NAV_WAYPOINT, 1, -1, 3, frame=mavlink.MAV_FRAME_BODY_FRD),
            mavlink.MAV_MISSION_UNSUPPORTED_FRAME,
            "frame",
        ),
        (item(mavlink.MAV_CMD_NAV_WAYPOINT, 1, -1, NAN), mavlink.MAV_MISSION_INVALID_PARAM7, "altitude"),
        (waypoint(2000, 0, 3), mavlink.MAV_MISSION_INVALID, "arena"),
        (waypoint(0, 0, -3), mavlink.MAV_MISSION_INVALID, "altitude"),
        (waypoint(1, -1, 3, hold=-1.0), mavlink.MAV_MISSION_INVALID_PARAM1, "hold"),
        (item(mavlink.MAV_CMD_DO_JUMP, params=(9.0, 1.0, 0.0, 0.0)), mavlink.MAV_MISSION_INVALID_PARAM1, "jump"),
        (
            item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, NAN, 0.0, 0.0)),
            mavlink.MAV_MISSION_INVALID_PARAM2,
            "speed",
        ),
        (speed(4.0, 2.0), mavlink.MAV_MISSION_INVALID_PARAM1, "speed type"),
        (speed(2.0, 3.0), mavlink.MAV_MISSION_INVALID_PARAM2, "speed"),
        (speed(1.0, -3.0), mavlink.MAV_MISSION_INVALID_PARAM2, "speed"),
        (speed(1.0, 2.0, 40.0), mavlink.MAV_MISSION_INVALID_PARAM3, "throttle"),
        (
            MissionItem(command=mavlink.MAV_CMD_NAV_WAYPOINT, frame=3, params=(0.0, 0.0, 0.0, NAN), x=0, y=0, z=3.0),
            mavlink.MAV_MISSION_INVALID_PARAM5_X,
            "position",
        ),
    ],
)
def test_an_invalid_item_is_refused_with_its_number_and_the_right_result(bad, result, word):
    refusal = validate([TAKE_OFF, bad], WORLD)
    assert refusal is not None
    assert refusal.result == result
    assert "item 1" in refusal.text
    assert word in refusal.text


@pytest.mark.parametrize("repeats", [math.inf, -math.inf, NAN, 1e38, 1e-45, 0.5, -2.0, 65536.0])
def test_a_jump_that_cannot_be_counted_is_refused_at_upload(repeats):
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, repeats, 0.0, 0.0))
    refusal = validate([TAKE_OFF, waypoint(1, 0, 3), jump, LAND], WORLD)
    assert refusal.result == mavlink.MAV_MISSION_INVALID_PARAM2
    assert refusal.text == (f"item 2: param2 is {repeats:g}, not -1 or a whole number from 0 to 65535 (repeat count)")


@pytest.mark.parametrize(
    ("command", "number"),
    [
        (mavlink.MAV_CMD_NAV_LOITER_UNLIM, 3),
        (mavlink.MAV_CMD_NAV_LOITER_TIME, 3),
        (mavlink.MAV_CMD_NAV_LOITER_TURNS, 3),
        (mavlink.MAV_CMD_NAV_LOITER_TO_ALT, 2),
    ],
)
@pytest.mark.parametrize("radius", [1600.0, -1600.0])
def test_a_circle_that_leaves_the_arena_is_refused_by_its_radius(command, number, radius):
    def circle(wanted):
        params = [0.0, 0.0, 0.0, NAN]
        params[number - 1] = wanted
        return validate([TAKE_OFF, item(command, 10, 0, 30, tuple(params))], WORLD)

    refusal = circle(radius)
    assert refusal.result == mavlink.MAV_MISSION_INVALID_PARAM1 + number - 1
    assert f"item 1: param{number} is {radius:g} (radius): on the circle, " in refusal.text
    assert "outside the arena" in refusal.text
    assert circle(40.0) is None
    assert circle(NAN) is None


def test_every_supported_item_has_its_ranges():
    assert set(ITEM_RANGES) >= SUPPORTED_COMMANDS


@pytest.mark.parametrize("frame", [77, 255])
def test_a_frame_that_nobody_knows_is_refused_in_an_item_without_a_position_too(frame):
    jump = item(mavlink.MAV_CMD_DO_JUMP, params=(0.0, 1.0, 0.0, 0.0), frame=frame)
    refusal = validate([TAKE_OFF, jump], WORLD)
    assert refusal == (f"item 1: frame {frame} is not supported", mavlink.MAV_MISSION_UNSUPPORTED_FRAME)


def test_a_valid_mission_is_accepted():
    assert validate([TAKE_OFF, waypoint(5, -5, 3), LAND], WORLD) is None


@pytest.mark.parametrize(
    "known", [speed(kind, value) for kind in range(4) for value in (-2.0, -1.0, 0.5)] + [speed(1.0, 2.0, NAN)]
)
def test_each_type_of_speed_and_its_special_values_are_accepted(known):
    assert validate([TAKE_OFF, known, LAND], WORLD) is None


def test_more_items_than_fit_are_refused():
    assert validate([waypoint(1, 0, 3)] * 1000, WORLD) is None
    refusal = validate([waypoint(1, 0, 3)] * 1001, WORLD)
    assert refusal.result == mavlink.MAV_MISSION_NO_SPACE
    assert refusal.text == "1001 items: the limit is 1000"


@pytest.mark.parametrize(("frame", "z"), [(mavlink.MAV_FRAME_LOCAL_NED, -7.0), (mavlink.MAV_FRAME_LOCAL_ENU, 7.0)])
def test_a_local_item_names_one_height_wherever_home_is(frame, z):
    world = World(LocalFrame(HOME), ARENAS["open"], home=(0.0, 0.0, 5.0))
    named = item(mavlink.MAV_CMD_NAV_TAKEOFF, 1, -1, -z, frame=frame)
    assert height_of(named, world) == position_of(named, world)[2] == 7.0


# Items that wait for a condition: how long, while what is flown, and what becomes of those that still wait at its end.
#
# On a vehicle that moves at a steady speed towards its reference.


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
