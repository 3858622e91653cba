"""The functions and constants that plans of Paparazzi name, as its headers declare them."""

import math

import pytest

from protocol.flight_plans.plan_check import check_flown
from protocol.flight_plans.plan_names import CONSTANTS
from tests.support.plans import plan_of


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
