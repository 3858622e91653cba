"""Paparazzi's navigation modules, flown by a vehicle without a fault."""

import math
from itertools import pairwise

import pytest

from protocol.flight_plans import read_flight_plan
from sitl.autopilot.flight_plan.aims import AimKind
from sitl.autopilot.flight_plan.plan_state import MotorRequest
from tests.support.plans import HEAD
from tests.support.vehicle.plan_ticks import PlanTicks

WAYPOINTS = "".join(
    f'<waypoint name="{name}" x="{x}" y="{y}" height="30"/>'
    for name, x, y in (
        ("HOME", 0, 0),
        ("A", -50, 40),
        ("B", 50, 40),
        ("S1", 0, 0),
        ("S2", 80, 0),
        ("S3", 80, 60),
        ("S4", 0, 60),
    )
)
REST = '<block name="rest"><stay wp="HOME"/></block>'


def plan(blocks):
    head = HEAD.replace('max_dist_from_home="100"', 'max_dist_from_home="1000"')
    text = f"{head}<waypoints>{WAYPOINTS}</waypoints><blocks>{blocks}{REST}</blocks></flight_plan>"
    return read_flight_plan(text.encode(), "t")


def begun(stages, p=(0.0, 0.0, 30.0)):
    ticks = PlanTicks("", plan=plan(f'<block name="a">{stages}</block>'))
    ticks.p = p
    return ticks


def distances(passed, place):
    return [math.dist(p[:2], place) for p in passed]


@pytest.mark.parametrize(
    "stages",
    [
        '<call_once fun="nav_line_setup()"/><call fun="nav_line_run(WP_A, WP_B, 15)"/>',
        '<call fun="nav_line_init()"/><call fun="nav_line(WP_A, WP_B, 15)"/>',
    ],
)
def test_a_line_is_flown_there_and_back_over_both_ends(stages):
    ticks = begun(stages)
    passed = ticks.fly(120)
    assert (ticks.block, ticks.remarks) == ("a", [])
    kinds = {ticks.aim.kind}
    assert kinds <= {AimKind.LEG, AimKind.ARC}
    for end in ((-50, 40), (50, 40)):
        assert min(distances(passed, end)) < 1.0
    assert all(abs(p[2] - 30.0) < 1.0 for p in passed[100:])
    # U-turns end on the line: between the ends the vehicle is on it.
    between = [p for p in passed[300:] if abs(p[0]) < 45.0]
    assert between
    assert max(abs(p[1] - 40.0) for p in between) < 0.6
    assert max(abs(p[0]) for p in passed) < 50.0 + (1.0 + math.sqrt(3.0)) * 15.0 + 1.0


def test_a_flower_goes_through_its_centre_again_and_again_by_other_ways():
    ticks = begun(
        '<set var="nav_radius" value="12"/><call_once fun="nav_flower_setup(WP_HOME, WP_A)"/>'
        '<call fun="nav_flower_run()"/>',
        (90.0, 0.0, 30.0),
    )
    passed, radius = ticks.fly(150), math.hypot(50, 40)
    crossings = [p for p, q in pairwise(passed) if math.hypot(*p[:2]) > 5.0 >= math.hypot(*q[:2])]
    assert len(crossings) >= 5
    bearings = {round(math.atan2(p[0], p[1]), 1) for p in crossings}
    assert len(bearings) >= 4
    assert max(distances(passed[200:], (0, 0))) < radius + 2 * 12.0 + 1.0


@pytest.mark.parametrize("lines", ["NS", "WE"])
def test_a_rectangle_is_swept_line_by_line_and_the_sweeps_are_counted(lines):
    ticks = begun(
        f'<call_once fun="nav_survey_rectangle_rotorcraft_setup(WP_S1, WP_S3, sweep/2.5, {lines})"/>'
        '<exception cond="rectangle_survey_sweep_num == 1" deroute="rest"/>'
        '<call fun="nav_survey_rectangle_rotorcraft_run(WP_S1, WP_S3)"/>',
    )
    assert ticks.executor.names.value("sweep") == 25.0
    passed = ticks.fly(200)
    assert (ticks.block, ticks.remarks) == ("rest", [])
    across, along = (0, 1) if lines == "NS" else (1, 0)
    width, length = (80.0, 60.0) if lines == "NS" else (60.0, 80.0)
    mid = [p for p in passed if abs(p[along] - 0.5 * length) < 0.3]
    flown = sorted({round(p[across], 1) for p in mid})
    assert flown[0] == pytest.approx(2.5, abs=0.3)
    assert flown[-1] > width - 10.0
    assert max(b - a for a, b in pairwise(flown)) < 10.5
    assert max(p[across] for p in passed) < width + 0.6


def test_a_polygon_is_swept_to_its_end():
    ticks = begun(
        '<call_once fun="nav_survey_poly_osam_setup(WP_S1, 4, 10, 0)"/>'
        '<exception cond="PolySurveySweepBackNum >= 1" deroute="rest"/><call fun="nav_survey_poly_osam_run()"/>',
    )
    passed = ticks.fly(300)
    assert (ticks.block, ticks.remarks) == ("rest", [])
    assert ticks.executor.names.value("PolySurveySweepNum") == 6
    # Every place of the rectangle comes nearer to the path than a sweep's width.
    for x in range(5, 80, 10):
        for y in range(5, 60, 10):
            assert min(distances(passed, (x, y))) < 12.0


@pytest.mark.parametrize(
    ("setup", "run"),
    [
        ("nav_survey_polygon_setup(WP_S1, 4, 90, 10, 30, 5, GROUND_ALT + 25)", "nav_survey_polygon_run()"),
        ("nav_survey_hybrid_setup_orientation(WP_S1, 0, 4, 10, -1)", "nav_survey_hybrid_run()"),
        ("nav_survey_hybrid_setup_towards(WP_S1, WP_S2, 4, 10, -1)", "nav_survey_hybrid_run()"),
    ],
)
def test_other_modules_sweep_polygons_too(setup, run):
    ends = "" if "polygon" in setup else '<exception cond="PolySurveySweepBackNum >= 1" deroute="rest"/>'
    ticks = begun(f'{ends}<call_once fun="{setup}"/><call fun="{run}"/>')
    passed = ticks.fly(200)
    assert (ticks.block, ticks.remarks) == ("rest", [])
    height = 25.0 if "polygon" in setup else 30.0
    lines = {round(p[1]) for p in passed if abs(p[0] - 40.0) < 0.3 and abs(p[2] - height) < 0.5}
    assert lines >= {5, 15, 25, 35, 45, 55}


def test_a_polygon_may_be_swept_towards_a_waypoint():
    ticks = begun(
        '<call_once fun="nav_survey_poly_osam_setup_towards(WP_S1, 4, 10, WP_S2)"/>'
        '<call fun="nav_survey_poly_osam_run()"/>'
    )
    ticks.fly(30)
    leg = ticks.aim
    while leg.kind is not AimKind.LEG:
        ticks.fly(0.5)
        leg = ticks.aim
    assert leg.start.y == pytest.approx(leg.end.y)


def test_a_skid_landing_circles_down_glides_and_sinks_at_the_touch_down_point():
    ticks = begun(
        '<set var="WaypointAlt(WP_A)" value="115"/><set var="WaypointAlt(WP_B)" value="100"/>'
        '<call_once fun="nav_skid_landing_setup(WP_A, WP_B, 20)"/><call fun="nav_skid_landing_run()"/>',
        (-50.0, 60.0, 45.0),
    )
    passed = ticks.fly(90)
    assert ticks.remarks == []
    assert ticks.p == pytest.approx((50.0, 40.0, 0.0), abs=0.6)
    low = [p for p in passed if p[2] < 1.5]
    assert max(distances(low, (50, 40))) < 0.6  # nothing is flown near the ground but straight down
    assert MotorRequest.STOP in ticks.executor.take_motor_requests()


def test_a_take_off_starts_the_motors_rises_and_ends():
    ticks = begun('<call fun="nav_takeoff_from_wp(WP_A)"/>', (3.0, 2.0, 0.0))
    ticks.inputs = {"armed": False, "flying": True}
    ticks.tick(3)
    assert MotorRequest.START in ticks.executor.take_motor_requests()
    assert ticks.executor.waypoints.at("A")[:2] == (3.0, 2.0)
    ticks.inputs["armed"] = True
    passed = ticks.fly(6)
    assert ticks.block == "rest"
    assert max(p[2] for p in passed if p[:2] == (3.0, 2.0)) >= 2.0


def test_a_take_off_without_motors_ends_where_it_stands():
    ticks = begun('<call fun="nav_takeoff_from_here()"/>', (3.0, 2.0, 0.0))
    ticks.inputs = {"armed": False, "flying": False}
    ticks.seconds(2.0)
    assert ticks.block == "rest"


@pytest.mark.parametrize(
    ("call", "td", "begins"),
    [
        ("nav_land_at_wp(WP_B, WP_B, 0.)", (50.0, 40.0), (50.0, 40.0)),
        ("nav_land_at_wp(WP_B, WP_A, 0.)", (50.0, 40.0), (-50.0, 40.0)),
        ("nav_land_here(0., 0.)", (0.0, 0.0), (0.0, 0.0)),
        (
            "nav_land_at_loc(0., waypoint_get_lat_deg(WP_S3), waypoint_get_lon_deg(WP_S3), 270, 20, 0.)",
            (80.0, 60.0),
            (60.0, 60.0),
        ),
    ],
)
def test_landings_end_at_their_touch_down_point_with_the_motors_off(call, td, begins):
    low = '<set var="waypoints[WP_B].enu_f.z" value="0"/>'
    ticks = begun(f'{low}<call fun="{call}"/>')
    passed = ticks.fly(60, speed=5.0)
    assert ticks.entered == ["a", "rest"]
    assert ticks.remarks == []
    landed = [p for p in passed if p[2] < 0.3]
    assert landed[0][:2] == pytest.approx(td, abs=0.6)
    assert min(distances(passed, begins)) < 0.6
    assert MotorRequest.STOP in ticks.executor.take_motor_requests()


def test_a_set_point_of_the_guided_mode_is_flown_until_another_stage_flies():
    ticks = begun(
        '<call_once fun="autopilot_guided_update(GUIDED_FLAG_XY_OFFSET, 5, 2, -20, 0)"/>'
        '<while cond="LessThan(block_time, 2)"/>'
        '<while cond="1"><call_once fun="autopilot_guided_update(GUIDED_FLAG_XY_VEL, 1, 2, -20, 0)"/></while>',
    ).tick()
    assert (ticks.aim.kind, ticks.aim.end) == (AimKind.POINT, (2.0, 5.0, 20.0))
    ticks.seconds(3.0)
    key = ticks.aim.key
    assert (ticks.aim.kind, ticks.aim.end[:2]) == (AimKind.VELOCITY, (2.0, 1.0))
    ticks.seconds(1.0)
    assert ticks.aim.key == key


@pytest.mark.parametrize(
    ("call", "words"),
    [
        ("nav_flower_run()", "nav_flower_setup() was not called before"),
        ("nav_line_run(WP_A, WP_A, 10)", "a line without length"),
        ("nav_survey_poly_osam_run()", "no survey of a polygon was set up before"),
        ("nav_survey_poly_osam_setup(WP_S1, 2, 10, 0)", "2 corners are no polygon"),
        ("nav_skid_landing_setup(WP_A, WP_B, 0)", "a circle without a radius"),
        ("nav_land_at_loc(0, 91, 0, 0, 1, 0)", "91, 0 are not on the globe"),
    ],
)
def test_a_routine_that_cannot_be_flown_is_told_and_passed_over(call, words):
    ticks = begun(f'<call fun="{call}"/>').tick(3)
    assert ticks.block == "rest"
    (remark,) = ticks.remarks
    assert words in remark


def test_coordinates_are_set_as_in_c_and_what_is_no_coordinate_is_told():
    ticks = begun(
        '<set var="WaypointX(WP_A)" value="7"/><set var="waypoints[WP_A].y" value="WaypointX(WP_A) + 1"/>'
        '<set var="waypoints[WP_A].a" value="GROUND_ALT + 3"/><call_once fun="WaypointAlt(WP_B) = 1e9"/>'
    ).tick()
    assert ticks.executor.waypoints.at("A") == (7.0, 8.0, 3.0)
    assert ticks.executor.waypoints.at("B").z == 30.0
    assert ticks.remarks == ["waypoint B stays: 1e+09 is no coordinate"]
    assert ticks.executor.names.item("waypoints", ticks.executor.waypoints.number("A"), "enu_f.y") == 8.0


def test_what_was_left_out_is_passed_over_in_flight():
    ticks = begun(
        '<call_once fun="LED_ON(2); NavSetWaypointHere(WP_A)"/><set var="list[3]" value="1"/>'
        '<set var="led" value="LED_RED"/>'
        '<set var="own" value="4"/><exception cond="sonar" deroute="HOME"/>'
        '<stay wp="A" until="own == 4 @AND block_time > 1"/>',
        (3.0, 4.0, 30.0),
    ).tick()
    assert ticks.aim.end[:2] == (3.0, 4.0)
    ticks.seconds(3)
    assert (ticks.entered, ticks.remarks) == (["a", "rest"], [])
