"""The ranges of commands, and what follows from the frame."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.ranges import COMMAND_RANGES, command_ranges, refuse_command

HOME, MOVE = mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT
GLOBAL, LOCAL = mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_LOCAL_ENU


def fine(command):
    """Parameters that a command may have."""
    return [(allowed.also or (max(allowed.minimum, 0.0),))[0] for allowed in command_ranges(command, None)]


@pytest.mark.parametrize("command", [*sorted(set(COMMAND_RANGES) - {510, 511, 512}), 31010])
@pytest.mark.parametrize("number", range(1, 8))
@pytest.mark.parametrize("value", [math.inf, -math.inf, 3.5e38])
def test_no_parameter_of_any_command_is_infinite(command, number, value):
    params = fine(command)
    assert refuse_command(command, None, tuple(params)) == ""
    params[number - 1] = value
    assert f" denied: param{number} is {value:g}, not " in refuse_command(command, None, tuple(params))


def test_a_place_is_of_the_globe_unless_its_frame_is_local():
    place = (1.0, 0.0, 0.0, 0.0, 500.0, 20.0, 3.0)
    assert "param5 is 500, not a number from -90 to 90 deg (latitude)" in refuse_command(MOVE, None, place)
    assert "param5 is 500" in refuse_command(MOVE, GLOBAL, place)
    assert refuse_command(MOVE, LOCAL, place) == ""


def test_a_refusal_calls_the_command_by_its_name():
    infinite = (math.inf,) * 7
    assert refuse_command(HOME, None, infinite).startswith("Home denied: param1 is inf, not 0 or 1 (here)")
    assert refuse_command(31010, None, infinite).startswith("USER_1 denied: ")
    assert refuse_command(65000, None, infinite).startswith("Command 65000 denied: ")
