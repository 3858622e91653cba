"""Ranges of the numbers that peers send, as this project's vehicle takes them."""

import itertools
import math
import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from protocol.dialect import mavlink
from protocol.ranges import (
    ANY_NUMBER,
    COMMAND_RANGES,
    ITEM_RANGES,
    MAX_FLOAT32,
    MESSAGE_RANGES,
    command_ranges,
    finite,
    first_flaw,
    item_flaw,
    item_ranges,
    message_flaw,
    one_of,
    refuse_command,
    whole,
)

SPEED = finite("speed", 0.1, 22.0, "m/s", also=(-1.0,), default=False)
COUNT = whole("repeat count", 0, 65535, also=(-1.0,))


@pytest.mark.parametrize("value", [0.1, 22.0, -1.0, struct.unpack("<f", struct.pack("<f", 0.1))[0]])
def test_limits_belong_to_a_range_also_as_the_wire_rounds_them(value):
    assert SPEED.allows(value)


@pytest.mark.parametrize("value", [0.0, 0.099, 22.001, -2.0, math.inf, -math.inf, math.nan, 1e38, 1e-45])
def test_what_is_out_of_a_range_is_not_allowed(value):
    assert not SPEED.allows(value)


@pytest.mark.parametrize(
    ("value", "allowed"), [(0, True), (65535, True), (-1, True), (1.5, False), (-2, False), (-0.0, False)]
)
def test_a_whole_number_has_no_fraction_and_zero_no_sign(value, allowed):
    assert COUNT.allows(value) is allowed


@given(st.floats())
def test_a_number_without_a_meaning_is_finite_or_left_open(value):
    assert ANY_NUMBER.allows(value) is (math.isnan(value) or abs(value) <= MAX_FLOAT32)


@pytest.mark.parametrize(
    ("allowed", "words"),
    [
        (SPEED, "-1 or a number from 0.1 to 22 m/s"),
        (COUNT, "-1 or a whole number from 0 to 65535"),
        (one_of("VTOL state", 0, 3, 4), "0, 3 or 4"),
        (one_of("reset", 1), "1"),
        (ANY_NUMBER, "a number that is finite"),
    ],
)
def test_a_range_is_told_in_words(allowed, words):
    assert allowed.words == words


def test_a_flaw_names_the_parameter_its_value_and_what_is_allowed():
    flaw = first_flaw((ANY_NUMBER, COUNT), (math.nan, math.inf))
    assert flaw == (2, "param2 is inf, not -1 or a whole number from 0 to 65535 (repeat count)")


OPEN = (math.nan,) * 7
ITEM_FRAME, MISSION = mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_MISSION


@pytest.mark.parametrize("command", ITEM_RANGES)
def test_no_parameter_of_any_item_is_infinite(command):
    for number, value in itertools.product(range(7), (math.inf, -math.inf)):
        values = tuple(value if k == number else (r.also or (max(r.minimum, 0.0),))[0] for k, r in _ranges(command))
        flaw = item_flaw(command, ITEM_FRAME, values)
        assert flaw is not None, (number, value)
        assert flaw.number == number + 1
        assert f"param{number + 1} is " in flaw.text


def _ranges(command):
    return list(enumerate(item_ranges(command, ITEM_FRAME)))


def test_latitude_and_longitude_are_such_in_every_item_with_a_global_frame():
    jump = (0.0, 1.0, 0.0, 0.0, 91.0, 0.0, 0.0)
    assert item_flaw(mavlink.MAV_CMD_DO_JUMP, ITEM_FRAME, jump).number == 5
    assert item_flaw(mavlink.MAV_CMD_DO_JUMP, MISSION, jump) is None


def test_an_item_in_a_frame_without_a_position_has_no_altitude():
    assert item_flaw(mavlink.MAV_CMD_NAV_LAND, MISSION, OPEN) is None
    assert item_flaw(mavlink.MAV_CMD_NAV_LAND, ITEM_FRAME, OPEN).number == 7


def test_a_command_without_a_row_may_have_any_finite_numbers():
    command = mavlink.MAV_CMD_DO_SET_SERVO
    assert command not in ITEM_RANGES
    assert item_flaw(command, MISSION, (1e38,) * 7) is None
    assert item_flaw(command, MISSION, (1.0, math.inf, *OPEN[2:])).number == 2


HOME, MOVE = mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DARKO_MOVE_WAYPOINT
GLOBAL, LOCAL = mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_LOCAL_ENU


def fine(command):
    """Parameters that a command may have."""
    return [(allowed.also or (max(allowed.minimum, 0.0),))[0] for allowed in command_ranges(command, None)]


@pytest.mark.parametrize("command", [*sorted(set(COMMAND_RANGES) - {510, 511, 512}), 31010])
def test_no_parameter_of_any_command_is_infinite(command):
    assert refuse_command(command, None, tuple(fine(command))) == ""
    for number, value in itertools.product(range(1, 8), (math.inf, -math.inf, 3.5e38)):
        params = fine(command)
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


@pytest.mark.parametrize("message", MESSAGE_RANGES)
def test_no_field_is_infinite(message):
    for field, value in itertools.product(MESSAGE_RANGES[message], (math.inf, -math.inf, 3.5e38)):
        assert message_flaw(message, {field: value}).startswith(f"{field} is {value:g}, not ")


@pytest.mark.parametrize("message", MESSAGE_RANGES)
def test_each_is_a_field_of_its_message(message):
    kinds = {known.msgname: known for known in mavlink.mavlink_map.values()}
    assert {field.partition("[")[0] for field in MESSAGE_RANGES[message]} <= set(kinds[message].fieldnames)


def test_an_axis_that_the_sender_does_not_have_is_no_flaw():
    assert message_flaw("MANUAL_CONTROL", {"x": 0x7FFF, "z": 0}) == ""
    assert message_flaw("MANUAL_CONTROL", {"x": -1001}) == (
        "x is -1001, not 32767 or a whole number from -1000 to 1000"
    )
