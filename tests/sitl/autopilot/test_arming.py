"""Arming and disarming: the checks, what waits for arming, and that a vehicle in the air stays armed."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import Mode
from sitl.autopilot.answers import ACCEPTED
from sitl.autopilot.arming import ALIGNMENT_TEXTS, LYING_TILT, MAX_STANDING_TILT, ROCKING_TIME
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import ARENAS, World
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView
from sitl.model.ground import Crash
from sitl.model.vectors import Vector

DENIED = mavlink.MAV_RESULT_DENIED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def view(**changed):
    """A vehicle that stands at rest."""
    still = (0.0, 0.0, 0.0)
    standing = VehicleView(time=0.0, p=still, v=still, heading=0.0, tilt=0.0, landed=True, battery_remaining=1.0)
    return standing._replace(**changed)


UNALIGNED = view(aligned=False, awaited=("aligning: keep still",), tilt=1.0)
HIT = Crash(7.26, Vector(12.4, -2.6, 0.1))


@pytest.fixture
def autopilot():
    autopilot = Autopilot(World(LocalFrame(HOME), ARENAS["open"]), Settings())
    autopilot.update(view())
    return autopilot


@pytest.mark.parametrize(
    ("seen", "word"),
    [
        (view(landed=False, p=(0.0, 0.0, 4.0)), "not on the ground"),
        (view(tilt=math.radians(80.0)), "not upright"),
        (view(v=(0.0, 1.0, 0.0)), "moving"),
        (view(battery_remaining=0.05), "battery"),
        (view(awaited=("waiting for satellites",)), "waiting for satellites"),
    ],
)
def test_each_failed_check_refuses_arming_with_its_reason(autopilot, seen, word):
    autopilot.update(seen)
    answer = autopilot.arming.arm()
    assert answer.result == REJECTED
    assert word in answer.text
    assert not autopilot.armed
    assert autopilot.arming.arm(force=True).result == ACCEPTED


@pytest.mark.parametrize("force", [False, True])
def test_a_vehicle_that_is_not_aligned_is_not_armed_by_force_either(autopilot, force):
    autopilot.update(UNALIGNED)
    answer = autopilot.arming.arm(force=force)
    assert answer == (REJECTED, "Arming refused: aligning: keep still")  # of a tilt nothing is known yet
    autopilot.update(view())
    assert autopilot.arming.arm(force=force).accepted


def test_alignment_is_reported_once_each_way(autopilot):
    autopilot.notices()
    for seen in (UNALIGNED, UNALIGNED, view(), view()):
        autopilot.update(seen)
    assert [notice.text for notice in autopilot.notices()] == list(ALIGNMENT_TEXTS.values())


def test_take_off_waits_for_arming(autopilot):
    assert autopilot.guided.take_off(3.0).result == ACCEPTED
    assert not autopilot.flying
    assert autopilot.arming.arm().result == ACCEPTED
    assert autopilot.flying
    assert autopilot.mode is Mode.TAKEOFF


def test_disarming_in_the_air_is_denied_unless_forced(autopilot):
    autopilot.arming.arm()
    autopilot.guided.take_off(3.0)
    autopilot.update(view(p=(0.0, 0.0, 3.0), landed=False))
    assert autopilot.arming.disarm().result == DENIED
    assert autopilot.armed
    assert autopilot.arming.disarm(force=True).result == ACCEPTED
    assert not autopilot.armed


def texts(autopilot):
    return [(notice.severity, notice.text) for notice in autopilot.notices()]


def test_a_crash_is_said_with_speed_and_place_and_ends_the_flight_until_a_reboot(autopilot):
    assert autopilot.arming.arm().result == ACCEPTED
    autopilot.guided.take_off(5.0)
    autopilot.notices()
    autopilot.crashed(view(tilt=1.5, crash=HIT))
    assert texts(autopilot) == [(mavlink.MAV_SEVERITY_CRITICAL, "Crashed at 7.3 m/s, 12 m north 3 m east of home")]
    assert not autopilot.armed
    assert not autopilot.flying
    for force in (False, True):
        answer = autopilot.arming.arm(force=force)
        assert answer.result == REJECTED
        assert answer.text == "Arming refused: crashed at 7.3 m/s: a reboot stands it up again"


def test_the_place_of_a_crash_is_told_from_home(autopilot):
    autopilot.relocate(autopilot.world.frame, (20.0, -30.0, 0.0))
    autopilot.crashed(view(crash=HIT))
    assert texts(autopilot)[0][1] == "Crashed at 7.3 m/s, 8 m south 27 m west of home"


@pytest.fixture
def landing(autopilot):
    """About to touch the ground."""
    autopilot.arming.arm()
    autopilot.guided.take_off(5.0)
    autopilot.update(view(landed=False, p=(0.0, 0.0, 2.0)))
    autopilot.guided.land()
    autopilot.update(view(landed=False, p=(0.0, 0.0, 0.1)))
    autopilot.notices()
    return autopilot


@pytest.mark.parametrize(
    "seen",
    [
        view(time=0.1, tilt=LYING_TILT + 0.01),  # it lies at once
        view(time=ROCKING_TIME + 0.1, tilt=MAX_STANDING_TILT + 0.01),  # it leans on something
    ],
)
def test_a_vehicle_that_falls_over_is_not_said_to_have_landed(landing, seen):
    landing.touched_down(view(time=0.05, tilt=0.2))
    landing.update(view(time=0.06, tilt=0.3))
    assert texts(landing) == []
    landing.update(seen)
    assert texts(landing) == [(mavlink.MAV_SEVERITY_CRITICAL, "Tipped over on landing")]
    assert not landing.armed
    assert "not upright" in landing.arming.arm().text


def test_a_vehicle_that_stands_after_a_while_has_landed(landing):
    landing.touched_down(view(time=0.05, tilt=math.radians(17.0)))  # it touches leaning into the wind
    landing.update(view(time=ROCKING_TIME - 0.1, tilt=0.1))
    assert texts(landing) == []
    landing.update(view(time=ROCKING_TIME + 0.1, tilt=0.1))
    assert texts(landing) == [(mavlink.MAV_SEVERITY_INFO, "Landed")]
    assert landing.armed  # for as long as COM_DISARM_LAND says
    landing.update(view(time=9.0))
    assert texts(landing) == [(mavlink.MAV_SEVERITY_INFO, "Disarmed after landing")]


def test_a_vehicle_that_lies_on_the_ground_without_landing_is_said_to_have_tipped_over(autopilot):
    autopilot.arming.arm()
    autopilot.guided.take_off(5.0)
    autopilot.update(view(landed=False, p=(0.0, 0.0, 0.1)))
    autopilot.notices()
    autopilot.touched_down(view(tilt=math.radians(80.0)))
    assert texts(autopilot) == [(mavlink.MAV_SEVERITY_CRITICAL, "Tipped over on the ground")]
    assert not autopilot.armed


@pytest.mark.parametrize("mode", [Mode.RTL, Mode.LAND])
def test_a_mode_that_ends_on_the_ground_is_chosen_there_but_not_armed_in(autopilot, mode):
    assert autopilot.set_mode(mode).accepted
    assert autopilot.mode is mode
    autopilot.relocate(autopilot.world.frame, (10.0, 0.0, 0.0))
    autopilot.update(view(time=1.0))
    assert (autopilot.mode, autopilot.flying, autopilot.landing) == (mode, False, False)
    assert f"mode {mode.name} ends on the ground" in autopilot.arming.arm().text
    assert autopilot.set_mode(Mode.HOLD).accepted
    assert autopilot.arming.arm().accepted


def test_armed_on_the_ground_they_are_refused(autopilot):
    autopilot.arming.arm()
    for mode in (Mode.RTL, Mode.LAND, Mode.POSCTL):
        assert not autopilot.set_mode(mode).accepted
        assert autopilot.mode is Mode.HOLD


def test_offboard_is_chosen_before_arming_and_begins_with_it(autopilot):
    assert not autopilot.set_mode(Mode.OFFBOARD).accepted
    for x in (3.0, 4.0):  # the last set-point before the start counts
        assert autopilot.offboard.set_position((x, 0.0, 3.0)) is None
        assert autopilot.set_mode(Mode.OFFBOARD).accepted
        assert (autopilot.mode, autopilot.flying) == (Mode.OFFBOARD, False)
    assert autopilot.arming.arm().accepted
    assert (autopilot.mode, autopilot.flying) == (Mode.OFFBOARD, True)
    assert autopilot.manoeuvre.reference.position == (4.0, 0.0, 3.0)


def test_what_cannot_begin_with_arming_any_more_leaves_the_vehicle_holding(autopilot):
    autopilot.offboard.set_position((3.0, 0.0, 3.0))
    autopilot.set_mode(Mode.OFFBOARD)
    autopilot.update(view(time=10.0))  # set-points have stopped
    assert autopilot.arming.arm().accepted
    assert (autopilot.mode, autopilot.flying) == (Mode.HOLD, False)
