"""Arming and disarming: the checks, what waits for arming, and that a vehicle in the air stays armed."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.modes import Mode
from sitl.autopilot.answers import ACCEPTED
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.safety.arena import ARENAS
from sitl.autopilot.safety.world import World
from sitl.autopilot.settings import Settings
from sitl.defaults import HOME
from sitl.guidance.view import VehicleView

DENIED = mavlink.MAV_RESULT_DENIED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED


def view(**changed):
    """A vehicle that stands at rest."""
    still = (0.0, 0.0, 0.0)
    standing = VehicleView(time=0.0, p=still, v=still, heading=0.0, tilt=0.0, landed=True, battery_left=1.0)
    return standing._replace(**changed)


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
        (view(battery_left=0.05), "battery"),
    ],
)
def test_each_failed_check_refuses_arming_with_its_reason(autopilot, seen, word):
    autopilot.update(seen)
    answer = autopilot.arming.arm()
    assert answer.result == REJECTED
    assert word in answer.text
    assert not autopilot.armed
    assert autopilot.arming.arm(force=True).result == ACCEPTED


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
