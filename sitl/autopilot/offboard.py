"""Streamed position set-points: SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT as calls of the autopilot.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
"""

from __future__ import annotations

import math

from protocol import units
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.frames import flip
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.guidance import Vector

NO_POSITION = 0b0000_0000_0000_0111  # type_mask: any of x, y, z is to be ignored
NO_YAW = mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return "attitude set-points are not flown"
    if message.type_mask & NO_POSITION:
        return "only position set-points are flown"
    point = _point(autopilot, message)
    if point is None:
        return f"set-point frame {message.coordinate_frame} is not supported"
    if not all(map(math.isfinite, point)):
        return "set-point is not a number"
    yaw = None if message.type_mask & NO_YAW or not math.isfinite(message.yaw) else message.yaw
    return autopilot.set_offboard_setpoint(point, None if yaw is None else -yaw)


def _point(autopilot: Autopilot, message: Message) -> Vector | None:
    frame = message.coordinate_frame
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        if frame != mavlink.MAV_FRAME_LOCAL_NED:
            return None
        return flip((message.x, message.y, message.z))
    if frame in {mavlink.MAV_FRAME_GLOBAL_INT, mavlink.MAV_FRAME_GLOBAL}:
        height = message.alt - autopilot.world.home.alt
    elif frame in {mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT}:
        height = message.alt
    else:
        return None
    return autopilot.world.local(units.from_e7(message.lat_int), units.from_e7(message.lon_int), height)
