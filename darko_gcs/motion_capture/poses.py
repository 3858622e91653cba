"""Poses of a rigid body: from Motive's axes to the vehicle's, its track, and the MAVLink messages that carry it.

The hall is seen by its observers: right, far, up, left, near. Four settings tell how Motive was calibrated and how the
result shall lie:

1. the axis that is up in the stream: y is Motive's own, z if Motive is told so;
2. the side that the long edge of the calibration triangle pointed to: Motive's z axis, or -y if z is up;
3. where x of the result, east, shall point: to a side, or at an angle from the right, anticlockwise seen from above;
4. the side that the vehicle's front pointed to when its rigid body was made: there its quaternion is one. The front of
   a tail-sitter on its tail is its belly.

All are rotations about the vertical after the first one, so their angles add up.

https://mavlink.io/en/messages/common.html#ODOMETRY
https://mavlink.io/en/messages/common.html#VISION_POSITION_ESTIMATE
https://mavlink.io/en/messages/common.html#ATT_POS_MOCAP
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.frames import (
    COVARIANCE_DIAGONAL,
    COVARIANCE_SIZE,
    Quaternion,
    Vector,
    euler_from_quaternion,
    multiply,
    rotate,
)
from protocol.wire.message import Message

HALL_SIDES = {"right": 0.0, "far": 90.0, "left": 180.0, "near": -90.0}  # azimuth from the right, anticlockwise [deg]
NEAR = HALL_SIDES["near"]
_HALF = math.sqrt(0.5)


class AxesSettings(NamedTuple):
    """Axes by which Motive was calibrated, and those of the result."""

    up_axis: str = "z"
    long_edge: str = "near"
    x_angle: float = 0.0  # of east from the right, anticlockwise [deg]
    nose: str = "far"


AXES_OF_LABS = {
    "enac": AxesSettings("z", "near", HALL_SIDES["right"], "far"),
    "delft": AxesSettings("y", "right", HALL_SIDES["right"], "far"),
}


class Pose(NamedTuple):
    """A pose as MAVLink has it."""

    position: Vector  # NED [m]
    attitude: Quaternion  # body FRD to NED


class ArenaAxes:
    """Changes the axes of poses; see the head of this module."""

    def __init__(self, settings: AxesSettings) -> None:
        upright: Quaternion = (_HALF, _HALF, 0.0, 0.0) if settings.up_axis == "y" else (1.0, 0.0, 0.0, 0.0)
        # With z up, the long edge is -y: where it points near, x is to the right already.
        turn = HALL_SIDES[settings.long_edge] - NEAR - settings.x_angle
        self._to_enu = multiply(_about_up(turn), upright)
        # The body's axes are right, front, up here; its front is north where its quaternion is one.
        self._front = _about_up(HALL_SIDES[settings.nose] - settings.x_angle - 90.0)

    def pose(self, position: Vector, attitude: Quaternion) -> Pose:
        """The pose of a rigid body.

        Args:
            position: In Motive's axes [m].
            attitude: Of the rigid body since it was made, in Motive's axes (w, x, y, z).
        """
        east, north, up = rotate(self._to_enu, position)
        w, x, y, z = self._to_enu
        turned = multiply(multiply(self._to_enu, attitude), (w, -x, -y, -z))
        w, x, y, z = multiply(turned, self._front)
        return Pose((north, east, -up), (w, y, x, -z))


def _about_up(degrees: float) -> Quaternion:
    half = math.radians(degrees) / 2.0
    return math.cos(half), 0.0, 0.0, math.sin(half)


MAX_HALL = 1000.0  # no hall is larger: what is farther away, or off by more, was damaged on the way [m]


def is_credible(position: Vector, marker_error: float) -> bool:
    """Whether a rigid body may be where a packet has it; not with numbers that are none."""
    return all(abs(x) <= MAX_HALL for x in (*position, marker_error))


SAMPLES = 4  # of positions, whose differences tell the velocity
MAX_SPAN = 0.2  # of them; with longer gaps the velocity is not told [s]
MAX_SPEED, PLACE_SLACK = 30.0, 0.3  # a body that is faster, and farther than the slack, has jumped [m/s], [m]
MAX_RATE, TURN_SLACK = 20.0, math.radians(25.0)  # [rad/s], [rad]
MAX_GAP = 0.2  # after a longer one no jump can be told from a motion [s]


class TrackedPose(NamedTuple):
    """A pose with what its track tells."""

    time: float  # of the exposure, on the clock that the track is told of [s]
    pose: Pose
    velocity: Vector | None  # NED [m/s]
    marker_error: float  # [m]
    resets: int  # of the track: poses of different ones may not fit together


class PoseTrack:
    """Follows a rigid body.

    Cameras that take markers for one another turn or move the body at once. Such poses are held back until it jumps
    back, or tracking is lost and found.
    """

    def __init__(self) -> None:
        self.resets = 0
        self.is_held = False  # the body has jumped
        self._last: tuple[float, Pose] | None = None
        self._good: tuple[float, Pose] | None = None  # before the jump
        self._places: deque[tuple[float, Vector]] = deque(maxlen=SAMPLES)

    def lose(self) -> None:
        """Tracking is lost, or the server is gone: what comes next is a new track."""
        if self._last is not None:
            self.resets += 1
        self._last = self._good = None
        self.is_held = False
        self._places.clear()

    def follow(self, time: float, pose: Pose, marker_error: float) -> TrackedPose | None:
        """Take a pose; gives it with its velocity, or nothing while the body has jumped or time has not passed."""
        if self._last is not None:
            if time <= self._last[0]:
                return None
            if _has_jumped(self._last, time, pose):
                self._jump(time, pose)
        self._last = (time, pose)
        if self.is_held:
            return None
        self._places.append((time, pose.position))
        return TrackedPose(time, pose, self._velocity(), marker_error, self.resets)

    def _jump(self, time: float, pose: Pose) -> None:
        self._places.clear()
        if not self.is_held:
            self.is_held, self._good = True, self._last
        elif self._good is not None and not _has_jumped(self._good, time, pose, gap=math.inf):
            self.is_held = False

    def _velocity(self) -> Vector | None:
        """Mean of the differences of the last positions."""
        if len(self._places) < SAMPLES:
            return None
        (first, start), (last, end) = self._places[0], self._places[-1]
        if last - first > MAX_SPAN:
            return None
        north, east, down = ((b - a) / (last - first) for a, b in zip(start, end, strict=True))
        return north, east, down


def _has_jumped(before: tuple[float, Pose], time: float, pose: Pose, gap: float = MAX_GAP) -> bool:
    """Whether a pose is too far from an earlier one."""
    elapsed = time - before[0]
    if elapsed > gap:
        return False
    distance = math.dist(before[1].position, pose.position)
    return (
        distance > PLACE_SLACK + MAX_SPEED * elapsed
        or _turn(before[1].attitude, pose.attitude) > TURN_SLACK + MAX_RATE * elapsed
    )


def _turn(p: Quaternion, q: Quaternion) -> float:
    """Angle between two attitudes [rad]."""
    return 2.0 * math.acos(min(abs(sum(a * b for a, b in zip(p, q, strict=True))), 1.0))


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
