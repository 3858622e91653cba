"""Attitudes of all kinds of vehicles as the station understands them: x along the nose, and what to show."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import (
    SHOW_AS_TOLD,
    SHOW_PITCHED_DOWN,
    SHOW_PITCHED_UP,
    displayed,
    euler_from_quaternion,
    quaternion_from_euler,
)
from tests.support.gcs.home import snapshot_after
from tests.support.gcs.messages import heartbeat

NOTHING = (0.0, 0.0, 0.0, 0.0)
UPRIGHT = (0.0, math.pi / 2.0, 0.0)
TAIL_SITTER, COPTER = mavlink.MAV_TYPE_VTOL_DUOROTOR, mavlink.MAV_TYPE_QUADROTOR
ARDUPILOT = mavlink.MAV_AUTOPILOT_ARDUPILOTMEGA


def quaternion(angles, offset):
    q1, q2, q3, q4 = quaternion_from_euler(*angles)
    return mavlink.MAVLink_attitude_quaternion_message(10, q1, q2, q3, q4, 0, 0, 0, list(offset))


def attitude(angles):
    return mavlink.MAVLink_attitude_message(10, *angles, 0, 0, 0)


def shown(s):
    return euler_from_quaternion(displayed(s.attitude.q, s.attitude.repr_offset))


def close(angles, tolerance=1e-4):
    return pytest.approx(angles, abs=tolerance)


@pytest.mark.parametrize("offset", [SHOW_AS_TOLD, NOTHING])  # PX4 sends zeros in hover
@pytest.mark.parametrize("yaw", [0.0, 1.0, 4.0])
def test_a_tail_sitter_in_hover_is_level_with_its_nose_up(offset, yaw):
    s = snapshot_after(heartbeat(), quaternion((0.1, 0.0, yaw), offset))
    assert shown(s) == close((0.1, 0.0, math.remainder(yaw, math.tau)))
    assert s.attitude.heading == pytest.approx(yaw, abs=0.02)
    assert s.attitude.repr_offset == pytest.approx(SHOW_PITCHED_DOWN)


@pytest.mark.parametrize("offset", [SHOW_PITCHED_UP, (0.7071, 0.0, 0.7071, 0.0)])
def test_a_tail_sitter_in_forward_flight_is_shown_along_its_nose(offset):
    s = snapshot_after(heartbeat(), quaternion((0.0, -math.pi / 2.0 + 0.1, 2.0), offset))
    assert euler_from_quaternion(s.attitude.q) == close((0.0, 0.1, 2.0))
    assert shown(s) == close((0.0, 0.1, 2.0))
    assert s.attitude.heading == pytest.approx(2.0)


def test_an_older_log_of_ours_tells_the_frame_of_forward_flight_and_is_shown_as_before():
    s = snapshot_after(heartbeat(), quaternion(UPRIGHT, SHOW_PITCHED_DOWN))
    assert euler_from_quaternion(s.attitude.q) == close(UPRIGHT, 1e-3)
    assert shown(s) == close((0.0, 0.0, 0.0))


@pytest.mark.parametrize(
    ("kind", "autopilot"),
    [(COPTER, mavlink.MAV_AUTOPILOT_PX4), (COPTER, ARDUPILOT), (TAIL_SITTER, ARDUPILOT)],
)
def test_other_vehicles_are_taken_and_shown_as_told(kind, autopilot):
    angles = (0.1, 0.2, 0.3)
    for message in (quaternion(angles, NOTHING), attitude(angles)):
        s = snapshot_after(heartbeat(kind=kind, autopilot=autopilot), message)
        assert euler_from_quaternion(s.attitude.q) == close(angles)
        assert s.attitude.heading == pytest.approx(0.3, abs=0.02)


def test_without_quaternions_a_tail_sitters_angles_are_of_the_hover_frame_too():
    s = snapshot_after(heartbeat(), attitude((0.0, 0.0, 1.5)))
    assert s.attitude.heading == pytest.approx(1.5)
    assert euler_from_quaternion(s.attitude.q)[1] == close(math.pi / 2.0, 1e-3)
    assert s.attitude.repr_offset is None
