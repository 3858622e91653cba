"""Stages that lead to no waypoint: sticks, commands, attitudes, and another aircraft."""

import math

import pytest

from sitl.autopilot.flight_plan.aims import AimKind
from sitl.autopilot.flight_plan.plan_state import LOST_AFTER, MAX_AIRCRAFT, OtherAircraft
from sitl.autopilot.settings import Settings
from tests.support.plans import plan_of
from tests.support.vehicle.plan_ticks import PlanTicks
from tests.support.vehicle.planned_flight import PlannedFlight

FOLLOW = '<block name="F"><follow ac_id="7" distance="3" height="2"/></block>'
SPEED = Settings().hover_speed


def ticks_of(stage, **inputs):
    ticks = PlanTicks(f'<block name="a">{stage}</block>')
    ticks.inputs |= inputs
    return ticks


# Another aircraft


def test_an_aircraft_is_followed_behind_and_above():
    flight = PlannedFlight(plan_of(FOLLOW), arena="open", up=4.0)
    for step in range(150):  # northwards
        flight.plan.others.take(7, flight.time, (5.0 + 0.2 * step, 1.0, 3.0), (2.0, 0.0, 0.0))
        flight.advance(0.1)
    north_of_it = 5.0 + 0.2 * 150 - flight.autopilot.view.p[0]
    assert north_of_it == pytest.approx(3.0, abs=0.1)
    assert flight.p[[0, 2]] == pytest.approx((-1.0, 5.0), abs=0.1)


def test_while_the_aircraft_is_silent_the_vehicle_stays():
    others = OtherAircraft()
    others.take(7, 0.0, (20.0, 0.0, 3.0), (2.0, 0.0, 0.0))
    ticks = ticks_of('<follow ac_id="7" distance="3" height="2"/>', others=others)
    ticks.tick()
    assert ticks.aim.end.y > 10.0
    assert ticks.aim.is_hovered
    ticks.seconds(LOST_AFTER + 0.2)
    ticks.p = (1.0, 0.0, 2.0)  # drifts, and is held where it was when it lost the other
    ticks.tick()
    assert ticks.aim.end == (0.0, 0.0, 2.0)
    assert ticks.remarks == ["<follow> holds: aircraft 7 is not heard"]
    others.take(7, ticks.time, (30.0, 0.0, 3.0), (2.0, 0.0, 0.0))
    ticks.tick()
    assert ticks.aim.end.y > 20.0


def test_the_stage_after_a_lost_aircraft_says_nothing_of_it():
    ticks = PlanTicks(f'{FOLLOW}<block name="S"><stay wp="A"/></block>').tick()
    ticks.executor.jump(1)
    ticks.tick(2)
    assert ticks.aim.end[:2] == (3.0, 4.0)
    assert ticks.remarks == ["<follow> holds: aircraft 7 is not heard"]


def test_behind_an_aircraft_that_stands_is_on_its_last_course_or_on_our_side():
    others = OtherAircraft()
    others.take(7, 0.0, (20.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    ticks = ticks_of('<follow ac_id="7" distance="3" height="2"/>', others=others)
    ticks.tick()
    assert ticks.aim.end == pytest.approx((0.0, 17.0, 5.0))
    others.take(7, 0.0, (20.0, 0.0, 3.0), (0.0, -1.0, 0.0))  # eastwards
    others.take(7, 0.0, (20.0, 0.0, 3.0), (0.0, 0.0, 0.0))
    ticks.tick()
    assert ticks.aim.end == pytest.approx((-3.0, 20.0, 5.0))


def test_it_follows_no_lower_than_the_plans_security_height():
    others = OtherAircraft()
    others.take(7, 0.0, (20.0, 0.0, -4.0), (0.0, 0.0, 0.0))
    assert ticks_of('<follow ac_id="7" distance="3" height="2"/>', others=others).tick().aim.end.z == 1.0


@pytest.mark.parametrize("number", ["8", "1/0.0", "-1"])
def test_an_aircraft_that_never_was_is_not_followed(number):
    ticks = ticks_of(f'<follow ac_id="{number}" distance="3" height="2"/>')
    assert ticks.tick().aim.end == (0.0, 0.0, 2.0)
    assert "holds" in ticks.remarks[0] or "not flown" in ticks.remarks[0]


def test_only_so_many_aircraft_are_remembered():
    others = OtherAircraft()
    for system in range(MAX_AIRCRAFT + 1):
        others.take(system, float(system), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert len(others.heard) == MAX_AIRCRAFT
    assert 0 not in others.heard


# Sticks and commands


def test_the_vertical_mode_xyz_climbs_by_the_sticks():
    ticks = ticks_of('<stay wp="A" vmode="xyz"/>', stick_velocity=(1.0, 2.0, 0.7))
    ticks.tick()
    assert (ticks.aim.kind, ticks.aim.end[:2], ticks.aim.climb) == (AimKind.POINT, (3.0, 4.0), 0.7)


@pytest.mark.parametrize(
    ("commands", "east", "north", "turn"),
    [
        ("roll='9600' yaw='0'", SPEED, 0.0, 0.0),
        ("roll='0' pitch='-4800' yaw='-9600'", 0.0, 0.5 * SPEED, -30.0),
        ("roll='99999' pitch='-9600' yaw='0'", SPEED / math.sqrt(2.0), SPEED / math.sqrt(2.0), 0.0),
    ],
)
def test_commands_of_a_manual_stage_are_flown_as_sticks(commands, east, north, turn):
    aim = ticks_of(f'<manual {commands} vmode="climb" climb="0.5"/>').tick().aim
    assert (aim.kind, aim.climb) == (AimKind.VELOCITY, 0.5)
    assert aim.end[:2] == pytest.approx((east, north))
    assert math.degrees(aim.turn_rate) == pytest.approx(turn)


# Attitudes


def test_the_level_attitude_stays():
    assert ticks_of('<attitude roll="0" pitch="auto" vmode="alt" alt="104"/>').tick().aim.end == (0.0, 0.0, 4.0)


@pytest.mark.parametrize(
    ("angles", "east", "north"), [('roll="5"', 1, 0), ('roll="0" pitch="5"', 0, -1), ('roll="-5"', -1, 0)]
)
def test_a_lean_of_the_hover_accelerates_as_the_angle_does(angles, east, north):
    ticks = ticks_of(f'<attitude {angles} vmode="alt" alt="104"/>').seconds(2.0)
    gained = 9.81 * math.tan(math.radians(5.0)) * (ticks.time - 0.05)
    assert ticks.aim.kind is AimKind.VELOCITY
    assert ticks.aim.end == pytest.approx((east * gained, north * gained, 4.0))
    ticks.seconds(20.0)
    assert math.hypot(*ticks.aim.end[:2]) == pytest.approx(SPEED)


@pytest.mark.parametrize(("roll", "side"), [(20.0, 1.0), (-20.0, -1.0)])
def test_a_bank_in_forward_flight_is_the_circle_of_that_turn(roll, side):
    ticks = ticks_of(f'<attitude roll="{roll}" vmode="alt" alt="104"/>')
    ticks.told, ticks.v = {"forward": True}, (0.0, 15.0, 0.0)  # northwards
    ticks.tick()
    radius = 15.0**2 / (9.81 * math.tan(math.radians(20.0)))
    assert (ticks.aim.kind, ticks.aim.radius) == (AimKind.ARC, pytest.approx(side * radius))
    assert ticks.aim.end == pytest.approx((side * radius, 0.0, 4.0))
    ticks.p = (3.0, 20.0, 4.0)
    assert ticks.tick().aim.end == pytest.approx((side * radius, 0.0, 4.0))  # the same turn


def test_another_bank_is_another_turn_of_the_same_stage():
    ticks = ticks_of('<attitude roll="block_time * 10.0" vmode="alt" alt="104"/>')
    ticks.told, ticks.v = {"forward": True}, (0.0, 15.0, 0.0)
    first, second = ticks.seconds(1.5).aim, ticks.seconds(1.0).aim
    assert first.kind is second.kind is AimKind.ARC
    assert (second.key.stage, second.key.part) == (first.key.stage, first.key.part + 1)
    assert second.radius < first.radius
