"""Missions are started, restarted, reset, paused and continued as MAVLink's commands mean it."""

from dataclasses import replace

import pytest

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import DENIED, FAILED
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.mission.items import refuse_items
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, Fence, World, make_fence
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from tests.support.vehicle.mission_items import LAND, TAKE_OFF, item, polygon, waypoint

WORLD = World(LocalFrame(HOME), ARENAS["open"])
SPEED = item(mavlink.MAV_CMD_DO_CHANGE_SPEED, params=(1.0, 0.5, -1.0, 0.0))
JUMP = item(mavlink.MAV_CMD_DO_JUMP, params=(1.0, 2.0, 0.0, 0.0))
LOOP = (TAKE_OFF, waypoint(2, 0, 3), waypoint(0, 0, 3), JUMP, SPEED, waypoint(0, 1, 3))
LOOPED = [0, *(1, 2, 3) * 3, 4, 5]


class Ideal:
    """An autopilot whose vehicle is at its reference one tick later."""

    def __init__(self, items):
        self.autopilot, self.p, self.time = Autopilot(WORLD, Settings()), (0.0, 0.0, 0.0), 0.0
        self.autopilot.update(self.view())
        self.autopilot.missions.load(items)
        self.autopilot.arming.arm()

    def view(self):
        still = (0.0, 0.0, 0.0)
        return VehicleView(self.time, self.p, still, 0.0, 0.0, landed=self.p[2] <= 0.0, battery_remaining=1.0)

    def fly(self, until=lambda _: False):
        """Fly on until the mission is left or something is true; returns the items that were reached."""
        while self.autopilot.mode is Mode.MISSION and not until(self.autopilot):
            assert self.time < 300.0
            self.time += 0.02
            self.p = tuple(self.autopilot.update(self.view()).position)
            if self.autopilot.landing and self.p[2] <= 0.0:
                self.p = (*self.p[:2], 0.0)
                self.autopilot.touched_down(self.view())
        return self.autopilot.reached()

    def texts(self):
        return [notice.text for notice in self.autopilot.notices()]


@pytest.fixture
def ideal():
    return Ideal(LOOP)


def test_a_mission_flown_again_is_flown_as_the_first_time(ideal):
    assert ideal.autopilot.missions.start().accepted
    assert ideal.fly() == LOOPED
    assert ideal.autopilot.mission.speed == 0.5
    assert ideal.autopilot.missions.start().accepted
    assert ideal.autopilot.mission.speed == Settings().hover_speed
    assert ideal.fly() == LOOPED


def test_after_a_landing_and_a_new_arming_it_begins_as_the_first_time():
    ideal = Ideal((*LOOP, LAND))
    for _ in range(2):
        ideal.autopilot.arming.arm()
        assert ideal.autopilot.set_mode(Mode.MISSION).accepted
        assert ideal.fly() == [*LOOPED, 6]


@pytest.mark.parametrize("begin", [lambda m: m.start(0), lambda m: m.set_current(0, resets=True) and m.start()])
def test_broken_off_and_started_from_its_first_item_it_begins_anew(ideal, begin):
    ideal.autopilot.missions.start()
    ideal.fly(until=lambda a: a.mission.current == 5)
    ideal.autopilot.guided.hold()
    begin(ideal.autopilot.missions)
    assert ideal.autopilot.mission.speed == Settings().hover_speed
    assert ideal.fly()[-len(LOOPED) :] == LOOPED


@pytest.mark.parametrize(("at", "flown"), [(2, [2, 3, 1, 2, 3, 1, 2, 3, 4, 5, 6]), (6, [*LOOPED, 6])])
def test_after_a_landing_elsewhere_it_is_resumed_but_not_at_its_last_item(at, flown):
    ideal = Ideal((*LOOP, LAND))
    ideal.autopilot.missions.start()
    ideal.fly(until=lambda a: a.mission.current == at and a.mission.manoeuvre is not None)
    ideal.autopilot.guided.land()
    ideal.p = (*ideal.p[:2], 0.0)
    ideal.autopilot.touched_down(ideal.view())
    ideal.autopilot.reached()
    assert ideal.autopilot.set_mode(Mode.MISSION).accepted
    assert ideal.fly() == flown


def test_resumed_at_its_first_item_within_the_flight_it_goes_on_counting():
    ideal = Ideal((waypoint(2, 0, 3), waypoint(0, 0, 3), replace(JUMP, params=(0.0, 2.0, 0.0, 0.0))))
    ideal.autopilot.missions.start()
    ideal.fly(until=lambda a: a.mission._jumps_left == {2: 0})
    ideal.autopilot.reached()
    ideal.autopilot.guided.hold()
    ideal.autopilot.missions.start()
    assert ideal.fly() == [0, 1, 2]


def test_the_present_item_is_kept_by_a_reset_of_the_counters(ideal):
    ideal.autopilot.missions.start()
    ideal.fly(until=lambda a: a.mission._jumps_left == {3: 0} and a.mission.current == 2)
    ideal.autopilot.reached()
    assert ideal.autopilot.missions.set_current(None, resets=True).accepted
    assert ideal.autopilot.mission.current == 2
    assert ideal.fly() == [2, *(3, 1, 2) * 2, 3, 4, 5]


def test_without_a_reset_a_chosen_item_keeps_the_counters(ideal):
    ideal.autopilot.missions.start()
    ideal.fly(until=lambda a: a.mission.current == 5)
    ideal.autopilot.reached()
    ideal.autopilot.missions.set_current(1)
    assert ideal.fly() == [1, 2, 3, 4, 5]


def test_a_reset_lets_a_complete_mission_go_on_at_its_last_item(ideal):
    ideal.autopilot.missions.start()
    ideal.fly()
    assert ideal.autopilot.mission.finished
    assert ideal.autopilot.missions.set_current(None, resets=True).accepted
    assert not ideal.autopilot.mission.finished
    assert ideal.autopilot.mode is Mode.HOLD
    ideal.autopilot.missions.start()
    assert ideal.fly() == [5]


@pytest.mark.parametrize("seq", [6, -2])
def test_an_item_out_of_range_fails(ideal, seq):
    assert ideal.autopilot.missions.set_current(seq) == (FAILED, f"No mission item {seq} (it has 6)")


@pytest.mark.parametrize("go_on", [lambda a: a.missions.start(), lambda a: a.set_mode(Mode.MISSION)])
def test_autocontinue_off_holds_at_the_item_until_the_mission_is_continued(go_on):
    ideal = Ideal((TAKE_OFF, replace(waypoint(2, 0, 3), autocontinue=False), waypoint(0, 0, 3)))
    ideal.autopilot.missions.start()
    assert ideal.fly() == [0, 1]
    assert ideal.autopilot.mode is Mode.HOLD
    assert "Mission paused after item 1: continue to go on" in ideal.texts()
    for _ in range(50):
        ideal.time += 0.1
        assert ideal.autopilot.update(ideal.view()).position == (2.0, 0.0, 3.0)
    assert go_on(ideal.autopilot).accepted
    assert ideal.fly() == [2]


FENCE = make_fence(polygon(((-23.0, -150.0), (-23.0, 150.0), (150.0, 150.0), (150.0, -150.0))), WORLD)
TURNS = item(mavlink.MAV_CMD_NAV_LOITER_TURNS, 0.0, -100.0, 20.0, (1.0, 0.0, 30.0, 0.0))
OUTSIDE = "the 30 m circle of item 1 is partly outside the fence"


@pytest.fixture
def disarmed():
    """A vehicle on the ground whose mission's circle leads out of its fence."""
    autopilot = Autopilot(WORLD, Settings(fence_action=3))
    autopilot.update(VehicleView(0.0, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), 0.0, 0.0, landed=True, battery_remaining=1.0))
    autopilot.missions.load((TAKE_OFF, TURNS))
    autopilot.load_fence(FENCE)
    return autopilot


def test_a_mission_that_would_be_denied_is_denied_before_the_vehicle_is_armed(disarmed):
    answer = disarmed.missions.start()
    assert (answer.result, answer.text) == (DENIED, f"Mission denied: {OUTSIDE}")
    assert disarmed.set_mode(Mode.MISSION).result == DENIED
    assert disarmed.arming.arm().accepted
    assert not disarmed.flying


def test_a_mission_that_waits_for_arming_hinders_it_once_the_fence_forbids_it(disarmed):
    disarmed.load_fence(Fence())
    assert disarmed.missions.start(1).accepted
    assert not disarmed.armed
    disarmed.load_fence(FENCE)
    assert disarmed.arming.failed_checks() == [f"mission denied: {OUTSIDE}"]
    assert not disarmed.arming.arm().accepted
    disarmed.load_fence(Fence())
    assert disarmed.arming.arm().accepted
    assert (disarmed.flying, disarmed.mission.current) == (True, 1)


def test_a_take_off_that_waits_for_arming_hinders_it_once_the_fence_forbids_it(disarmed):
    assert disarmed.guided.take_off(20.0).accepted
    disarmed.configure(Settings(fence_action=3, fence_height=15.0))
    assert disarmed.arming.failed_checks() == ["take-off denied: higher than 15 m above home"]
    assert not disarmed.arming.arm().accepted


@pytest.mark.parametrize(("radius", "denied"), [(15.0, False), (40.0, True)])
def test_a_circle_without_a_radius_is_denied_with_that_of_the_settings(radius, denied):
    turns = replace(TURNS, params=(1.0, 0.0, 0.0, 0.0))
    world = WORLD._replace(fence=FENCE)
    assert (refuse_items((turns,), world, radius) is not None) is denied
    assert refuse_items((turns,), world, 0.0) is None
