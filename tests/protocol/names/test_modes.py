"""Custom modes are those of PX4."""

import math

import pytest

from protocol.names import Mode, custom_mode, mode_from_custom, mode_from_parts


@pytest.mark.parametrize("mode", list(Mode))
def test_every_mode_survives_the_wire(mode):
    assert mode_from_custom(custom_mode(mode)) is mode
    assert mode_from_parts(*mode.value) is mode


def test_the_custom_modes_are_those_of_px4():
    assert custom_mode(Mode.HOLD) == 50593792  # AUTO, LOITER
    assert custom_mode(Mode.OFFBOARD) == 6 << 16


def test_unknown_custom_modes_are_no_mode():
    assert mode_from_custom(12345) is None
    assert mode_from_parts(4, 99) is None
    assert mode_from_parts(math.nan, math.nan) is None


def test_the_sub_mode_matters_in_auto_only():
    assert mode_from_parts(6, math.nan) is Mode.OFFBOARD
    assert mode_from_parts(3, 7) is Mode.POSCTL
    assert mode_from_parts(4, math.nan) is None
