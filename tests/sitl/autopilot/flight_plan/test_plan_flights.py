"""Plans as they are flown: ours through all of its blocks, and those that ENAC and Delft fly indoors."""

import numpy as np
import pytest

from protocol.flight_plans import load_flight_plan, read_flight_plan
from protocol.flight_plans.plan_names import parse_name_mapping
from sitl.autopilot.settings import Settings
from sitl.vehicle.parameters import WorldSettings
from tests.support.plans import HEAD, VOLIERE, public_plans
from tests.support.vehicle.planned_flight import PlannedFlight


@pytest.fixture(scope="module")
def room():
    """The plan of the room, flown through all figures and back to the ground."""
    flight = PlannedFlight(load_flight_plan(VOLIERE))
    flight.marks = {}
    flight.advance(1.0)
    flight.go_to_block("Takeoff")
    flight.wait_for_block("Standby", 15)
    flight.advance(5.0)
    for name in ("Route", "Ring", "Figures"):
        begun = len(flight.positions)
        flight.go_to_block(name)
        flight.wait_for_block("Standby", 60)
        flight.marks[name] = np.array(flight.positions[begun:])
        flight.advance(3.0)
    flight.go_to_block("Land")
    flight.wait_for_block("Landed", 30)
    flight.advance(4.0)
    return flight


@pytest.mark.long
def test_the_room_is_flown_and_landed_in(room):
    assert room.blocks == [
        *("Engine off", "Takeoff", "Standby", "Route", "Standby", "Ring", "Standby", "Figures", "Standby"),
        *("Land", "Flare", "Landed"),
    ]
    assert room.fired == [("Takeoff", "Standby"), ("Flare", "Landed")]
    assert not room.autopilot.armed
    assert room.autopilot.view.crash is None
    assert room.p == pytest.approx((0.0, -0.5, 0.1), abs=0.4)
    assert np.abs(np.array(room.positions)[:, :2]).max() < 4.0


def test_the_route_passes_its_corners_and_its_heights(room):
    flown = room.marks["Route"]
    for corner in ((1.5, 1.5), (1.5, -1.5), (-1.5, -1.5), (-1.5, 1.5)):
        assert np.linalg.norm(flown[:, :2] - corner, axis=1).min() < 0.6
    assert flown[:, 2].max() > 2.5  # p2 is a metre higher


@pytest.mark.long
def test_the_ring_is_round(room):
    flown = room.marks["Ring"]
    away = np.linalg.norm(flown[len(flown) // 3 :, :2], axis=1)
    assert np.abs(away - 1.5).max() < 0.4


@pytest.mark.parametrize(
    ("cause", "target"),
    [("datalink", "Safe landing"), ("battery", "Safe landing"), ("area", "Standby")],
)
def test_exceptions_of_the_room(cause, target):
    flight = PlannedFlight(load_flight_plan(VOLIERE))
    flight.go_to_block("Takeoff")
    flight.wait_for_block("Standby", 15)
    flight.go_to_block("Ring")
    flight.advance(2.0)
    if cause == "datalink":
        flight.silence(11.0)
    elif cause == "battery":
        flight.autopilot.configure(Settings(battery_critical=0.5, battery_action=0))
        flight.aircraft.failures.read = lambda battery: battery._replace(used=0.7 * battery.capacity)
    else:
        flight.plan.executor.waypoints.move("_R1", flight.plan.executor.waypoints.at("_R1")._replace(x=-9.0, y=-9.0))
    flight.advance(0.5)
    assert ("Ring", target) in flight.fired
    if target == "Safe landing":
        flight.advance_until(lambda: not flight.autopilot.armed, 20)
        assert flight.block == "Landed"
        assert flight.autopilot.view.crash is None


def test_a_second_flight_begins_where_the_first_ended():
    flight = PlannedFlight(load_flight_plan(VOLIERE))
    for _ in range(2):
        flight.go_to_block("Takeoff")
        flight.wait_for_block("Standby", 15)
        flight.advance(2.0)
        flight.go_to_block("Land")
        flight.advance_until(lambda: not flight.autopilot.armed, 30)
    assert flight.blocks.count("Landed") == 2


def test_in_wind_and_gusts_the_room_is_still_flown():
    flight = PlannedFlight(load_flight_plan(VOLIERE), world_settings=WorldSettings(wind_speed=1.0, gusts=0.2))
    flight.go_to_block("Takeoff")
    flight.wait_for_block("Standby", 15)
    flight.go_to_block("Route")
    flight.wait_for_block("Standby", 60)
    flight.go_to_block("Land")
    flight.advance_until(lambda: not flight.autopilot.armed, 40)
    assert flight.autopilot.view.crash is None


OUTDOORS = (
    HEAD.replace('alt="102"', 'alt="130"').replace('"100">', '"600">')
    + """<waypoints><waypoint name="HOME" x="0" y="0"/><waypoint name="p1" x="150" y="0"/>
  <waypoint name="p2" x="150" y="150"/><waypoint name="p3" x="0" y="150"/></waypoints>
  <blocks>
    <block name="Square">
      <go wp="p1" from="HOME" hmode="route"/><path wpts="p1,p2,p3"/><go wp="HOME" hmode="route"/>
    </block>
    <block name="Hold"><stay wp="HOME"/></block>
    <block name="Circle"><circle wp="p1" radius="-40" until="NavCircleCount() > 1.2"/></block>
    <block name="Stay"><stay wp="p1"/></block>
    <block name="Hovered"><set var="nav.radius" value="3"/><circle wp="p1" radius="nav.radius"/></block>
  </blocks></flight_plan>"""
)


@pytest.fixture(scope="module")
def outdoors():
    return read_flight_plan(OUTDOORS.encode(), "outdoors.xml")


@pytest.mark.long
def test_long_legs_are_flown_forward_one_after_the_other_without_a_stop(outdoors):
    flight = PlannedFlight(outdoors, arena="open", up=30.0)
    flight.wait_for_block("Hold", 90)
    flown, forward = np.array(flight.positions), np.array(flight.forward)
    assert forward.mean() > 0.7
    on_the_way = np.flatnonzero(forward)
    assert forward[on_the_way[0] : on_the_way[-1]].mean() > 0.97
    for corner in ((150.0, 0.0), (150.0, 150.0), (0.0, 150.0)):
        assert np.linalg.norm(flown[:, :2] - corner, axis=1).min() < 20.0
    assert np.abs(flown[:, 2] - 30.0).max() < 8.0
    flight.advance(15.0)
    assert flight.p == pytest.approx((0.0, 0.0, 30.0), abs=1.5)


def test_a_waypoint_that_is_dragged_far_is_flown_to_forward(outdoors):
    flight = PlannedFlight(outdoors, arena="open", up=30.0)
    flight.go_to_block("Hold")
    flight.advance(2.0)
    home = flight.plan.executor.waypoints.home
    assert flight.plan.move_waypoint("HOME", home._replace(x=-150.0)).accepted
    flight.advance(25.0)
    assert any(flight.forward)
    assert flight.p == pytest.approx((-150.0, 0.0, 30.0), abs=3.0)


@pytest.mark.long
def test_a_wide_circle_is_flown_forward_and_a_narrow_one_hovered(outdoors):
    flight = PlannedFlight(outdoors, arena="open", up=30.0)
    flight.go_to_block("Circle")
    flight.wait_for_block("Stay", 90)
    flown = np.array(flight.positions)[-600:]
    assert np.abs(np.linalg.norm(flown[:, :2] - (150.0, 0.0), axis=1) - 40.0).max() < 6.0
    bearing = np.unwrap(np.arctan2(flown[:, 0] - 150.0, flown[:, 1]))
    assert bearing[-1] < bearing[0]  # negative: anticlockwise
    flight.go_to_block("Stay")
    flight.advance(20.0)
    flight.go_to_block("Hovered")
    flight.advance(20.0)
    assert not any(flight.forward[-500:])
    away = np.linalg.norm(np.array(flight.positions)[-500:, :2] - (150.0, 0.0), axis=1)
    assert np.abs(away - 3.0).max() < 0.6


def public(name):
    found = [path for path in public_plans() if path.name == name]
    if not found:
        pytest.skip("the public plans are not here")
    return load_flight_plan(found[0])


def taken_off(plan, **options):
    flight = PlannedFlight(plan, **options)
    flight.wait_for_block("Holding point", 5)
    flight.go_to_block("Start Engine")
    flight.advance(1.0)
    flight.go_to_block("Takeoff")
    flight.wait_for_block("Standby", 20)
    flight.advance(5.0)
    return flight


def test_the_plan_of_the_flying_room_of_enac():
    mapping = parse_name_mapping("[functions]\nnav_fish_velocity_run = 0\n[variables]\nAP_MODE_GUIDED = 13", "m")
    flight = taken_off(public("fish_voliere.xml"), mapping=mapping)
    flight.go_to_block("Guided_run")  # by the mapping over at once
    flight.advance_until(lambda: not flight.autopilot.armed, 30)
    assert flight.block == "Landed"
    assert flight.fired[1:] == [("flare", "Ramp down"), ("Ramp down", "Landed")]
    assert flight.autopilot.view.crash is None
    assert not flight.autopilot.terminated


@pytest.mark.long
def test_the_plan_of_the_flying_room_of_delft():
    flight = taken_off(public("rotorcraft_optitrack.xml"))
    for block in ("go_p2", "line_p1_p2", "route"):
        flight.go_to_block(block)
        flight.wait_for_block("stay_p1", 60)
    flight.go_to_block("Oval")
    flight.advance(15.0)
    flight.go_to_block("land here")
    flight.wait_for_block("Holding point", 30)
    flight.advance(2.0)
    assert ("flare", "Holding point") in flight.fired
    assert not flight.autopilot.armed
    assert flight.autopilot.view.crash is None


BANK = (
    HEAD.replace('alt="102"', 'alt="130"').replace('"100">', '"600">')
    + """<waypoints><waypoint name="HOME" x="0" y="0"/><waypoint name="p1" x="0" y="300"/></waypoints>
  <blocks>
    <block name="Out"><go wp="p1" hmode="route" until="GetPosY() > 120"/></block>
    <block name="Turn"><attitude roll="-30" vmode="alt" alt="138"/></block>
  </blocks></flight_plan>"""
)


def test_a_bank_is_turned_on_the_circle_of_its_angle():
    flight = PlannedFlight(read_flight_plan(BANK.encode(), "bank.xml"), arena="open", up=30.0)
    flight.wait_for_block("Turn", 60)
    flight.advance(6.0)
    circle, begun = flight.plan.present_leg(), len(flight.positions)
    assert circle.radius == pytest.approx(-(15.0**2) / (9.81 * np.tan(np.radians(30.0))), rel=0.01)
    flight.advance(18.0)
    centre = flight.plan.executor.aim.end[:2]
    flown = np.array(flight.positions[begun:])
    assert np.abs(np.linalg.norm(flown[:, :2] - centre, axis=1) + circle.radius).max() < 0.5
    assert flown[-1, 2] == pytest.approx(38.0, abs=0.5)
    assert all(flight.forward[begun:])


MODULES = """
<block name="up"><call fun="nav_takeoff_from_here()"/></block>
<block name="Standby"><stay wp="HOME"/></block>
<block name="Survey"><call_once fun="nav_survey_rectangle_rotorcraft_setup(WP_S1, WP_S2, 4, NS)"/>
  <exception cond="rectangle_survey_sweep_num == 1" deroute="Standby"/>
  <call fun="nav_survey_rectangle_rotorcraft_run(WP_S1, WP_S2)"/></block>
<block name="climb"><stay wp="L1" until="GetPosHeight() > 38"/></block>
<block name="Line"><set var="force_forward" value="1"/><call_once fun="nav_line_setup()"/>
  <call fun="nav_line_run(WP_L1, WP_L2, 25)"/></block>
<block name="Land"><set var="force_forward" value="0"/><call fun="nav_land_at_wp(WP_TD, WP_AF, 0)"/></block>
<block name="Landed"><attitude roll="0" vmode="throttle" throttle="0"/></block>
"""
PLACES = (
    ("HOME", 0, 0, 3),
    ("L1", 0, 40, 40),
    ("L2", 80, 40, 40),
    ("S1", -4, -4, 3),
    ("S2", 4, 4, 3),
    ("AF", 30, 0, 0),
)


@pytest.mark.long
def test_navigation_modules_are_flown_from_the_ground_and_back():
    waypoints = "".join(
        f'<waypoint name="{name}" x="{x}" y="{y}" height="{height}"/>'
        for name, x, y, height in (*PLACES, ("TD", 0, 0, 0))
    )
    head = HEAD.replace('max_dist_from_home="100"', 'max_dist_from_home="1000"')
    text = f"{head}<waypoints>{waypoints}</waypoints><blocks>{MODULES}</blocks></flight_plan>"
    flight = PlannedFlight(read_flight_plan(text.encode(), "modules"), arena="open")
    flight.wait_for_block("Standby", 15)
    flight.go_to_block("Survey")
    flight.wait_for_block("Standby", 60)
    assert np.abs(np.array(flight.positions)[:, :2]).max() < 5.0
    flight.go_to_block("climb")
    flight.wait_for_block("Line", 60)
    begun = len(flight.positions)
    flight.advance(45.0)
    line = np.array(flight.positions[begun:])
    assert any(flight.forward[begun:])
    for end in ((0.0, 40.0), (80.0, 40.0)):
        assert np.linalg.norm(line[:, :2] - end, axis=1).min() < 1.0
    assert np.abs(line[:, 2] - 40.0).max() < 4.0
    flight.go_to_block("Land")
    flight.wait_for_block("Landed", 120)
    assert flight.p == pytest.approx((0.0, 0.0, 0.1), abs=0.4)
    flight.advance(1.0)
    assert not flight.autopilot.armed
    assert flight.autopilot.view.crash is None
