"""Legs past obstacles in flight, hovered and forward; what has no way is refused and never flown."""

import dataclasses
import math

import pytest

from protocol.dialect import mavlink
from protocol.names import Mode
from sitl import Regime
from sitl.autopilot.mission.items import validate
from sitl.enclosure.arena_files import Obstacle, load_arena
from sitl.lab.studies.seeded_flights import waypoint
from sitl.simulation.situation import regime
from tests.support.flights.enclosed import CAGE, FIELD, PILLAR, EnclosedFlight

FENCE = Obstacle("fence", False, 0.0, 0.0, 0.0, 0.2, 5.0, 0.0, 3.0)
SCREEN = FENCE._replace(name="screen", top=7.0)
TOWER = Obstacle("tower", True, 150.0, 0.0, 0.0, 10.0, 10.0, 0.0, 80.0)


def test_a_go_to_is_flown_round_a_pillar():
    flight = EnclosedFlight(CAGE._replace(obstacles=(PILLAR,)), (-3.0, 0.0, 2.0))
    assert flight.autopilot.guided.go_to((3.0, 0.0, 2.0)).result == 0
    flight.fly(25.0, until=lambda: math.dist(flight.place, (3.0, 0.0, 2.0)) < 0.2)
    assert math.dist(flight.place, (3.0, 0.0, 2.0)) < 0.3
    assert flight.gap > 0.8  # 1 m is asked for


def test_a_go_to_is_flown_over_a_fence():
    flight = EnclosedFlight(CAGE._replace(obstacles=(FENCE,)), (-3.0, 0.0, 2.0))
    assert flight.autopilot.guided.go_to((3.0, 0.0, 2.0)).result == 0
    flight.fly(30.0, until=lambda: math.dist(flight.place, (3.0, 0.0, 2.0)) < 0.2)
    assert math.dist(flight.place, (3.0, 0.0, 2.0)) < 0.3
    assert flight.gap > 0.8


def test_through_the_shipped_obstacle_course_and_back():
    """Round the pillar, and between the crates and the curtain, 3.2 m apart."""
    flight = EnclosedFlight(load_arena("obstacle-course"), (-3.5, 0.5, 2.0))
    for end in ((3.5, 0.5, 2.0), (-3.5, 0.5, 5.5)):
        assert flight.autopilot.guided.go_to(end).result == 0
        flight.fly(40.0, until=lambda end=end: math.dist(flight.place, end) < 0.2)
        assert math.dist(flight.place, end) < 0.3
    assert flight.gap > 0.8


def test_without_a_way_it_is_refused_and_not_flown():
    flight = EnclosedFlight(CAGE._replace(obstacles=(SCREEN,)), (-3.0, 0.0, 2.0))
    answer = flight.autopilot.guided.go_to((3.0, 0.0, 2.0))
    assert answer.text == "Go-to denied: no way past 'screen' keeps 1 m from everything"
    flight.fly(3.0)
    assert math.dist(flight.place, (-3.0, 0.0, 2.0)) < 0.1
    assert flight.autopilot.offboard.set_position((3.0, 0.0, 2.0)) is None  # kept until OFFBOARD begins
    assert flight.autopilot.offboard.start().text.startswith("OFFBOARD denied: no way past 'screen'")


def test_a_point_within_the_clearance_is_refused_and_the_clearance_is_a_parameter():
    arena = CAGE._replace(obstacles=(PILLAR,))
    near = (-1.1, 0.0, 2.0)
    answer = EnclosedFlight(arena, (-3.0, 0.0, 2.0)).autopilot.guided.go_to(near)
    assert answer.text == "Go-to denied: the point is 0.8 m from 'pillar', less than 1 m"
    assert EnclosedFlight(arena, (-3.0, 0.0, 2.0), DRK_OBS_DIST=0.6).autopilot.guided.go_to(near).result == 0


def test_a_streamed_position_is_led_round_as_well():
    flight = EnclosedFlight(CAGE._replace(obstacles=(PILLAR,)), (-3.0, 0.0, 2.0))
    end = (3.0, 0.0, 2.0)
    flight.autopilot.offboard.set_position(end)
    assert flight.autopilot.offboard.start().result == 0
    flight.fly(
        25.0, until=lambda: math.dist(flight.place, end) < 0.2, each=lambda: flight.autopilot.offboard.set_position(end)
    )
    assert math.dist(flight.place, end) < 0.3
    assert flight.gap > 0.8


def test_a_mission_is_led_round_and_refused_where_it_cannot_be():
    flight = EnclosedFlight(CAGE._replace(obstacles=(PILLAR,)), (-3.0, 0.0, 2.0))
    flight.autopilot.missions.load([waypoint(3.0, 0.0, 2.0), waypoint(0.0, 3.0, 2.0)])
    assert flight.autopilot.missions.start().result == 0
    flight.fly(40.0, until=lambda: flight.autopilot.mode is not Mode.MISSION)
    assert "Mission complete: holding" in flight.texts
    assert flight.gap > 0.8
    closed = EnclosedFlight(CAGE._replace(obstacles=(SCREEN,)), (-3.0, 0.0, 2.0))
    closed.autopilot.missions.load([waypoint(-2.0, 1.0, 2.0), waypoint(3.0, 0.0, 2.0)])
    answer = closed.autopilot.missions.start()
    assert answer.text == "Mission denied: item 1: no way past 'screen' keeps 1 m from everything"


def test_after_its_mission_the_vehicle_holds_at_the_last_waypoint_not_where_it_was_when_it_counted_as_there():
    flight = EnclosedFlight(CAGE, (-2.0, 0.0, 2.0))
    flight.autopilot.missions.load([waypoint(2.0, 1.0, 3.0)])
    assert flight.autopilot.missions.start().result == 0
    flight.fly(20.0, until=lambda: flight.autopilot.mode is not Mode.MISSION)
    assert 0.1 < math.dist(flight.place, (2.0, 1.0, 3.0)) < 0.6  # NAV_ACC_RAD
    flight.fly(5.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert math.dist(flight.place, (2.0, 1.0, 3.0)) < 0.1


def test_a_take_off_and_a_circle_of_a_mission_meet_no_obstacle():
    arena = CAGE._replace(obstacles=(PILLAR,))
    flight = EnclosedFlight(arena, (-3.0, 0.0, 1.5))
    away = dataclasses.replace(waypoint(3.0, 0.0, 2.5), command=mavlink.MAV_CMD_NAV_TAKEOFF)
    flight.autopilot.missions.load([away])
    assert flight.autopilot.missions.start().result == 0
    flight.fly(30.0, until=lambda: flight.autopilot.mode is not Mode.MISSION)
    assert "Mission complete: holding" in flight.texts
    assert flight.gap > 0.8
    loiter = dataclasses.replace(
        waypoint(94.6, 23.0, 50.0), command=mavlink.MAV_CMD_NAV_LOITER_UNLIM, params=(0.0, 0.0, 60.0, math.nan)
    )
    outdoors = EnclosedFlight(FIELD._replace(obstacles=(TOWER,)), (0.0, 0.0, 50.0))
    outdoors.autopilot.missions.load([loiter])
    outdoors.autopilot.missions.start()
    outdoors.fly(1.0)
    assert "Circle of 60 m meets an obstacle: hovering at its centre" in outdoors.texts


def test_a_mission_is_refused_when_it_is_uploaded():
    world = EnclosedFlight(CAGE._replace(obstacles=(SCREEN,)), (-3.0, 0.0, 2.0)).autopilot.world
    apart = [waypoint(-2.0, 1.0, 2.0), waypoint(3.0, 0.0, 2.0)]
    refusal = validate(apart, world)
    assert refusal.text == "item 1: no way past 'screen' keeps 1 m from everything"
    assert validate(apart[:1], world) is None


def test_a_mission_whose_first_leg_has_no_way_stops_there():
    flight = EnclosedFlight(CAGE._replace(obstacles=(SCREEN,)), (-3.0, 0.0, 2.0))
    flight.autopilot.missions.load([waypoint(3.0, 0.0, 2.0)])
    assert flight.autopilot.missions.start().result == 0  # where it begins nobody knew
    flight.fly(3.0)
    assert any(text.startswith("Mission stopped at item 0: no way past 'screen'") for text in flight.texts)
    assert math.dist(flight.place, (-3.0, 0.0, 2.0)) < 0.1


def test_a_return_and_its_landing_go_round():
    flight = EnclosedFlight(CAGE._replace(obstacles=(PILLAR._replace(north=-2.0),)), (-3.7, 0.0, 2.0))
    assert flight.autopilot.guided.return_to_launch().result == 0
    flight.fly(60.0, until=lambda: flight.vehicle.law.regime is Regime.GROUND)
    assert flight.vehicle.law.regime is Regime.GROUND
    assert math.dist(flight.place[:2], (0.0, 0.0)) < 0.5
    assert flight.gap > 0.8


def test_without_a_way_home_a_pilot_is_refused_and_a_failsafe_lands():
    flight = EnclosedFlight(CAGE._replace(obstacles=(SCREEN,)), (-3.0, 0.0, 2.0), NAV_DLL_ACT=2)
    flight.aircraft.autopilot.relocate(flight.autopilot.world.frame, (3.0, 0.0, 0.0))
    answer = flight.autopilot.guided.return_to_launch()
    assert answer.text == "Return denied: no way past 'screen' keeps 1 m from everything"
    state = flight.autopilot._flight
    state.enter(Mode.RTL, state.route_home(state.view))
    flight.fly(30.0, until=lambda: flight.vehicle.law.regime is Regime.GROUND)
    assert "No way home, no way past 'screen' keeps 1 m from everything: landing here" in flight.texts
    assert math.dist(flight.place[:2], (-3.0, 0.0)) < 0.5


def test_nothing_lands_on_a_shelf():
    shelf = Obstacle("shelf", False, 0.0, 0.0, 0.0, 0.5, 0.5, 0.5, 0.8)
    flight = EnclosedFlight(CAGE._replace(obstacles=(shelf,)), (-3.0, 0.0, 2.0))
    assert flight.autopilot.guided.return_to_launch().text == "Return denied: 'shelf' is in the way of the landing"
    land = dataclasses.replace(waypoint(0.0, 0.0, 2.5), command=mavlink.MAV_CMD_NAV_LAND)
    flight.autopilot.missions.load([land])
    assert "'shelf' is in the way of the landing" in flight.autopilot.missions.start().text


@pytest.mark.long
@pytest.mark.parametrize("wind", [0.0, 5.0])
def test_a_leg_flown_forward_is_led_round_a_tower(wind):
    flight = EnclosedFlight(FIELD._replace(obstacles=(TOWER,)), (0.0, 0.0, 50.0), SIM_WIND_SPD=wind, SIM_WIND_DIR=90.0)
    assert flight.autopilot.guided.go_to((300.0, 0.0, 50.0)).result == 0
    regimes = set()
    flight.fly(
        80.0,
        until=lambda: math.dist(flight.place, (300.0, 0.0, 50.0)) < 1.0,
        each=lambda: regimes.add(regime(flight.vehicle)),
    )
    assert math.dist(flight.place, (300.0, 0.0, 50.0)) < 1.5
    assert Regime.FORWARD in regimes
    assert flight.gap > 2.0  # 1 m is asked for, and 3 m more in forward flight


def test_where_forward_flight_has_no_room_to_stop_the_leg_is_hovered():
    """The stop is 6 m before a wall: hovered, though forward flight is asked for."""
    wall = Obstacle("wall", False, 106.0, 0.0, 0.0, 1.0, 50.0, 0.0, 100.0)
    flight = EnclosedFlight(FIELD._replace(obstacles=(wall,)), (0.0, 0.0, 30.0), DRK_WAY=2)
    assert flight.autopilot.guided.go_to((100.0, 0.0, 30.0)).result == 0
    regimes = set()
    flight.fly(10.0, each=lambda: regimes.add(regime(flight.vehicle)))
    assert regimes == {Regime.UPRIGHT}
    assert flight.place.x > 5.0


def test_a_circle_round_an_obstacle_is_refused():
    flight = EnclosedFlight(FIELD._replace(obstacles=(TOWER,)), (0.0, 0.0, 50.0))
    answer = flight.autopilot.guided.circle((50.9, -13.1, 50.0), 100.0)
    assert answer.text == "Orbit denied: an obstacle is in its way"
    assert flight.autopilot.guided.circle((150.0, 0.0, 50.0), 60.0).result == 0  # round it
