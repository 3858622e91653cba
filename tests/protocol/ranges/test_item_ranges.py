"""The ranges of plan items, and what follows from the frame."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.ranges import ITEM_RANGES, item_flaw, item_ranges

OPEN = (math.nan,) * 7
GLOBAL, MISSION = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_MISSION


@pytest.mark.parametrize("command", ITEM_RANGES)
@pytest.mark.parametrize("number", range(7))
@pytest.mark.parametrize("value", [math.inf, -math.inf])
def test_no_parameter_of_any_item_is_infinite(command, number, value):
    values = tuple(value if k == number else (r.also or (max(r.minimum, 0.0),))[0] for k, r in _ranges(command))
    flaw = item_flaw(command, GLOBAL, values)
    assert flaw is not None
    assert flaw.number == number + 1
    assert f"param{number + 1} is " in flaw.text


def _ranges(command):
    return list(enumerate(item_ranges(command, GLOBAL)))


def test_latitude_and_longitude_are_such_in_every_item_with_a_global_frame():
    jump = (0.0, 1.0, 0.0, 0.0, 91.0, 0.0, 0.0)
    assert item_flaw(mavlink.MAV_CMD_DO_JUMP, GLOBAL, jump).number == 5
    assert item_flaw(mavlink.MAV_CMD_DO_JUMP, MISSION, jump) is None


def test_an_item_in_a_frame_without_a_position_has_no_altitude():
    assert item_flaw(mavlink.MAV_CMD_NAV_LAND, MISSION, OPEN) is None
    assert item_flaw(mavlink.MAV_CMD_NAV_LAND, GLOBAL, OPEN).number == 7


def test_a_command_without_a_row_may_have_any_finite_numbers():
    command = mavlink.MAV_CMD_DO_SET_SERVO
    assert command not in ITEM_RANGES
    assert item_flaw(command, MISSION, (1e38,) * 7) is None
    assert item_flaw(command, MISSION, (1.0, math.inf, *OPEN[2:])).number == 2
