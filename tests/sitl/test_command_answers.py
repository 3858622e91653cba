"""Commands that this vehicle answers with words alone: never in silence, never with a guess."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.events import CommandRequested
from protocol.frames import Geodetic, LocalFrame
from sitl.autopilot import commands
from sitl.autopilot.arena import ARENAS
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.mission import World
from sitl.autopilot.settings import Settings


def answer(command, *params):
    autopilot = Autopilot(World(LocalFrame(Geodetic(43.5648, 1.4811, 150.0)), ARENAS["open"]), Settings())
    padded = (*params, *[math.nan] * (7 - len(params)))
    return commands.execute(autopilot, CommandRequested(0, command, padded, None, "peer"))


@pytest.mark.parametrize(
    ("command", "word"),
    [
        (mavlink.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, "terminal"),
        (mavlink.MAV_CMD_DO_FLIGHTTERMINATION, "disarm"),
    ],
)
def test_what_is_not_here_is_unsupported_and_says_what_is(command, word):
    outcome = answer(command, 1.0)
    assert outcome.result == mavlink.MAV_RESULT_UNSUPPORTED
    assert word in outcome.text


def test_an_orbit_on_the_ground_and_an_unknown_standard_mode_are_refused():
    assert not answer(mavlink.MAV_CMD_DO_ORBIT, 40.0).accepted
    assert not answer(mavlink.MAV_CMD_DO_SET_STANDARD_MODE, 99.0).accepted
