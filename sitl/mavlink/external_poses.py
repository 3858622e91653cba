"""Decoding of poses that peers measured: where the vehicle is, by cameras or a companion computer.

Position is in the local frame, NED; the attitude is that of the hover frame, as the vehicle tells it in ATTITUDE.

https://mavlink.io/en/messages/common.html#ODOMETRY
https://mavlink.io/en/messages/common.html#VISION_POSITION_ESTIMATE
https://mavlink.io/en/messages/common.html#ATT_POS_MOCAP
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.frames import (
    ATTITUDE_VARIANCES,
    POSITION_VARIANCES,
    flip,
    flip_quaternion,
    flying_attitude,
    quaternion_from_euler,
)
from protocol.plans.plan import Refusal
from protocol.wire.message import Message
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector

MAX_COORDINATE = 1e4  # from the origin, along each axis [m]
MAX_NORM_ERROR = 0.1  # a quaternion's norm differs from one by no more
NED_FRAMES = frozenset({mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_RESERVED_14})  # once MOCAP_NED, as of MAVSDK
ARENA_FRAMES = NED_FRAMES | {mavlink.MAV_FRAME_LOCAL_FRD}  # where no compass tells north, its forward is north
LOST_TRACK = -1  # ODOMETRY.quality


class ExternalPose(NamedTuple):
    """A measured pose."""

    position: Vector  # world NWU [m]
    attitude: Quaternion  # body FLU to world NWU
    position_variance: float | None  # of the worst axis [m2]; None: not told
    attitude_variance: float | None  # [rad2]
    time_stamp: float  # on the sender's clock [s]


def pose_of(message: Message, *, in_arena: bool = False) -> ExternalPose | Refusal:
    """The pose of a message, or why it is refused.

    Args:
        message: ODOMETRY, VISION_POSITION_ESTIMATE or ATT_POS_MOCAP.
        in_arena: Whether the vehicle flies by motion capture alone.
    """
    kind = message.get_type()
    if kind == "ODOMETRY" and (refusal := _refuse_odometry(message, ARENA_FRAMES if in_arena else NED_FRAMES)):
        return Refusal(refusal)
    angles = (message.roll, message.pitch, message.yaw) if kind == "VISION_POSITION_ESTIMATE" else ()
    place = (message.x, message.y, message.z)
    if not all(map(math.isfinite, (*place, *(angles or message.q)))):
        return Refusal("not a number")
    if max(map(abs, place)) > MAX_COORDINATE:
        return Refusal(f"more than {MAX_COORDINATE:g} m away")
    q = quaternion_from_euler(*angles) if angles else tuple(message.q)
    norm = math.hypot(*q)
    if abs(norm - 1.0) > MAX_NORM_ERROR:
        return Refusal(f"quaternion has norm {norm:.2f}, not 1")
    w, x, y, z = (part / norm for part in q)
    covariance = message.pose_covariance if kind == "ODOMETRY" else message.covariance
    return ExternalPose(
        Vector(*flip(place)),
        Quaternion(*flip_quaternion(flying_attitude((w, x, y, z)))),
        _variance(covariance, POSITION_VARIANCES),
        _variance(covariance, ATTITUDE_VARIANCES),
        (message.usec if kind == "VISION_POSITION_ESTIMATE" else message.time_usec) * 1e-6,
    )


def _refuse_odometry(message: Message, frames: frozenset[int]) -> str:
    """The reason why an ODOMETRY is not used; empty if it is."""
    if message.frame_id not in frames:
        return f"frame {message.frame_id} is not LOCAL_NED"
    return "its sender has lost track" if message.quality == LOST_TRACK else ""


def _variance(triangle: Sequence[float], diagonal: Sequence[int]) -> float | None:
    """The greatest variance on a part of the diagonal; None where the sender does not know it."""
    if not triangle or math.isnan(triangle[0]):
        return None
    worst = max(triangle[k] for k in diagonal)
    return worst if 0.0 < worst < math.inf else None
