"""The custom modes of PX4, number by number: stations show a mode by its number alone."""

import pytest

from protocol.names import UNSUPPORTED_PX4_MODES, Mode, custom_mode, mode_from_parts

# https://github.com/PX4/PX4-Autopilot/blob/main/src/modules/commander/px4_custom_mode.h
PX4 = {
    "MANUAL": (1, 0),
    "ALTCTL": (2, 0),
    "POSCTL": (3, 0),
    "READY": (4, 1),
    "TAKEOFF": (4, 2),
    "HOLD": (4, 3),
    "MISSION": (4, 4),
    "RTL": (4, 5),
    "LAND": (4, 6),
    "FLIGHT_PLAN": (4, 11),  # EXTERNAL1
    "ACRO": (5, 0),
    "OFFBOARD": (6, 0),
    "STABILIZED": (7, 0),
}


@pytest.mark.parametrize("name", [mode.name for mode in Mode])
def test_each_mode_has_the_number_of_px4(name):
    main, sub = PX4[name]
    assert custom_mode(Mode[name]) == main * 0x1_0000 + sub * 0x100_0000
    assert mode_from_parts(main, sub) is Mode[name]
    assert Mode[name].is_auto == (main == 4)


def test_modes_of_px4_that_are_not_flown_are_known_by_name():
    assert UNSUPPORTED_PX4_MODES == {(4, 8): "FOLLOW_TARGET", (4, 9): "PRECISION_LAND", (8, 0): "RATTITUDE"}
    assert all(mode_from_parts(*parts) is None for parts in UNSUPPORTED_PX4_MODES)


def test_an_unknown_sub_mode_is_no_mode_in_auto_and_left_out_elsewhere():
    assert mode_from_parts(4, 0) is None
    assert mode_from_parts(1, 3) is Mode.MANUAL
