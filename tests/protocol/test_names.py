"""Names of numbers on the wire: flight modes, laws, failures, parameters, commands, enumerations of the dialect."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Reason
from protocol.names import (
    COPTER_MODES,
    PLANE_MODES,
    PX4_AUTO_MODES,
    PX4_MAIN_MODES,
    ROVER_MODES,
    SUB_MODES,
    UNSUPPORTED_PX4_MODES,
    Mode,
    cause_words,
    custom_mode,
    law_label,
    law_words,
    mode_from_custom,
    mode_from_parts,
    mode_name,
    reason_words,
)
from sitl.supervisor import guards as g
from sitl.supervisor.table import TABLE


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


def test_the_law_of_a_transition_is_called_as_the_transition():
    assert [law_label(law) for law in (Law.HOVER_LINEAR, Law.TO_FORWARD, Law.TO_HOVER, Law.INDI)] == [
        "hover linear",
        "front transition",
        "back transition",
        "INDI",
    ]
    assert [law_words(name) for name in ("TO_FORWARD", "HOVER_ZERO_MOMENT")] == [
        "front transition",
        "hover zero-moment",
    ]


def test_no_two_laws_have_one_label_and_an_unknown_one_has_its_number():
    assert len({law_label(law) for law in Law}) == len(Law)
    assert (law_label(99), law_words("SOME_LAW")) == ("law 99", "some law")


ARDUPILOT, PX4 = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA, mavlink.MAV_AUTOPILOT_PX4


@pytest.mark.parametrize(
    ("autopilot", "kind", "number", "name"),
    [
        (ARDUPILOT, mavlink.MAV_TYPE_FIXED_WING, 19, "QLOITER"),
        (ARDUPILOT, mavlink.MAV_TYPE_QUADROTOR, 16, "POSHOLD"),
        (ARDUPILOT, mavlink.MAV_TYPE_SUBMARINE, 16, "POSHOLD"),
        (ARDUPILOT, mavlink.MAV_TYPE_ANTENNA_TRACKER, 16, None),
        (PX4, mavlink.MAV_TYPE_QUADROTOR, 4 << 16 | 8 << 24, "FOLLOW_TARGET"),
        (PX4, mavlink.MAV_TYPE_QUADROTOR, 3 << 16 | 1 << 24, "POSCTL"),
        (PX4, mavlink.MAV_TYPE_QUADROTOR, 99 << 16, None),
        (mavlink.MAV_AUTOPILOT_GENERIC, mavlink.MAV_TYPE_QUADROTOR, 1, None),
    ],
)
def test_modes_of_other_autopilots_have_their_names(autopilot, kind, number, name):
    assert mode_name(autopilot, kind, number) == name


def test_mode_names_are_those_of_pymavlink():
    from pymavlink import mavutil

    assert mavutil.mode_mapping_apm == PLANE_MODES
    assert mavutil.mode_mapping_acm == COPTER_MODES
    assert mavutil.mode_mapping_rover == {2: "LEARNING"} | ROVER_MODES  # ArduPilot has it no more
    assert mavutil.mode_mapping_sub | {20: "MOTOR_DETECT", 21: "SURFTRAK"} == SUB_MODES  # newer than pymavlink


def test_px4_mode_names_are_those_of_pymavlink():
    from pymavlink import mavutil

    def names(prefix):
        return {getattr(mavutil, name): name.removeprefix(prefix) for name in dir(mavutil) if name.startswith(prefix)}

    assert names("PX4_CUSTOM_MAIN_MODE_") == PX4_MAIN_MODES
    auto = names("PX4_CUSTOM_SUB_MODE_AUTO_")
    newer = {9: "PRECLAND", 10: "VTOL_TAKEOFF"}
    assert auto | {3: "HOLD"} | newer == {7: "RTGS"} | PX4_AUTO_MODES  # PX4 says HOLD today, and has no RTGS


@pytest.mark.parametrize(
    ("kind", "name"),
    [
        (mavlink.MAV_TYPE_VTOL_DUOROTOR - 1, None),
        (mavlink.MAV_TYPE_VTOL_DUOROTOR, "QHOVER"),
        (mavlink.MAV_TYPE_VTOL_RESERVED5, "QHOVER"),
        (mavlink.MAV_TYPE_VTOL_RESERVED5 + 1, None),
    ],
)
def test_all_kinds_of_vtol_and_no_others_have_the_modes_of_a_plane(kind, name):
    assert mode_name(ARDUPILOT, kind, 18) == name


@pytest.mark.parametrize(
    ("kind", "names"),
    [
        (mavlink.MAV_TYPE_SUBMARINE, {7: "CIRCLE", 8: None, 9: "SURFACE"}),
        (mavlink.MAV_TYPE_GROUND_ROVER, {7: "SIMPLE", 8: "DOCK", 9: "CIRCLE"}),
    ],
)
def test_submarines_and_rovers_have_their_own_numbers(kind, names):
    assert {number: mode_name(ARDUPILOT, kind, number) for number in names} == names


# https://github.com/PX4_AUTOPILOT/PX4_AUTOPILOT-Autopilot/blob/main/src/modules/commander/px4_custom_mode.h
PX4_AUTOPILOT = {
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
    main, sub = PX4_AUTOPILOT[name]
    assert custom_mode(Mode[name]) == main * 0x1_0000 + sub * 0x100_0000
    assert mode_from_parts(main, sub) is Mode[name]
    assert Mode[name].is_auto == (main == 4)


def test_modes_of_px4_that_are_not_flown_are_known_by_name():
    assert UNSUPPORTED_PX4_MODES == {(4, 8): "FOLLOW_TARGET", (4, 9): "PRECISION_LAND", (8, 0): "RATTITUDE"}
    assert all(mode_from_parts(*parts) is None for parts in UNSUPPORTED_PX4_MODES)


def test_an_unknown_sub_mode_is_no_mode_in_auto_and_left_out_elsewhere():
    assert mode_from_parts(4, 0) is None
    assert mode_from_parts(1, 3) is Mode.MANUAL


def test_the_cause_of_a_jump_names_the_wind_where_the_vehicle_waits_for_its_end():
    for source, jumps in TABLE.items():
        for jump in jumps:
            waits = jump.reason == Reason.LYAPUNOV_BELOW and g.wind_calm in jump.when
            words = cause_words(source.name, jump.target.name, jump.reason.name)
            assert (f"wind below {g.CALM_WIND:g} m/s, V below threshold" == words) == waits
    assert cause_words("INDI", "HOVER_LINEAR", "COMMAND") == reason_words("COMMAND")
