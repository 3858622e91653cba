"""Names that a plan uses: functions and variables of an autopilot, a user's meanings for more, and fixed values."""

import math

import pytest

from protocol.flight_plans import read_flight_plan
from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import CONSTANTS, block_number, plan_constants, waypoint_numbers
from tests.support.plans import plan_of, plan_text


def refusals(call, sector=""):
    check = check_flown(plan_of(f'<block name="a"/><block name="b"><call_once fun="{call}"/></block>', sector))
    return [finding.reason for finding in check.refusals]


@pytest.mark.parametrize(
    ("name", "arguments"),
    [
        ("NavSetWaypointHere", ["WP_A"]),
        ("GetDistanceToWaypoint", ["WP_A"]),
        ("NavCopyWaypoint", ["WP_A", "WP_B"]),
        ("NavCopyWaypointPositionOnly", ["WP_A", "WP_B"]),
        ("NavApproaching", ["WP_A", "3"]),
        ("NavApproachingFrom", ["WP_A", "WP_B", "3"]),
        ("nav_compute_baseleg", ["WP_A", "WP_B", "WP_C", "80"]),
        ("increase_nav_heading", ["&amp;nav.heading", "1"]),
        ("nav_set_heading_deg", ["90"]),
        ("NavResurrect", []),
        ("CloseDegAngles", ["1", "2"]),
    ],
)
def test_a_function_takes_its_number_of_arguments(name, arguments):
    count = len(arguments)
    assert refusals(f"{name}({', '.join(arguments)})") == []
    assert refusals(f"{name}({', '.join([*arguments, '1'])})") == [f"takes {count} arguments, not {count + 1}"]
    if arguments:
        assert refusals(f"{name}({', '.join(arguments[:-1])})") == [f"takes {count} arguments, not {count - 1}"]


def test_the_function_of_a_sector_takes_east_and_north():
    corners = "".join(f'<corner name="{name}"/>' for name in "ABC")
    sector = f'<sectors><sector name="Room">{corners}</sector></sectors>'
    assert refusals("InsideRoom(1, 2)", sector) == []
    for wrong in ("InsideRoom(1)", "InsideRoom(1, 2, 3)"):
        assert len(refusals(wrong, sector)) == 1


def test_constants_have_the_values_of_c_and_of_paparazzi():
    assert (CONSTANTS["M_PI"], CONSTANTS["M_PI_2"]) == (math.pi, math.pi / 2)
    assert [CONSTANTS[name] for name in ("FALSE", "TRUE", "false", "true")] == [0, 1, 0, 1]
    assert [CONSTANTS[name] for name in ("RC_OK", "RC_LOST", "RC_REALLY_LOST")] == [0, 1, 2]  # radio_control.h
    bits = {"XY_OFFSET": 0, "XY_BODY": 1, "Z_OFFSET": 2, "YAW_OFFSET": 3, "XY_VEL": 5, "Z_VEL": 6, "YAW_RATE": 7}
    assert {name: CONSTANTS[f"GUIDED_FLAG_{name}"] for name in bits} == {name: 1 << bit for name, bit in bits.items()}


TEXT = plan_text('<block name="a"/><block name="b"/>')  # ground 100 m, default altitude 102 m, security height 1 m


def constants(text):
    return plan_constants(read_flight_plan(text.encode(), "t"))


def test_heights_and_distances_are_those_of_the_plan():
    found = constants(TEXT)
    assert (found["GROUND_ALT"], found["NAV_DEFAULT_ALT"]) == (100.0, 102.0)
    assert (found["SECURITY_HEIGHT"], found["SECURITY_ALT"]) == (1.0, 101.0)
    assert (found["MAX_DIST_FROM_HOME"], found["max_dist_from_home"]) == (100.0, 100.0)


def test_the_vehicle_goes_home_at_the_security_height_unless_the_plan_has_another():
    assert constants(TEXT)["HOME_MODE_HEIGHT"] == 1.0
    assert constants(TEXT.replace('alt="102"', 'alt="102" home_mode_height="7"'))["HOME_MODE_HEIGHT"] == 7.0


def test_the_runway_is_north_unless_the_plan_has_another():
    assert constants(TEXT)["QFU"] == 0.0
    assert constants(TEXT.replace('alt="102"', 'alt="102" qfu="270"'))["QFU"] == 270.0


def test_waypoints_are_numbered_in_the_order_of_the_plan_and_home_is_behind_the_last_block():
    plan = read_flight_plan(TEXT.encode(), "t")
    numbers = waypoint_numbers(plan)
    assert numbers == {"HOME": 1, "A": 2, "B": 3, "C": 4}
    assert [constants(TEXT)[f"WP_{name}"] for name in ("dummy", *numbers)] == [0, 1, 2, 3, 4]
    assert [block_number(plan, name) for name in ("a", "b", "HOME", "c")] == [0, 1, 2, None]
