"""From Motive's axes to the vehicle's: positions and attitudes, NED and FRD as MAVLink has them.

The hall is seen by its observers: right, far, up, left, near. Four settings tell how Motive was calibrated and how the
result shall lie:

1. the axis that is up in the stream: y is Motive's own, z if Motive is told so;
2. the side that the long edge of the calibration triangle pointed to: Motive's z axis, or -y if z is up;
3. where x of the result, east, shall point: to a side, or at an angle from the right, anticlockwise seen from above;
4. the side that the vehicle's front pointed to when its rigid body was made: there its quaternion is one. The front of
   a tail-sitter on its tail is its belly.

All are rotations about the vertical after the first one, so their angles add up.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.frames import Quaternion, Vector, multiply, rotate

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
