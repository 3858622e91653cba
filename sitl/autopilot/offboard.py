"""Streamed position and velocity set-points: SET_POSITION_TARGET_LOCAL_NED and _GLOBAL_INT as calls of the autopilot.

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
NO_VELOCITY = 0b0000_0000_0011_1000  # type_mask: any of vx, vy, vz is to be ignored
NO_YAW = mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return "attitude set-points are not flown"
    if message.type_mask & NO_POSITION == NO_POSITION and not message.type_mask & NO_VELOCITY:
        return _take_velocity(autopilot, message)
    if message.type_mask & NO_POSITION:
        return "only position or velocity set-points are flown"
    point = _point(autopilot, message)
    if point is None:
        return f"set-point frame {message.coordinate_frame} is not supported"
    if not all(map(math.isfinite, point)):
        return "set-point is not a number"
    return autopilot.set_offboard_setpoint(point, _heading(message))


def _heading(message: Message) -> float | None:
    return None if message.type_mask & NO_YAW or not math.isfinite(message.yaw) else -message.yaw


def _take_velocity(autopilot: Autopilot, message: Message) -> str | None:
    local = message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    if local and message.coordinate_frame != mavlink.MAV_FRAME_LOCAL_NED:
        return f"set-point frame {message.coordinate_frame} is not supported"
    v = flip((message.vx, message.vy, message.vz))
    if not all(map(math.isfinite, v)):
        return "set-point is not a number"
    return autopilot.set_offboard_velocity(v, _heading(message))


def _point(autopilot: Autopilot, message: Message) -> Vector | None:
    frame = message.coordinate_frame
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        if frame != mavlink.MAV_FRAME_LOCAL_NED:
            return None
        return flip((message.x, message.y, message.z))
    if frame in {mavlink.MAV_FRAME_GLOBAL_INT, mavlink.MAV_FRAME_GLOBAL}:
        above_sea = True
    elif frame in {mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT}:
        above_sea = False
    else:
        return None
    world = autopilot.world
    up = world.up(message.alt, above_sea=above_sea)
    return world.local(units.from_e7(message.lat_int), units.from_e7(message.lon_int), up)
