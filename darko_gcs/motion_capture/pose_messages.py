"""The MAVLink messages that carry a pose.

https://mavlink.io/en/messages/common.html#ODOMETRY
https://mavlink.io/en/messages/common.html#VISION_POSITION_ESTIMATE
https://mavlink.io/en/messages/common.html#ATT_POS_MOCAP
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from darko_gcs.motion_capture.pose_track import SAMPLES, TrackedPose
from protocol.dialect import mavlink
from protocol.frames import COVARIANCE_DIAGONAL, COVARIANCE_SIZE, euler_from_quaternion, rotate
from protocol.wire.message import Message

ESTIMATORS = {
    "mocap": mavlink.MAV_ESTIMATOR_TYPE_MOCAP,
    "vision": mavlink.MAV_ESTIMATOR_TYPE_VISION,
    "vio": mavlink.MAV_ESTIMATOR_TYPE_VIO,
}
"""What ODOMETRY says that its sender is."""
WORST_MARKER_ERROR = 0.02  # at which the quality is least [m]
FRAME_TIME = 0.005  # between frames, for the velocity's variance where one sample tells none [s]


class PoseAccuracy(NamedTuple):
    """Accuracy and estimator type that the pose messages state."""

    position: float = 0.001  # standard deviation of each axis, at least [m]
    attitude: float = 0.01  # [rad]
    estimator: int = mavlink.MAV_ESTIMATOR_TYPE_MOCAP


Maker = Callable[[TrackedPose, int, PoseAccuracy], Message]


def odometry(tracked: TrackedPose, stamp: int, accuracy: PoseAccuracy) -> Message:
    """ODOMETRY: pose in LOCAL_FRD, velocity in BODY_FRD, with variances, quality and resets."""
    w, x, y, z = tracked.pose.attitude
    unknown = (math.nan,) * 3
    velocity = unknown if tracked.velocity is None else rotate((w, -x, -y, -z), tracked.velocity)
    north, east, down = tracked.pose.position
    return mavlink.MAVLink_odometry_message(
        time_usec=stamp,
        frame_id=mavlink.MAV_FRAME_LOCAL_FRD,
        child_frame_id=mavlink.MAV_FRAME_BODY_FRD,
        x=north,
        y=east,
        z=down,
        q=list(tracked.pose.attitude),
        **dict(zip(("vx", "vy", "vz"), velocity, strict=True)),
        **dict(zip(("rollspeed", "pitchspeed", "yawspeed"), unknown, strict=True)),
        pose_covariance=_covariance(tracked, accuracy),
        velocity_covariance=_velocity_covariance(tracked, accuracy),
        reset_counter=tracked.resets % 256,
        estimator_type=accuracy.estimator,
        quality=_quality(tracked.marker_error),
    )


def vision_position_estimate(tracked: TrackedPose, stamp: int, accuracy: PoseAccuracy) -> Message:
    """VISION_POSITION_ESTIMATE: the attitude as angles, which have no unique values at a pitch of 90 degrees."""
    north, east, down = tracked.pose.position
    roll, pitch, yaw = euler_from_quaternion(tracked.pose.attitude)
    return mavlink.MAVLink_vision_position_estimate_message(
        usec=stamp,
        x=north,
        y=east,
        z=down,
        roll=roll,
        pitch=pitch,
        yaw=yaw,
        covariance=_covariance(tracked, accuracy),
        reset_counter=tracked.resets % 256,
    )


def att_pos_mocap(tracked: TrackedPose, stamp: int, accuracy: PoseAccuracy) -> Message:
    """ATT_POS_MOCAP: the pose alone, with variances."""
    north, east, down = tracked.pose.position
    return mavlink.MAVLink_att_pos_mocap_message(
        time_usec=stamp,
        q=list(tracked.pose.attitude),
        x=north,
        y=east,
        z=down,
        covariance=_covariance(tracked, accuracy),
    )


MESSAGE_MAKERS: Mapping[str, Maker] = MappingProxyType(
    {"odometry": odometry, "vision": vision_position_estimate, "mocap": att_pos_mocap}
)
"""By the names of the command line."""


def _place_deviation(tracked: TrackedPose, accuracy: PoseAccuracy) -> float:
    """As large as the markers are off, if that is more."""
    return max(accuracy.position, tracked.marker_error)


def _covariance(tracked: TrackedPose, accuracy: PoseAccuracy) -> list[float]:
    return _diagonal(_place_deviation(tracked, accuracy) ** 2, accuracy.attitude**2)


def _velocity_covariance(tracked: TrackedPose, accuracy: PoseAccuracy) -> list[float]:
    """Of the difference of two positions over the samples between; nothing is told of the rates."""
    if tracked.velocity is None:
        return [math.nan] * COVARIANCE_SIZE
    deviation = math.sqrt(2.0) * _place_deviation(tracked, accuracy) / ((SAMPLES - 1) * FRAME_TIME)
    return _diagonal(deviation**2, math.nan)


def _diagonal(first: float, second: float) -> list[float]:
    values = [0.0] * COVARIANCE_SIZE
    for k, place in enumerate(COVARIANCE_DIAGONAL):
        values[place] = first if k < 3 else second
    return values


def _quality(marker_error: float) -> int:
    """From 1 to 100 per cent; 0 would be unknown."""
    return max(1, round(100.0 * (1.0 - min(marker_error / WORST_MARKER_ERROR, 1.0))))
