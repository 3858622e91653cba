"""Missions and commands in forward flight, flown by the whole aircraft: times, tracks, energies, and stops."""

import math
from dataclasses import replace

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode, Regime
from protocol.events import CommandRequested
from protocol.names import Mode
from protocol.wire.message import Peer
from sitl.autopilot.mission.runner import PassedItems
from sitl.autopilot.settings import Settings
from sitl.guidance.leg_speeds import corner_cut, corner_lead
from sitl.mavlink import commands
from sitl.model.airframe_files import load
from sitl.simulation.situation import regime
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS, is_forward
from tests.support.flights.recorded_flight import HIGH, Flight, off_polygon, square
from tests.support.vehicle.fake_station import make_aircraft
from tests.support.vehicle.mission_items import NAN, item, waypoint

GROUND = Peer(255, 190, "ground")
SQUARE = ((0.0, 0.0), (100.0, 0.0), (100.0, -100.0), (0.0, -100.0))  # of tests/data/square100.plan, world NWU
FORWARD = Settings(leg_mode=LegMode.FORWARD)


def cruise_at(airspeed):
    return item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(0.0, airspeed, -1.0, 0.0))


def transition(state):
    return item(mavlink.MAV_CMD_DO_VTOL_TRANSITION, params=(float(state), 0.0, 0.0, 0.0))


def circle(turns, radius, north, west, up):
    return item(mavlink.MAV_CMD_NAV_LOITER_TURNS, north, west, up, (turns, 0.0, radius, NAN))


def airborne(**kwargs):
    """An aircraft that hovers at ``HIGH`` and prefers forward flight."""
    return Flight(settings=FORWARD, **kwargs)


def in_cruise(**kwargs):
    """An aircraft cruising northwards to a far point."""
    flight = airborne(**kwargs)
    assert flight.autopilot.guided.go_to((600.0, 0.0, HIGH)).accepted
    flight.fly_until(lambda: regime(flight.vehicle) is Regime.FORWARD, 30.0)
    flight.fly(3.5)
    return flight


def send(flight, command, *params):
    """Send a command, with 0 for the parameters that are left out."""
    padded = (*params, *(0.0,) * (7 - len(params)))
    return commands.execute(
        flight.autopilot, CommandRequested(request=1, command=command, params=padded, frame=None, peer=GROUND)
    )


# From leaving the take-off hover to reaching the last waypoint: the times of docs/figures.md and some margin.
@pytest.mark.long(after=1)
@pytest.mark.parametrize(("airspeed", "seconds"), [(8.0, 60.3), (12.0, 40.3), (15.0, 33.0), (20.0, 32.2)])
def test_the_square_is_flown_in_time_along_its_sides_and_at_its_altitudes(airspeed, seconds):
    flight = Flight(airborne=False)
    flight.autopilot.arming.arm()
    flight.autopilot.missions.load(square(airspeed))
    assert flight.autopilot.missions.start().accepted
    flight.fly_until(lambda: 5 in flight.reached, 120.0)
    flown = flight.time >= flight.reached[0]
    assert flight.time[-1] - flight.reached[0] <= seconds
    assert math.sqrt(np.mean(off_polygon(flight.p[flown], SQUARE) ** 2)) <= 5.0
    assert flight.p[flown, 2].min() >= 20.0 - 3.0
    assert flight.p[flown, 2].max() <= 30.0 + 5.0
    assert not flight.failsafes
    if airspeed == 15.0:
        assert flight.energy[-1] - flight.energy[flown][0] <= 2300.0
    assert flight.flown_forward[flown].mean() > 0.8


def test_the_square_ends_on_the_ground_where_it_began():
    flight = Flight(airborne=False).fly_mission(square(15.0))
    assert list(flight.reached) == list(range(7))
    assert flight.vehicle.law is Law.LANDED
    assert np.linalg.norm(flight.p[-1][:2]) < 0.5


@pytest.mark.long
def test_a_fly_by_corner_is_cut_a_little_and_a_fly_over_corner_is_met():
    flown = {}
    for radius in (0.0, 2.0, 5.0):
        flight = airborne()
        corners = ((120.0, 0.0), (120.0, 120.0))
        points = [waypoint(*corner, HIGH, radius=radius) for corner in corners]
        flight.fly_mission([*points, waypoint(0.0, 120.0, HIGH)])
        on_track = off_polygon(flight.p[flight.flown_forward], ((0.0, 0.0), *corners, (0.0, 120.0)))
        flown[radius] = [float(np.linalg.norm(flight.p[:, :2] - corner, axis=1).min()) for corner in corners]
        assert flight.reached.keys() == {0, 1, 2}
        if radius == 0.0:
            assert on_track.max() < 15.0
    assert max(flown[2.0]) < 2.0
    assert max(flown[5.0]) < 5.0
    # The arc of V2 / 6 m/s2 that begins 37.5 m before a right angle passes 15.5 m inside it.
    assert 5.0 < min(flown[0.0]) <= max(flown[0.0]) < 17.0


@pytest.mark.long
def test_a_leg_before_a_tight_circle_is_flown_fast_and_slowed_down_on_at_its_end():
    flight = airborne(wind_speed=6.0, wind_from=270.0)
    points = [waypoint(0.0, -120.0, HIGH), waypoint(-110.0, -40.0, HIGH)]
    flight.fly_mission([*points, circle(1.0, 15.0, -140.0, -80.0, HIGH), waypoint(-80.0, -80.0, HIGH)])
    assert flight.reached.keys() == {0, 1, 2, 3}
    assert flight.reached[1] - flight.reached[0] < 18.0  # all of the 136 m as slow as the circle: 25.6 s


def test_a_waypoint_that_is_moved_on_the_way_to_it_is_reached_without_a_stop():
    flight = airborne()
    flight.autopilot.missions.load([waypoint(200.0, 0.0, HIGH), waypoint(200.0, 150.0, HIGH)])
    assert flight.autopilot.missions.start().accepted
    flight.fly(0.1)
    flight.fly_until(lambda: flight.p[-1][0] > 60.0, 60.0)
    flight.autopilot.missions.revise([waypoint(200.0, 60.0, HIGH, radius=3.0), waypoint(200.0, 150.0, HIGH)])
    flight.fly_until(lambda: 0 in flight.reached, 60.0)
    since = flight.p[:, 0] > 60.0
    assert flight.flown_forward[since].all()
    assert np.linalg.norm(flight.p[-1][:2] - (200.0, 60.0)) < 5.0
    assert flight.autopilot.mode is Mode.MISSION


@pytest.mark.long(after=1)
@pytest.mark.parametrize("radius", [40.0, -40.0, 25.0])
def test_a_loiter_makes_its_turns_at_its_radius_and_in_its_direction(radius):
    flight = airborne()
    flight.fly_mission([circle(2.0, radius, 80.0, 0.0, HIGH), waypoint(0.0, 0.0, HIGH)])
    away = flight.p[:, :2] - (80.0, 0.0)
    distance = np.linalg.norm(away, axis=1)
    first, last = np.argmax(distance < 1.3 * abs(radius)), np.argmax(flight.time >= flight.reached[0])
    bearing = np.unwrap(np.arctan2(away[:, 1], away[:, 0]))
    clockwise = math.copysign(1.0, radius)  # seen from above, as MAVLink has it
    assert bearing[last] - bearing[first] == pytest.approx(-clockwise * 2.0 * math.tau, abs=0.2)
    second = slice((first + last) // 2, last)
    assert np.abs(distance[second] - abs(radius)).max() < 2.0
    assert np.abs(flight.p[second, 2] - HIGH).max() < 1.0


def test_transition_items_decide_which_legs_are_hovered():
    hover, forward = (transition(state) for state in (mavlink.MAV_VTOL_STATE_MC, mavlink.MAV_VTOL_STATE_FW))
    points = waypoint(60.0, 0.0, HIGH), waypoint(100.0, 0.0, HIGH), waypoint(200.0, 0.0, HIGH)
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD))
    flight.fly_mission([hover, points[0], forward, points[1], hover, points[2]])
    north = flight.p[:, 0]
    fast = np.abs(flight.v[:, 0]) > 4.5
    assert not flight.flown_forward[north < 55.0].any()
    assert fast[(north > 65.0) & (north < 85.0)].any()
    assert not flight.flown_forward[north > 110.0].any()
    assert np.linalg.norm(flight.p[-1] - (200.0, 0.0, HIGH)) < 1.0


def test_a_take_off_met_in_forward_flight_is_passed_over_without_a_stop():
    flight = airborne()
    again = item(mavlink.MAV_CMD_NAV_TAKEOFF, 120.0, 0.0, 10.0)
    flight.fly_mission((waypoint(120, 0, HIGH), again, waypoint(240, 0, HIGH)))
    between = (flight.p[:, 0] > 80.0) & (flight.p[:, 0] < 180.0)
    assert flight.v[between, 0].min() > 12.0
    assert flight.p[:, 2].min() > HIGH - 3.0
    assert sorted(flight.reached) == [0, 1, 2]


def test_a_mission_that_pauses_between_legs_flown_forward_holds_at_the_point():
    flight = airborne()
    flight.autopilot.missions.load(
        (waypoint(120, 0, HIGH), replace(cruise_at(12.0), autocontinue=False), waypoint(240, 0, HIGH))
    )
    flight.autopilot.missions.start()
    flight.fly_until(lambda: flight.autopilot.mode is Mode.HOLD, 40.0)
    flight.fly(5.0)
    assert flight.p[-1] == pytest.approx((120.0, 0.0, HIGH), abs=1.0)
    assert sorted(flight.reached) == [0, 1]
    assert flight.autopilot.missions.start().accepted
    flight.fly_until(lambda: flight.autopilot.mission.finished, 40.0)
    assert sorted(flight.reached) == [0, 1, 2]


def test_a_command_makes_the_front_and_the_back_transition():
    flight = airborne()
    assert send(flight, mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_VTOL_STATE_FW).accepted
    flight.fly(30.0)
    assert regime(flight.vehicle) is Regime.FORWARD  # on a circle, having nowhere else to go
    assert np.linalg.norm(flight.p[-1][:2]) < 4.0 * Settings().loiter_radius
    assert abs(flight.p[-1][2] - HIGH) < 1.0
    assert send(flight, mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_VTOL_STATE_MC).accepted
    before = flight.p[-1]
    flight.fly(25.0)
    assert flight.vehicle.law is Law.HOVER_LINEAR
    assert np.linalg.norm(flight.v[-1]) < 0.05
    assert np.linalg.norm(flight.p[-1] - before) < 70.0


def test_a_transition_that_cannot_be_flown_is_refused_with_a_reason():
    flight = airborne()
    assert "param1" in send(flight, mavlink.MAV_CMD_DO_VTOL_TRANSITION, 7.0).text
    assert send(flight, mavlink.MAV_CMD_DO_VTOL_TRANSITION, NAN).result == mavlink.MAV_RESULT_DENIED
    landed = Flight(airborne=False)
    assert not send(landed, mavlink.MAV_CMD_DO_VTOL_TRANSITION, mavlink.MAV_VTOL_STATE_FW).accepted


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("velocity", "forward"),
    [
        ((3.0, 0.0, 0.0), False),
        ((0.0, 3.0, 0.0), False),
        ((1.2, -1.6, 1.0), False),
        ((12.0, 0.0, 0.0), True),
        ((-8.0, 9.0, 0.5), True),
    ],
)
def test_a_streamed_velocity_is_flown_and_the_vehicle_stops_when_it_ends(velocity, forward):
    flight = Flight()

    def stream():
        assert flight.autopilot.offboard.set_velocity(velocity) is None

    stream()
    assert flight.autopilot.set_mode(Mode.OFFBOARD).accepted
    flight.fly(18.0, each=stream)
    assert flight.v[-100:].mean(axis=0) == pytest.approx(velocity, abs=0.2)
    assert flight.flown_forward[-1] == forward
    before = flight.p[-1]
    flight.fly(25.0)
    assert flight.autopilot.mode is Mode.HOLD
    assert np.linalg.norm(flight.v[-1]) < 0.05
    assert np.linalg.norm(flight.p[-1] - before) < (60.0 if forward else 5.0)


def test_a_velocity_between_hover_and_forward_flight_is_refused():
    flight = airborne()
    for velocity in ((5.0, 0.0, 0.0), (0.0, 30.0, 0.0), (1.0, 0.0, -4.0)):
        assert "hover to 3, forward flight from 7 m/s" in flight.autopilot.offboard.set_velocity(velocity)


def test_a_hold_in_forward_flight_stops_ahead_and_stays():
    flight = in_cruise()
    before = flight.p[-1]
    assert flight.autopilot.guided.hold().accepted
    flight.fly(25.0)
    assert flight.names[-2:] == ["fly_indi", "enter_proved"]
    assert np.linalg.norm(flight.v[-1]) < 0.05
    assert 20.0 < flight.p[-1][0] - before[0] < 75.0
    assert flight.p[:, 0].max() - flight.p[-1][0] < 1.0  # without overshoot
    assert np.abs(flight.p[:, 2] - HIGH).max() < 6.0


def test_a_point_just_ahead_is_hovered_to():
    """Ten metres ahead is too near to stop at: the vehicle makes a back transition and returns to the point."""
    flight = in_cruise()
    point = (float(flight.p[-1][0]) + 10.0, 0.0, HIGH)
    assert flight.autopilot.guided.go_to(point).accepted
    flight.fly(0.1)
    flight.fly(40.0)
    assert np.linalg.norm(flight.p[-1] - point) < 0.5
    assert not is_forward(flight.vehicle)


def test_a_return_from_forward_flight_turns_round_and_lands_at_home():
    flight = in_cruise(plant=load("collage").parameters)
    assert flight.autopilot.guided.return_to_launch().accepted
    flight.fly_until(lambda: flight.vehicle.law is Law.LANDED, 120.0)
    assert np.linalg.norm(flight.p[-1][:2]) < 0.5
    assert not flight.failsafes
    assert flight.p[flight.flown_forward, 2].min() > HIGH - 3.1


# Waypoints are reached where they are passed, near them and at their height, whatever their order and slope.


AIRSPEED = Settings().airspeed
RADIUS = AIRSPEED**2 / 6.0


def fly(places, limit, **options):
    """Fly through places from above the first one's height; gives the offsets told at each, level and in height."""
    aircraft = make_aircraft(up=places[0][2])
    autopilot, told = aircraft.autopilot, {}
    aircraft.advance(AUTOPILOT_PERIODS)
    autopilot.missions.load(tuple(waypoint(*place, **options) for place in places))
    assert autopilot.missions.start().accepted
    for _ in range(round(limit / 0.02)):
        aircraft.advance(AUTOPILOT_PERIODS)
        p = autopilot.view.p
        for seq in autopilot.reached():
            told[seq] = math.dist(p[:2], places[seq][:2]), p[2] - places[seq][2]
        if autopilot.mode is not Mode.MISSION:
            break
    assert autopilot.mode is Mode.HOLD
    assert autopilot.view.crash is None
    assert list(told) == list(range(len(places)))
    return told


@pytest.mark.long(after=1)
@pytest.mark.parametrize(
    ("places", "limit"),
    [
        ([(200.0, 0.0, 30.0), (0.0, -1.0, 30.0), (200.0, -2.0, 30.0)], 75.0),  # reversals
        ([(100.0, 0.0, 30.0), (180.0, 0.0, 90.0), (300.0, 0.0, 90.0)], 75.0),  # a climb too steep for its leg
        ([(150.0, 0.0, 100.0), (400.0, 0.0, 15.0), (600.0, 0.0, 15.0)], 95.0),  # and a descent
        ([(150.0, 0.0, 30.0), (150.0, -30.0, 30.0), (0.0, -30.0, 30.0)], 75.0),  # closer than a turn
    ],
)
def test_waypoints_are_passed_near_them_and_at_their_height(places, limit):
    for level, height in fly(places, limit).values():
        assert level <= corner_cut(AIRSPEED) + 0.5
        assert abs(height) <= Settings().height_acceptance


def test_a_corner_is_cut_as_before_and_told_where_it_is_passed():
    told = fly([(200.0, 0.0, 30.0), (200.0, -200.0, 30.0)], 40.0)
    assert told[0][0] == pytest.approx(corner_cut(AIRSPEED), abs=2.5)
    assert told[1][0] < Settings().acceptance + 0.1


def test_the_radius_of_an_item_is_how_near_it_is_passed():
    told = fly([(200.0, 0.0, 30.0), (200.0, -200.0, 30.0)], 45.0, radius=4.0)
    assert told[0][0] <= 4.0


def test_a_sharp_turn_begins_no_earlier_than_one_of_a_right_angle():
    ends = ((0.0, 0.0, 0.0), (500.0, 0.0, 0.0))
    for degrees, lead in (
        (30.0, RADIUS * math.tan(math.radians(15.0))),
        (90.0, RADIUS),
        (150.0, RADIUS),
        (180.0, RADIUS),
    ):
        turn = math.radians(degrees)
        after = (500.0 + 500.0 * math.cos(turn), 500.0 * math.sin(turn), 0.0)
        assert corner_lead(*ends, after, AIRSPEED) == pytest.approx(lead)
    assert corner_cut(AIRSPEED) == pytest.approx(RADIUS * (math.sqrt(2.0) - 1.0))


def test_items_behind_a_waypoint_wait_until_it_is_passed():
    passed = PassedItems()
    passed.add(0)
    passed.begin_turn((100.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    passed.add(1)
    passed.add(2)
    passed.update((80.0, 5.0, 0.0))
    assert passed.told == [0]
    passed.update((99.0, 12.0, 0.0))
    passed.update((104.0, 30.0, 0.0))
    assert passed.told == [0, 1, 2]
    passed.add(3)
    assert passed.told == [0, 1, 2, 3]


def test_an_interruption_tells_what_waits():
    passed = PassedItems()
    passed.begin_turn((100.0, 0.0, 0.0), (60.0, 0.0, 0.0))
    passed.add(4)
    passed.end_turn()
    assert passed.told == [4]
