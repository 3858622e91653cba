"""Motive's axes in the hall, from its calibration and its streaming; and the vehicle's world there.

The hall is seen by its observers: right, far, up. Motive's ground plane is laid by a triangle whose long edge points to
a side; that is its z axis, and y is up. Streamed with z up, the long edge is -y.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from sitl.model.airframe import Array

SIDES = {"right": 0.0, "far": 90.0, "left": 180.0, "near": 270.0}  # azimuth from the right, towards far [deg]
UPWARDS = np.array((0.0, 0.0, 1.0))


class HallAxes(NamedTuple):
    """Calibration of the cameras, and the vehicle's world in the hall; ENAC's by default."""

    up_axis: str = "z"  # of the stream
    long_edge: str = "near"  # side the triangle's long edge pointed to
    east: float = 0.0  # azimuth of east from the right, towards far [deg]
    front: str = "far"  # side the vehicle's front pointed to when its rigid body was made

    def to_stream(self) -> Rotation:
        """From the world NWU to the axes of the stream."""
        edge = _towards(SIDES[self.long_edge])
        if self.up_axis == "y":
            axes = np.array((np.cross(UPWARDS, edge), UPWARDS, edge))
        else:
            axes = np.array((np.cross(-edge, UPWARDS), -edge, UPWARDS))
        world = np.column_stack(
            (_towards(self.east + 90.0), _towards(self.east + 180.0), UPWARDS)
        )  # NWU axes in the hall
        return Rotation.from_matrix(axes @ world)

    def attitude_when_made(self) -> Rotation:
        """Body FLU to world NWU when the rigid body was made: upright on its tail, its front to a side.

        The front of a tail-sitter on its tail is its belly.
        """
        towards = math.radians(SIDES[self.front] - self.east - 90.0)  # azimuth from north, towards west
        belly = np.array((math.cos(towards), math.sin(towards), 0.0))
        return Rotation.from_matrix(np.column_stack((UPWARDS, np.cross(-belly, UPWARDS), -belly)))


def _towards(degrees: float) -> Array:
    """Level unit vector of the hall."""
    return np.array((math.cos(math.radians(degrees)), math.sin(math.radians(degrees)), 0.0))
