"""One frame of motion capture, as it is streamed: Motive's axes, metres."""

from __future__ import annotations

from typing import NamedTuple

CLOCK = 10_000_000  # ticks of Motive's clock in a second


class BodyPose(NamedTuple):
    """The rigid body in a frame."""

    position: tuple[float, float, float]
    attitude: tuple[float, float, float, float]  # x, y, z, w
    marker_error: float  # mean distance of the markers from where the pose puts them [m]
    is_tracked: bool


class CaptureFrame(NamedTuple):
    """A frame; its times are ticks of :data:`CLOCK`."""

    number: int
    exposed: int  # in the middle of the exposure
    received: int  # by Motive from the cameras
    transmitted: int
    body: BodyPose
    markers: tuple[tuple[int, tuple[float, float, float]], ...]  # number from 1 on, and position, of those seen
