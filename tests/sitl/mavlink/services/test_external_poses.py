"""The three messages in which peers send poses say the same, in the vehicle's frames."""

import math

import pytest

from protocol.dialect import mavlink
from protocol.frames import euler_from_quaternion
from protocol.plans.plan import Refusal
from sitl.mavlink.services.peer_inputs import pose_of
from sitl.mavlink.telemetry.navigation import attitude_on_wire
from sitl.model.quaternions import from_euler

PLACE, WIRE_PLACE = (1.0, 2.0, 3.0), (1.0, -2.0, -3.0)
Q = from_euler(0.2, -1.4, 0.7)  # nearly nose up
WIRE_Q = attitude_on_wire(Q)
NO_COVARIANCE = [math.nan] * 21
COVARIANCE = [0.0] * 21
COVARIANCE[0], COVARIANCE[6], COVARIANCE[11] = 1e-4, 4e-4, 2e-4
COVARIANCE[15], COVARIANCE[18], COVARIANCE[20] = 1e-5, 1e-5, 3e-5
STAMP = 12_345_678


def odometry(covariance, q=WIRE_Q):
    return mavlink.MAVLink_odometry_message(
        STAMP, mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_BODY_FRD, *WIRE_PLACE, list(q), *[0.0] * 6, covariance,
        NO_COVARIANCE,
    )  # fmt: skip


def vision(covariance):
    angles = euler_from_quaternion(WIRE_Q)
    return mavlink.MAVLink_vision_position_estimate_message(STAMP, *WIRE_PLACE, *angles, covariance)


def mocap(covariance):
    return mavlink.MAVLink_att_pos_mocap_message(STAMP, list(WIRE_Q), *WIRE_PLACE, covariance)


KINDS = pytest.mark.parametrize("make", [odometry, vision, mocap], ids=lambda make: make.__name__)


@KINDS
def test_position_and_attitude_come_into_the_vehicle_s_frames(make):
    pose = pose_of(make(NO_COVARIANCE))
    assert pose.position == pytest.approx(PLACE)
    assert abs(sum(a * b for a, b in zip(pose.attitude, Q, strict=True))) == pytest.approx(1.0, abs=1e-9)
    assert pose.time_stamp == pytest.approx(12.345678)


@KINDS
def test_the_worst_axis_s_variance_counts_and_an_unknown_one_is_not_told(make):
    told = pose_of(make(COVARIANCE))
    assert (told.position_variance, told.attitude_variance) == (4e-4, 3e-5)
    for unknown in (NO_COVARIANCE, [0.0] * 21):
        pose = pose_of(make(unknown))
        assert (pose.position_variance, pose.attitude_variance) == (None, None)


def test_a_quaternion_is_normalised():
    pose = pose_of(odometry(NO_COVARIANCE, q=[1.05 * part for part in WIRE_Q]))
    assert math.hypot(*pose.attitude) == pytest.approx(1.0, abs=1e-12)
    long = odometry(NO_COVARIANCE, q=[1.2 * part for part in WIRE_Q])
    assert pose_of(long) == Refusal("quaternion has norm 1.20, not 1")


@KINDS
def test_what_is_not_a_number_is_refused(make):
    message = make(NO_COVARIANCE)
    message.y = math.nan
    assert pose_of(message) == Refusal("not a number")
