"""The functions and variables of the table give what a plan expects of them."""

import math

import pytest

from protocol.flight_plans.evaluation import evaluate
from protocol.flight_plans.expressions import parse_expression
from protocol.flight_plans.plan_names import (
    CONSTANTS,
    FUNCTIONS,
    NAVIGATION_ROUTINES,
    SETTABLE,
    STRUCTURES,
    VARIABLES,
    plan_constants,
)
from sitl.autopilot.flight_plan.plan_functions import FUNCTION_VALUES
from sitl.autopilot.flight_plan.routines import ROUTINE_VALUES
from sitl.autopilot.flight_plan.variable_values import VARIABLE_VALUES
from tests.support.plans import source
from tests.support.vehicle.plan_ticks import PlanTicks

SECTOR = '<sectors><sector name="S"><corner name="HOME"/><corner name="A"/><corner name="B"/></sector></sectors>'
VARIABLE = '<variables><variable var="v" init="2"/></variables>'


SET_UP = {
    "nav_flower_run": ("nav_flower_setup", [1, 2]),
    "nav_skid_landing_run": ("nav_skid_landing_setup", [1, 2, 5.0]),
    "nav_survey_poly_osam_run": ("nav_survey_poly_osam_setup", [1, 4, 1.0, 0.0]),
    "nav_survey_hybrid_run": ("nav_survey_poly_osam_setup", [1, 4, 1.0, 0.0]),
    "nav_survey_polygon_run": ("nav_survey_poly_osam_setup", [1, 4, 1.0, 0.0]),
    "nav_survey_rectangle_rotorcraft_run": ("nav_survey_rectangle_rotorcraft_setup", [1, 2, 1.0, 0]),
}


def ticks():
    return PlanTicks('<block name="a"><stay wp="A"/></block><block name="b b"/>', SECTOR + VARIABLE).tick()


def value(text, flight):
    return evaluate(parse_expression(source(text)).tree, flight.executor.names)


def test_what_is_known_is_there_and_the_other_way_round():
    assert set(FUNCTION_VALUES) == set(FUNCTIONS) | {"Inside"}
    assert set(ROUTINE_VALUES) >= NAVIGATION_ROUTINES
    constants = plan_constants(ticks().executor.plan)
    assert set(VARIABLE_VALUES) | set(constants) >= VARIABLES
    assert set(VARIABLE_VALUES) <= VARIABLES | set(CONSTANTS)
    assert set(VARIABLE_VALUES) >= SETTABLE


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_function_gives_a_number_or_its_fields(name):
    flight, shape = ticks(), FUNCTIONS[name]
    arguments = [1] * shape.least
    if name == "IndexOfBlock":
        arguments = ["b b"]
    elif name == "autopilot_set_mode":
        arguments = [CONSTANTS["AP_MODE_NAV"]]
    elif name in SET_UP:
        flight.executor.names.call(*SET_UP[name])
    if name.startswith(("nav_survey_poly", "nav_survey_hybrid")):
        arguments = ([1, 2, 4, 1.0, 0] if "hybrid" in name else [1, 4, 1.0, 2, 1, 1, 100])[: shape.least]
    elif name in {"nav_line", "nav_line_run", "nav_survey_rectangle_rotorcraft_run"}:
        arguments = [1, 2, 1.0][: shape.least]
    for index in shape.changes:
        arguments[index] = "nav.heading"
    given = flight.executor.names.call(name, arguments)
    if name in STRUCTURES:
        assert tuple(given) == STRUCTURES[name]
    else:
        assert math.isfinite(given)


@pytest.mark.parametrize("name", sorted(VARIABLES))
def test_every_variable_has_a_value(name):
    assert math.isfinite(ticks().executor.names.value(name))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("GetPosX()", 1.0),
        ("GetPosY()", 2.0),
        ("GetPosHeight()", 3.0),
        ("GetPosAlt()", 103.0),
        ("GetAltRef()", 100.0),
        ("stateGetPositionEnu_f()->z", 3.0),
        ("stateGetPositionNed_f()->z", -3.0),
        ("stateGetSpeedEnu_f()->x", 0.5),
        ("DegOfRad(stateGetNedToBodyEulers_f()->psi)", 0.0),
        ("WaypointX(WP_A) + WaypointY(WP_A)", 7.0),
        ("WaypointAlt(WP_B)", 103.0),
        ("IndexOfBlock('b b')", 1),
        ("IndexOfBlock('HOME')", 2),
        ("nav_block", 0),
        ("InsideS(1, 2)", 1),
        ("InsideS(9, 9)", 0),
        ("GpsFixValid() && !GpsIsLost()", 1),
        ("nav_is_in_flight()", 1),
        ("Min(2, 1) + Max(2, 1)", 3),
        ("And(1, Or(0, 1))", 1),
        ("LessThan(1, 2) + MoreThan(1, 2)", 1),
        ("CloseDegAngles(355, 2)", 1),
        ("fabs(-1.5)", 1.5),
        ("electrical.bat_low", 0),
        ("DEFAULT_CIRCLE_RADIUS", 40.0),
        ("NAV_DEFAULT_ALT - GROUND_ALT", 2.0),
        ("WP_A", 2),
        ("v", 2.0),
        ("guidance_v.delta_t", 4800.0),
        ("autopilot.kill_throttle", 0),
        ("CloseRadAngles(6.28, 0.01)", 1),
        ("CloseRadAngles(6.28, 0.1)", 0),
        ("GetDistanceToWaypoint(WP_A)", math.sqrt(8.0)),
        ("NavCourseCloseTo(90)", 1),
        ("NavCourseCloseTo(270)", 0),
        ("Not(0) + Not(2)", 1),
        ("RadioControlIsLost()", 0),
        ("atan2f(1, -1)", 0.75 * math.pi),
        ("cosf(0) + sinf(0) + tanf(0)", 1.0),
        ("ceil(1.2) + floor(1.8)", 3),
        ("fabsf(-1.5) + sqrtf(4)", 3.5),
        ("fmax(1, 2) - fmin(1, 2)", 1),
        ("autopilot_get_motors_on() && autopilot_in_flight()", 1),
        ("stateGetAirspeed_f()", 0.5),
        ("stateGetHorizontalSpeedDir_f()", 0.5 * math.pi),
        ("stateGetHorizontalSpeedNorm_f()", 0.5),
        ("stateGetSpeedNed_f()->y", 0.5),
        ("waypoint_get_x(WP_A)", 3.0),
        ("waypoint_get_y(WP_A)", 4.0),
        ("waypoint_get_alt(WP_A)", 102.0),
        ("ground_alt", 100.0),
        ("dist2_to_home", 5.0),
        ("autopilot.motors_on", 1),
    ],
)
def test_values(text, wanted):
    flight = ticks()
    flight.p, flight.v = (1.0, 2.0, 3.0), (0.5, 0.0, 0.0)
    flight.tick()
    assert value(text, flight) == pytest.approx(wanted)


def test_waypoints_are_moved():
    flight = ticks()
    flight.p = (7.0, 8.0, 9.0)
    flight.tick()
    table = flight.executor.waypoints
    value("NavSetWaypointHere(WP_A)", flight)
    assert table.at("A") == (7.0, 8.0, 2.0)
    value("NavSetWaypointPosAndAltHere(WP_B)", flight)
    assert table.at("B") == (7.0, 8.0, 9.0)
    value("NavCopyWaypoint(WP_C, WP_B)", flight)
    assert table.at("C") == (7.0, 8.0, 9.0)
    value("waypoint_set_alt(WP_C, 3.5)", flight)
    assert table.at("C") == (7.0, 8.0, 3.5)


def test_names_of_old_versions_mean_what_their_successors_mean():
    flight = ticks()
    for old, new in (("estimator_x", "GetPosX()"), ("estimator_y", "GetPosY()"), ("estimator_z", "GetPosAlt()")):
        assert value(old, flight) == value(new, flight)
    assert (value("gps.num_sv > 4", flight), value("gps.pacc > 1500", flight)) == (1, 0)


def test_references_are_set_here():
    flight = ticks()
    value("NavSetGroundReferenceHere()", flight)
    assert value("GetPosHeight()", flight) == 0.0
    assert value("GetAltRef()", flight) == 102.0
    assert value("GetPosAlt()", flight) == 102.0


def test_headings():
    flight = ticks()
    memory = flight.executor.memory
    for text, degrees in (
        ("nav_set_heading_deg(90)", 90.0),
        ("increase_nav_heading(&nav.heading, RadOfDeg(10))", 100.0),
        ("nav_set_heading_towards(0, -5)", 180.0),
        ("nav_set_heading_towards_waypoint(WP_A)", math.degrees(math.atan2(3.0, 4.0))),
        ("nav_set_heading_current()", 0.0),
    ):
        value(text, flight)
        assert abs(math.degrees(memory.heading)) == pytest.approx(degrees), text


def test_ground_is_detected_after_it_is_asked_for():
    flight = ticks()
    flight.told["landed"] = True
    flight.tick()
    assert value("NavDetectGround()", flight) == 0
    value("NavStartDetectGround()", flight)
    assert value("NavDetectGround()", flight) == 1


def test_the_circle_is_counted_from_the_stage_on():
    flight = PlanTicks('<block name="a"><circle wp="HOME" radius="5" until="NavCircleCount() @GT 1.5"/></block>')
    for step in range(200):
        turn = 0.05 * step
        flight.p = (5.0 * math.sin(turn), 5.0 * math.cos(turn), 2.0)
        flight.tick()
        if flight.block == "HOME":
            break
    assert turn == pytest.approx(1.5 * math.tau, abs=0.15)


def test_about_the_centre_nothing_is_counted():
    """A vehicle that stands there has every bearing from it, one after the other."""
    flight = PlanTicks('<block name="a"><circle wp="HOME" radius="5" until="NavCircleCount() @GT 1.5"/></block>')
    for step in range(200):
        flight.p = (0.01 * math.sin(step), 0.01 * math.cos(step), 2.0)
        flight.tick()
    assert value("NavCircleCount()", flight) == 0.0


def test_the_bearing_on_a_circle():
    flight = PlanTicks('<block name="a"><circle wp="HOME" radius="5"/></block>')
    flight.p = (5.0, 0.0, 2.0)
    flight.tick()
    assert value("NavQdrCloseTo(92)", flight) == 1
    assert value("NavQdrCloseTo(270)", flight) == 0


def test_the_base_leg_ends_on_the_way_to_the_touchdown():
    flight = ticks()
    flight.executor.waypoints.move("A", flight.executor.waypoints.home._replace(x=100.0, y=0.0))
    value("nav_compute_baseleg(WP_A, WP_HOME, WP_B, 20)", flight)
    at = flight.executor.waypoints.at("B")
    assert math.hypot(at.x - 100.0, at.y) == pytest.approx(20.0)
    assert at.x == pytest.approx(100.0)
