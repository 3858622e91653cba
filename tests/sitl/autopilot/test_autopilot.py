"""Modes, arming and guided flight: what is allowed when, and that a refusal changes nothing."""

import copy
import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.modes import Mode
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.guidance import View
from sitl.autopilot.mission import World
from sitl.autopilot.outcome import ACCEPTED
from sitl.autopilot.settings import Settings
from tests.sitl.autopilot.test_missions import LAND, TAKE_OFF, waypoint

WORLD = World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"])
DENIED = mavlink.MAV_RESULT_DENIED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def view(time=0.0, p=(0.0, 0.0, 0.0), landed=True, v=(0.0, 0.0, 0.0), tilt=0.0, energy=1.0):
    return View(time, p, v, 0.0, tilt, landed, energy)


@pytest.fixture
def autopilot():
    made = Autopilot(WORLD, Settings())
    made.update(view())
    return made


@pytest.fixture
def airborne(autopilot):
    autopilot.arm()
    autopilot.take_off(3.0)
    autopilot.update(view(1.0, landed=False))
    autopilot.update(view(10.0, p=(0.0, 0.0, 3.0), landed=False))
    return autopilot


def image(autopilot):
    """Everything a refusal must not touch."""
    kept = {k: v for k, v in vars(autopilot).items() if k not in {"_notices", "world"}}
    return copy.deepcopy(kept)


@pytest.mark.parametrize(
    ("seen", "word"),
    [
        (view(landed=False, p=(0.0, 0.0, 4.0)), "not on the ground"),
        (view(tilt=math.radians(80.0)), "not upright"),
        (view(v=(0.0, 1.0, 0.0)), "moving"),
        (view(energy=0.05), "battery"),
    ],
)
def test_each_arming_check_refuses_in_words(autopilot, seen, word):
    autopilot.update(seen)
    outcome = autopilot.arm()
    assert outcome.result == REJECTED
    assert word in outcome.text
    assert not autopilot.armed
    assert autopilot.arm(force=True).result == ACCEPTED


def test_take_off_waits_for_arming(autopilot):
    assert autopilot.take_off(3.0).result == ACCEPTED
    assert not autopilot.flying
    assert autopilot.arm().result == ACCEPTED
    assert autopilot.flying
    assert autopilot.mode is Mode.TAKEOFF


def test_take_off_climbs_then_holds_at_its_height(airborne):
    assert airborne.mode is Mode.HOLD
    assert airborne.update(view(11.0, p=(0.0, 0.0, 3.0), landed=False)).position == (0.0, 0.0, 3.0)


@pytest.mark.parametrize("height", [-1.0, 0.2, 1e6, math.nan])
def test_take_off_to_an_impossible_height_is_denied(autopilot, height):
    autopilot.arm()
    before = image(autopilot)
    assert autopilot.take_off(height).result == DENIED
    assert image(autopilot) == before


def test_disarming_in_the_air_is_denied_unless_forced(airborne):
    assert airborne.disarm().result == DENIED
    assert airborne.armed
    assert airborne.disarm(force=True).result == ACCEPTED
    assert not airborne.armed


def test_landing_ends_on_the_ground_and_disarms_after_a_while(airborne):
    assert airborne.land().result == ACCEPTED
    assert airborne.landing
    airborne.update(view(20.0, landed=False))
    airborne.touched_down()
    airborne.update(view(21.0))
    assert airborne.armed
    airborne.update(view(23.0))
    assert not airborne.armed


def test_a_mission_flies_through_to_its_landing(autopilot):
    autopilot.load_mission([TAKE_OFF, waypoint(4, 0, 3), LAND])
    assert autopilot.start_mission().result == REJECTED
    autopilot.arm()
    assert autopilot.start_mission().result == ACCEPTED
    p, time, reached = (0.0, 0.0, 0.0), 0.0, []
    while autopilot.flying and time < 60.0:
        p = autopilot.update(view(time, p=p, landed=False)).position
        reached += autopilot.reached()
        if autopilot.landing and p[2] <= 0.0:
            autopilot.touched_down()
        time += 0.02
    assert reached + autopilot.reached() == [0, 1, 2]
    assert p[:2] == pytest.approx((4.0, 0.0))


def test_a_mission_resumes_at_its_current_item_after_a_hold(autopilot):
    autopilot.load_mission([TAKE_OFF, waypoint(4, 0, 3), waypoint(4, 4, 3), LAND])
    autopilot.arm()
    autopilot.start_mission(1)
    autopilot.update(view(0.0, p=(0.0, 0.0, 3.0), landed=False))
    autopilot.hold()
    assert autopilot.update(view(5.0, p=(1.0, 0.0, 3.0), landed=False)).position[0] < 4.0
    autopilot.start_mission()
    assert autopilot.update(view(6.0, p=(1.0, 0.0, 3.0), landed=False)).position == (4.0, 0.0, 3.0)


def test_a_new_mission_does_not_keep_flying_the_old_one(airborne):
    airborne.load_mission([waypoint(40, 0, 3)])
    airborne.start_mission()
    airborne.load_mission([waypoint(0, 40, 3)])
    assert airborne.mode is Mode.HOLD


@pytest.mark.parametrize("point", [(2e3, 0.0, 3.0), (0.0, 0.0, -1.0), (math.nan, 0.0, 3.0)])
def test_going_out_of_the_arena_is_denied_and_changes_nothing(airborne, point):
    before = image(airborne)
    assert airborne.go_to(point).result == DENIED
    assert image(airborne) == before


def test_offboard_needs_fresh_setpoints_and_holds_when_they_stop(airborne):
    assert airborne.set_mode(Mode.OFFBOARD).result == REJECTED
    airborne.set_offboard_setpoint((3.0, 0.0, 3.0))
    assert airborne.set_mode(Mode.OFFBOARD).result == ACCEPTED
    assert airborne.update(view(10.1, p=(0.0, 0.0, 3.0), landed=False)).position == (3.0, 0.0, 3.0)
    airborne.update(view(20.0, p=(2.0, 0.0, 3.0), landed=False))
    assert airborne.mode is Mode.HOLD
    assert any("stopped" in notice.text for notice in airborne.notices())


def test_unavailable_modes_are_denied(airborne):
    before = image(airborne)
    assert airborne.set_mode(Mode.ACRO).result == DENIED
    assert image(airborne) == before


def test_a_hold_near_the_ground_is_flown_at_a_safe_height(autopilot):
    autopilot.arm()
    autopilot.take_off(3.0)
    autopilot.update(view(0.1, p=(0.0, 0.0, 0.1), landed=False))
    autopilot.hold()
    assert autopilot.update(view(0.2, p=(0.0, 0.0, 0.1), landed=False)).position[2] >= 1.0


REQUESTS = st.sampled_from(
    [
        lambda a: a.arm(),
        lambda a: a.disarm(),
        lambda a: a.take_off(3.0),
        lambda a: a.hold(),
        lambda a: a.land(),
        lambda a: a.return_to_launch(),
        lambda a: a.go_to((5.0, 5.0, 5.0)),
        lambda a: a.start_mission(),
        lambda a: a.set_mode(Mode.OFFBOARD),
        lambda a: a.set_current_item(1),
        lambda a: a.change_speed(1.0),
        lambda a: a.load_mission([TAKE_OFF, waypoint(4, 0, 3), LAND]),
        lambda a: a.touched_down() if a.landing else None,
    ]
)


@settings(deadline=None, max_examples=60)
@given(st.lists(REQUESTS, max_size=25))
def test_whatever_is_asked_the_reference_stays_finite_and_inside_the_arena(requests):
    autopilot, p = Autopilot(WORLD, Settings()), (0.0, 0.0, 0.0)
    for tick, request in enumerate(requests):
        request(autopilot)
        reference = autopilot.update(view(0.5 * tick, p=p, landed=not autopilot.flying))
        assert all(map(math.isfinite, reference.position))
        assert autopilot.landing or WORLD.arena.refuse(reference.position) is None
        assert not (autopilot.flying and not autopilot.armed)
        p = (*reference.position[:2], max(reference.position[2], 0.0))
