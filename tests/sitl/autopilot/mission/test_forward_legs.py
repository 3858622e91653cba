"""Waypoints are reached where they are passed, near them and at their height, whatever their order and slope."""

import math

import pytest

from protocol.names.modes import Mode
from sitl.autopilot.mission.runner import PassedItems
from sitl.autopilot.settings import Settings
from sitl.guidance.leg_speeds import corner_cut, corner_lead
from sitl.vehicle.aircraft import AUTOPILOT_PERIODS
from tests.support.vehicle.fake_station import make_aircraft
from tests.support.vehicle.mission_items import waypoint

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
    assert told[0][0] == pytest.approx(corner_cut(AIRSPEED), abs=1.0)
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
