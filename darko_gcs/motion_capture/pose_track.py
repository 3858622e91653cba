"""The track of one rigid body: velocity from its last positions, and poses that cannot be."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

from darko_gcs.motion_capture.arena_axes import Pose
from protocol.frames import Quaternion, Vector

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
