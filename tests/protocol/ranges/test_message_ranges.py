"""The ranges of set-points and sticks: every field that the vehicle reads has one."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.ranges import MESSAGE_RANGES, message_flaw

FIELDS = [(message, field) for message, fields in MESSAGE_RANGES.items() for field in fields]


@pytest.mark.parametrize(("message", "field"), FIELDS)
@pytest.mark.parametrize("value", [math.inf, -math.inf, 3.5e38])
def test_no_field_is_infinite(message, field, value):
    assert message_flaw(message, {field: value}).startswith(f"{field} is {value:g}, not ")


@pytest.mark.parametrize(("message", "field"), FIELDS)
def test_each_is_a_field_of_its_message(message, field):
    kinds = {known.msgname: known for known in mavlink.mavlink_map.values()}
    assert field.partition("[")[0] in kinds[message].fieldnames


def test_an_axis_that_the_sender_does_not_have_is_no_flaw():
    assert message_flaw("MANUAL_CONTROL", {"x": 0x7FFF, "z": 0}) == ""
    assert message_flaw("MANUAL_CONTROL", {"x": -1001}) == (
        "x is -1001, not 32767 or a whole number from -1000 to 1000"
    )
