"""Names of flight modes of several autopilots."""

import pytest

from protocol.dialect import mavlink
from protocol.names import COPTER_MODES, PLANE_MODES, PX4_AUTO_MODES, PX4_MAIN_MODES, ROVER_MODES, SUB_MODES, mode_name

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
