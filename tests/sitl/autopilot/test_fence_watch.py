"""A plan that turns or stops inside the fence is flown; a vehicle off its way is looked at straight on, as by hand."""

import math

import numpy as np
import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, LegMode
from protocol.names import Mode
from sitl.autopilot.fence_watch import OFF_WAY, FenceWatch
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import Fence, Polygon
from sitl.control.reference import circle, leg
from sitl.guidance.view import VehicleView
from sitl.guidance.way_ahead import WayStretch, way_ahead
from sitl.model.airframe_files import load
from tests.support.flights.recorded_flight import HIGH, Flight
from tests.support.vehicle.mission_items import item, waypoint

DARKO = load("darko").parameters
RETURN = 3  # of GF_ACTION
AIRSPEED, STOP = 15.0, 70.0  # [m/s], [m]


def north_to(limit):
    """A fence that ends so far in the north [m]."""
    return Fence(inclusions=(Polygon(np.array([(-60.0, -200.0), (limit, -200.0), (limit, 200.0), (-60.0, 200.0)])),))


# The watch alone

NORTH = WayStretch(leg((0.0, 0.0, HIGH), (140.0, 0.0, HIGH), AIRSPEED, stop=False), 37.5)
WEST = WayStretch(leg((140.0, 0.0, HIGH), (140.0, 140.0, HIGH), AIRSPEED, stop=True))
ROUND_THE_CORNER = (NORTH, WEST)


def flying(north, west=0.0, v=(AIRSPEED, 0.0, 0.0), law=Law.INDI):
    return VehicleView(
        north / AIRSPEED, (north, west, HIGH), v, 0.0, 1.5, False, 1.0, forward=True, stopping_distance=STOP, law=law
    )


def test_the_way_follows_the_legs_and_is_no_tighter_than_it_is_flown():
    way = way_ahead(flying(20.0), ROUND_THE_CORNER)
    p = np.array([point.p for point in way.points])
    assert way.is_whole
    assert 140.0 <= p[:, 0].max() < 150.0
    assert p[-1, :2] == pytest.approx((140.0, 140.0), abs=4.0)
    assert not way_ahead(flying(20.0), (NORTH,)).is_whole  # nobody knows what comes after it


def test_the_way_round_a_corner_is_as_narrow_as_the_vehicle_slows_down_before_it():
    fast, slow = NORTH._replace(lead=12.0), NORTH._replace(lead=12.0, end_airspeed=8.0)
    wide, narrow = (max(one.p[0] for one in way_ahead(flying(20.0), (leg, WEST)).points) for leg in (fast, slow))
    assert 140.0 < narrow < wide - 8.0
    assert slow.path.airspeed == AIRSPEED


def test_the_way_goes_once_round_a_circle():
    path = circle((0.0, 0.0, HIGH), -40.0, AIRSPEED)
    way = way_ahead(flying(0.0, 40.0), (WayStretch(path),))
    p = np.array([point.p for point in way.points])
    assert way.is_whole
    assert np.hypot(p[:, 0], p[:, 1]).max() < 46.0


def breach(watch, view, stretches, limit=165.0):
    return watch.check(view, north_to(limit), stretches)


def test_on_its_legs_it_flies_on_where_straight_on_it_would_leave_the_fence():
    assert all(breach(watch, flying(north), ROUND_THE_CORNER) is None for watch in [FenceWatch()] for north in (80, 95))
    assert breach(FenceWatch(), flying(95.0), ROUND_THE_CORNER, 148.0) is not None
    assert breach(FenceWatch(), flying(95.0), (NORTH,)) is not None
    assert breach(FenceWatch(), flying(95.0), ()) is not None
    assert breach(FenceWatch(), flying(95.0, law=Law.FORWARD_LINE_OF_SIGHT), ROUND_THE_CORNER) is not None


def test_a_vehicle_that_does_not_turn_is_noticed_before_it_is_far_off_its_way():
    watch, noticed = FenceWatch(), None
    for north in range(60, 160, 2):
        stretches = ROUND_THE_CORNER if north < 102 else (WEST,)
        if breach(watch, flying(float(north)), stretches) is not None:
            noticed = north
            break
    assert noticed is not None
    assert 105 < noticed < 140


def test_a_vehicle_blown_aside_along_the_fence_is_looked_at_straight_on():
    along = (WayStretch(leg((0.0, 0.0, HIGH), (0.0, 400.0, HIGH), AIRSPEED, stop=True)),)
    watch, aside = FenceWatch(), (6.0, 13.7, 0.0)
    assert watch.check(flying(0.0, 20.0, (0.0, AIRSPEED, 0.0)), north_to(22.0), along) is None
    off = flying(OFF_WAY + 1.0, 60.0, aside)
    assert watch.check(off, north_to(22.0), along).text == "about to be outside the fence"


# Flights


def flown(items, limit, *, airspeed=AIRSPEED, wind=0.0, gusts=0.0, wind_from=180.0):
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=airspeed, fence_action=RETURN)
    flight = Flight(settings=settings, plant=DARKO, wind_speed=wind, wind_from=wind_from, gusts=gusts)
    flight.autopilot.load_fence(north_to(limit))
    flight.autopilot.missions.load(items)
    assert flight.autopilot.missions.start().accepted
    flight.fly(60.0)
    return flight


CORNER = (waypoint(140, 0, HIGH), waypoint(140, -140, HIGH))
CIRCLE = (item(mavlink.MAV_CMD_NAV_LOITER_TURNS, 100, 0, HIGH, (1.0, 0.0, 40.0, math.nan)), waypoint(0, 0, HIGH))
STOP_THERE = (waypoint(150, 0, HIGH, hold=1.0), waypoint(0, 0, HIGH))
BACK = (waypoint(140, 0, HIGH), waypoint(0, -30, HIGH))


@pytest.mark.long(after=1)
@pytest.mark.parametrize("items", [CORNER, CIRCLE, STOP_THERE, BACK], ids=["corner", "circle", "stop", "back"])
def test_a_mission_inside_the_fence_is_flown_at_normal_speed(items):
    flight = flown(items, 165.0)
    assert not [text for text in flight.texts if "Fence" in text]
    assert set(flight.reached) == {0, 1}
    assert flight.p[:, 0].max() < 155.0


@pytest.mark.long(after=1)
@pytest.mark.parametrize(("airspeed", "wind", "gusts"), [(15.0, 0.0, 0.0), (20.0, 0.0, 0.0), (12.0, 6.0, 0.7)])
def test_too_near_to_the_fence_it_is_broken_off_in_time(airspeed, wind, gusts):
    flight = flown(BACK, 142.0, airspeed=airspeed, wind=wind, gusts=gusts)
    assert "Fence: about to be outside the fence: returning" in flight.texts
    assert flight.autopilot.mode is not Mode.MISSION
    assert flight.p[:, 0].max() < 142.0


@pytest.mark.long
@pytest.mark.parametrize("gust", [(10.0, 0.0, 0.0), (6.0, 0.0, 0.0), (8.0, 8.0, 0.0)])
def test_blown_on_before_its_corner_it_stays_inside(gust):
    settings = Settings(leg_mode=LegMode.FORWARD, airspeed=AIRSPEED, fence_action=RETURN)
    flight = Flight(settings=settings, plant=DARKO)
    flight.autopilot.load_fence(north_to(165.0))
    flight.autopilot.missions.load(CORNER)
    assert flight.autopilot.missions.start().accepted
    flight.fly(0.1)
    flight.fly_until(lambda: flight.p[-1, 0] > 95.0, 30.0)
    flight.vehicle.set_wind(gust, 0.5)
    flight.fly(30.0)
    assert flight.p[:, 0].max() < 165.0


def test_by_hand_and_by_set_points_nothing_is_planned():
    flight = Flight(settings=Settings(leg_mode=LegMode.FORWARD), plant=DARKO)
    flight.autopilot.guided.go_to((300.0, 0.0, HIGH))
    flight.fly(2.0)
    assert flight.autopilot._flight.stretches_ahead()
    for mode in (Mode.OFFBOARD, Mode.POSCTL, Mode.LAND, Mode.TAKEOFF):
        flight.autopilot._flight.mode = mode
        assert flight.autopilot._flight.stretches_ahead() == ()
