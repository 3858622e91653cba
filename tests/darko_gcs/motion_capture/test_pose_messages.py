"""The three messages of a pose say the same."""

import math

import pytest

from darko_gcs.motion_capture.poses import MESSAGE_MAKERS, Pose, PoseAccuracy, TrackedPose
from protocol.dialect import mavlink
from protocol.frames import quaternion_from_euler, rotate
from protocol.wire.codec import Codec
from sitl.mavlink.services.peer_inputs import pose_of

ANGLES = (0.1, -0.3, 2.0)
Q = quaternion_from_euler(*ANGLES)
TRACKED = TrackedPose(5.0, Pose((1.0, -2.0, -3.0), Q), (0.5, 0.4, -0.3), 0.0, 3)
ACCURACY = PoseAccuracy(0.002, 0.02)
STAMP = 7_000_001


def sent(name, tracked=TRACKED, accuracy=ACCURACY):
    """The message as it arrives."""
    return Codec(1, 1).decode(Codec(1, 197).encode(MESSAGE_MAKERS[name](tracked, STAMP, accuracy)))[0]


@pytest.mark.parametrize("name", MESSAGE_MAKERS)
def test_the_vehicle_reads_the_same_pose_from_each(name):
    pose = pose_of(sent(name), in_arena=True)
    assert pose.position == pytest.approx((1.0, 2.0, 3.0))
    assert pose.position_variance == pytest.approx(4e-6)
    assert pose.attitude_variance == pytest.approx(4e-4)
    assert pose.time_stamp == pytest.approx(7.000001)
    assert pose.attitude == pytest.approx(pose_of(sent("mocap")).attitude, abs=1e-6)


def test_odometry_has_frames_velocity_in_the_body_estimator_and_resets():
    message = sent("odometry")
    assert (message.frame_id, message.child_frame_id) == (mavlink.MAV_FRAME_LOCAL_FRD, mavlink.MAV_FRAME_BODY_FRD)
    assert rotate(Q, (message.vx, message.vy, message.vz)) == pytest.approx(TRACKED.velocity, abs=1e-6)
    assert (message.estimator_type, message.reset_counter) == (mavlink.MAV_ESTIMATOR_TYPE_MOCAP, 3)
    assert math.isnan(message.rollspeed)


def test_an_unknown_velocity_is_not_told():
    message = sent("odometry", TRACKED._replace(velocity=None))
    assert all(map(math.isnan, (message.vx, message.vy, message.vz, *message.velocity_covariance)))


def test_vision_has_angles_and_resets():
    message = sent("vision")
    assert (message.roll, message.pitch, message.yaw) == pytest.approx(ANGLES)
    assert message.reset_counter == 3


def test_the_reset_counter_goes_round():
    assert sent("odometry", TRACKED._replace(resets=258)).reset_counter == 2


@pytest.mark.parametrize(("error", "quality", "deviation"), [(0.0, 100, 0.002), (0.01, 50, 0.01), (0.5, 1, 0.5)])
def test_markers_that_do_not_fit_lower_the_quality_and_raise_the_variance(error, quality, deviation):
    message = sent("odometry", TRACKED._replace(marker_error=error))
    assert message.quality == quality
    assert message.pose_covariance[0] == pytest.approx(deviation**2)
