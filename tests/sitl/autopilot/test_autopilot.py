"""Modes, guided flight and missions: what is allowed when, and that a refusal changes nothing."""

import copy
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.manual import Sticks
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import LAND, TAKE_OFF, waypoint

WORLD = World(LocalFrame(HOME), ARENAS["open"])
DENIED = mavlink.MAV_RESULT_DENIED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def view(time=0.0, p=(0.0, 0.0, 0.0), landed=True):
    return VehicleView(time=time, p=p, v=(0.0, 0.0, 0.0), heading=0.0, tilt=0.0, landed=landed, battery_remaining=1.0)


@pytest.fixture
def autopilot():
    autopilot = Autopilot(WORLD, Settings())
    autopilot.update(view())
    return autopilot


@pytest.fixture
def airborne(autopilot):
    autopilot.arming.arm()
    autopilot.guided.take_off(3.0)
    autopilot.update(view(1.0, landed=False))
    autopilot.update(view(10.0, p=(0.0, 0.0, 3.0), landed=False))
    return autopilot


def state(autopilot):
    """Everything a refusal must not change; the pilot may be told."""
    parts = (autopilot._flight, autopilot.arming, autopilot.missions, autopilot.transitions, autopilot.offboard)
    shared = {"_flight", "_arming", "_failsafes", "_notices", "_before_change", "world", "carry_out"}
    own = [{name: value for name, value in vars(part).items() if name not in shared} for part in parts]
    return copy.deepcopy((own, vars(autopilot.manual)["_last"], autopilot.failsafes))


def test_take_off_climbs_then_holds_at_its_height(airborne):
    assert airborne.mode is Mode.HOLD
    assert airborne.update(view(11.0, p=(0.0, 0.0, 3.0), landed=False)).position == (0.0, 0.0, 3.0)


@pytest.mark.parametrize("height", [-1.0, 0.2, 1e6, math.nan])
def test_take_off_to_an_impossible_height_is_denied(autopilot, height):
    autopilot.arming.arm()
    before = state(autopilot)
    assert autopilot.guided.take_off(height).result == DENIED
    assert state(autopilot) == before


def test_a_landing_ends_on_the_ground_and_disarms_after_a_while(airborne):
    assert airborne.guided.land().result == ACCEPTED
    assert airborne.landing
    airborne.update(view(20.0, landed=False))
    airborne.touched_down(view(20.5))
    airborne.update(view(21.0))
    assert airborne.armed
    airborne.update(view(23.0))
    assert not airborne.armed


def test_a_mission_flies_through_to_its_landing(autopilot):
    autopilot.missions.load([TAKE_OFF, waypoint(4, 0, 3), LAND])
    assert autopilot.missions.start().result == ACCEPTED
    assert not autopilot.flying  # it waits for arming
    autopilot.arming.arm()
    assert autopilot.flying
    p, time, reached = (0.0, 0.0, 0.0), 0.0, []
    while autopilot.flying and time < 60.0:
        p = autopilot.update(view(time, p=p, landed=False)).position
        reached += autopilot.reached()
        if autopilot.landing and p[2] <= 0.0:
            autopilot.touched_down(view(time))
        time += 0.02
    assert reached + autopilot.reached() == [0, 1, 2]
    assert p[:2] == pytest.approx((4.0, 0.0))


def test_a_mission_resumes_at_its_current_item_after_a_hold(autopilot):
    autopilot.missions.load([TAKE_OFF, waypoint(4, 0, 3), waypoint(4, -4, 3), LAND])
    autopilot.arming.arm()
    autopilot.missions.start(1)
    autopilot.update(view(0.0, p=(0.0, 0.0, 3.0), landed=False))
    autopilot.guided.hold()
    assert autopilot.update(view(5.0, p=(1.0, 0.0, 3.0), landed=False)).position[0] < 4.0
    autopilot.missions.start()
    assert autopilot.update(view(6.0, p=(1.0, 0.0, 3.0), landed=False)).position == (4.0, 0.0, 3.0)


def test_a_new_mission_does_not_keep_flying_the_old_one(airborne):
    airborne.missions.load([waypoint(40, 0, 3)])
    airborne.missions.start()
    airborne.missions.load([waypoint(0, -40, 3)])
    assert airborne.mode is Mode.HOLD


def test_the_vehicle_turns_to_where_the_current_item_was_moved_and_flies_on(airborne):
    airborne.missions.load([TAKE_OFF, waypoint(40, 0, 3), waypoint(40, -40, 3)])
    airborne.missions.start(1)
    airborne.update(view(1.0, (0.0, 0.0, 3.0), landed=False))
    airborne.missions.revise([TAKE_OFF, waypoint(0, -40, 3), waypoint(40, -40, 3)])
    assert (airborne.mode, airborne.mission.current) == (Mode.MISSION, 1)
    airborne.update(view(1.02, (0.0, 0.0, 3.0), landed=False))
    assert airborne.reference.position == pytest.approx((0.0, -40.0, 3.0))


def test_items_behind_the_vehicle_change_nothing_of_its_way(airborne):
    airborne.missions.load([TAKE_OFF, waypoint(4, 0, 3), waypoint(40, 0, 3, hold=9.0)])
    airborne.missions.start(2)
    airborne.update(view(1.0, (40.0, 0.0, 3.0), landed=False))
    airborne.missions.revise([TAKE_OFF, waypoint(8, 0, 3), waypoint(40, 0, 3, hold=9.0)])
    airborne.update(view(9.5, (40.0, 0.0, 3.0), landed=False))
    assert airborne.mode is Mode.MISSION
    airborne.update(view(10.5, (40.0, 0.0, 3.0), landed=False))  # the hold was not begun anew
    assert airborne.mode is Mode.HOLD


def test_a_mission_of_another_length_replaces_the_old_one(airborne):
    airborne.missions.load([TAKE_OFF, waypoint(40, 0, 3)])
    airborne.missions.start(1)
    airborne.missions.revise([TAKE_OFF])
    assert airborne.mode is Mode.HOLD


def test_a_vehicle_holds_where_an_item_was_moved_out_of_bounds(airborne):
    airborne.missions.load([TAKE_OFF, waypoint(40, 0, 3)])
    airborne.missions.start(1)
    airborne.missions.revise([TAKE_OFF, waypoint(40_000, 0, 3)])
    assert airborne.mode is Mode.HOLD


@pytest.mark.parametrize("point", [(2e3, 0.0, 3.0), (0.0, 0.0, -1.0), (math.nan, 0.0, 3.0)])
def test_going_out_of_the_arena_is_denied_and_changes_nothing(airborne, point):
    before = state(airborne)
    assert airborne.guided.go_to(point).result == DENIED
    assert state(airborne) == before


def test_offboard_needs_fresh_set_points_and_holds_when_they_stop(airborne):
    assert airborne.set_mode(Mode.OFFBOARD).result == REJECTED
    airborne.offboard.set_position((3.0, 0.0, 3.0))
    assert airborne.set_mode(Mode.OFFBOARD).result == ACCEPTED
    assert airborne.update(view(10.1, p=(0.0, 0.0, 3.0), landed=False)).position == (3.0, 0.0, 3.0)
    airborne.update(view(20.0, p=(2.0, 0.0, 3.0), landed=False))
    assert airborne.mode is Mode.HOLD
    assert any("stopped" in notice.text for notice in airborne.notices())


def test_unavailable_modes_are_denied(airborne):
    before = state(airborne)
    assert airborne.set_mode(Mode.ACRO).result == DENIED
    assert state(airborne) == before


def test_a_hold_near_the_ground_is_flown_at_a_safe_height(autopilot):
    autopilot.arming.arm()
    autopilot.guided.take_off(3.0)
    autopilot.update(view(0.1, p=(0.0, 0.0, 0.1), landed=False))
    autopilot.guided.hold()
    assert autopilot.update(view(0.2, p=(0.0, 0.0, 0.1), landed=False)).position[2] >= 1.0


REQUESTS = st.sampled_from(
    [
        lambda a: a.arming.arm(),
        lambda a: a.arming.disarm(),
        lambda a: a.guided.take_off(3.0),
        lambda a: a.guided.hold(),
        lambda a: a.guided.land(),
        lambda a: a.guided.return_to_launch(),
        lambda a: a.guided.go_to((5.0, 5.0, 5.0)),
        lambda a: a.missions.start(),
        lambda a: a.set_mode(Mode.OFFBOARD),
        lambda a: a.set_mode(Mode.RTL),
        lambda a: a.set_mode(Mode.POSCTL),
        lambda a: a.manual.take_sticks(Sticks(up=1.0)),
        lambda a: a.offboard.set_position((3.0, 1.0, 4.0)),
        lambda a: a.guided.change_height(6.0),
        lambda a: a.missions.set_current(1),
        lambda a: a.missions.set_current(None, resets=True),
        lambda a: a.guided.change_speed(mavlink.SPEED_TYPE_GROUNDSPEED, 1.0),
        lambda a: a.missions.load([TAKE_OFF, waypoint(4, 0, 3), LAND]),
        lambda a: a.touched_down(a.view) if a.landing else None,
    ]
)


@settings(deadline=None, max_examples=60)
@given(st.lists(REQUESTS, max_size=25))
def test_whatever_is_requested_the_reference_stays_finite_and_inside_the_arena(requests):
    autopilot, p = Autopilot(WORLD, Settings()), (0.0, 0.0, 0.0)
    for tick, request in enumerate(requests):
        request(autopilot)
        reference = autopilot.update(view(0.5 * tick, p=p, landed=not autopilot.flying))
        assert all(map(math.isfinite, reference.position))
        assert autopilot.landing or WORLD.arena.refuse(reference.position) is None
        assert not (autopilot.flying and not autopilot.armed)
        p = (*reference.position[:2], max(reference.position[2], 0.0))
