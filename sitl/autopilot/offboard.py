"""Streamed set-points as calls of the autopilot; docs/clients.md has the table of what is flown and what refused.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_GLOBAL_INT
https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET
"""

from __future__ import annotations

import math

from protocol import units
from protocol.codec import Message
from protocol.dialect import mavlink
from protocol.frames import flip, flip_quaternion
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.streamed import KEEP_FACING, Facing
from sitl.control.reference import AttitudeReference, Point
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector

# POSITION_TARGET_TYPEMASK
NO_POSITION = 0b0000_0000_0000_0111
NO_VELOCITY = 0b0000_0000_0011_1000
NO_ACCELERATION = 0b0000_0001_1100_0000
FORCE = mavlink.POSITION_TARGET_TYPEMASK_FORCE_SET
NO_YAW = mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
NO_YAW_RATE = mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE

# ATTITUDE_TARGET_TYPEMASK
NO_RATES = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
)
THRUST_BODY = 0b0010_0000  # THRUST_BODY_SET, newer than the generator's definitions
NO_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
NO_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE

LOCAL = mavlink.MAV_FRAME_LOCAL_NED
# Frames whose origin travels with the vehicle: of positions, and of what has a direction alone.
OFFSETS = frozenset({mavlink.MAV_FRAME_LOCAL_OFFSET_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD})
BODY = frozenset({mavlink.MAV_FRAME_BODY_NED, mavlink.MAV_FRAME_BODY_OFFSET_NED, mavlink.MAV_FRAME_BODY_FRD})
DIRECTIONS = BODY | {LOCAL, mavlink.MAV_FRAME_LOCAL_OFFSET_NED}
ABOVE_SEA = frozenset({mavlink.MAV_FRAME_GLOBAL_INT, mavlink.MAV_FRAME_GLOBAL})
ABOVE_HOME = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT})

NOT_A_NUMBER = "set-point is not a number"


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return _take_attitude(autopilot, message)
    if message.get_type() == "SET_ACTUATOR_CONTROL_TARGET":
        return "motors and elevons follow the control laws alone"
    return _take_place_or_motion(autopilot, message)


def _take_place_or_motion(autopilot: Autopilot, message: Message) -> str | None:
    mask = message.type_mask
    facing = _facing(message)
    if facing is None:
        return NOT_A_NUMBER
    if not mask & NO_POSITION:  # velocity and acceleration beside a position are a feed-forward it needs not
        return _take_position(autopilot, message, facing)
    if mask & NO_POSITION != NO_POSITION:
        return "a set-point with part of a position is not flown"
    if not mask & NO_VELOCITY:
        v = _direction(autopilot, message, (message.vx, message.vy, message.vz))
        return v if isinstance(v, str) else autopilot.set_offboard_velocity(v, facing)
    if mask & NO_VELOCITY != NO_VELOCITY:
        return "a set-point with part of a velocity is not flown"
    if mask & NO_ACCELERATION or mask & FORCE:
        return "set-point of neither position, velocity nor acceleration"
    a = _direction(autopilot, message, (message.afx, message.afy, message.afz))
    return a if isinstance(a, str) else autopilot.set_offboard_acceleration(a, facing)


def _facing(message: Message) -> Facing | None:
    """The heading that is asked for, or its rate; None if that is not a number. A NaN yaw asks for no heading."""
    if not message.type_mask & NO_YAW and not math.isnan(message.yaw):
        return Facing(heading=-message.yaw) if math.isfinite(message.yaw) else None
    if message.type_mask & NO_YAW_RATE or math.isnan(message.yaw_rate):
        return KEEP_FACING
    return Facing(turn=-message.yaw_rate) if math.isfinite(message.yaw_rate) else None


def _take_position(autopilot: Autopilot, message: Message, facing: Facing) -> str | None:
    frame = message.coordinate_frame
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        p = flip((message.x, message.y, message.z))
        if frame in OFFSETS:
            return autopilot.set_offboard_offset(p, facing, body=frame in BODY)
        return _unsupported(frame) if frame != LOCAL else autopilot.set_offboard_setpoint(p, facing)
    if frame not in ABOVE_SEA | ABOVE_HOME:
        return _unsupported(frame)
    world = autopilot.world
    up = world.up(message.alt, above_sea=frame in ABOVE_SEA)
    p = world.local(units.from_e7(message.lat_int), units.from_e7(message.lon_int), up)
    return autopilot.set_offboard_setpoint(p, facing)


def _direction(autopilot: Autopilot, message: Message, wire: tuple[float, float, float]) -> Point | str:
    """A velocity or an acceleration in world NWU, or why it is invalid."""
    frame, v = message.coordinate_frame, flip(wire)
    if not all(map(math.isfinite, v)):
        return NOT_A_NUMBER
    if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
        return v if frame in ABOVE_SEA | ABOVE_HOME else _unsupported(frame)
    if frame not in DIRECTIONS:
        return _unsupported(frame)
    return autopilot.level_out(v) if frame in BODY else v


def _take_attitude(autopilot: Autopilot, message: Message) -> str | None:
    mask = message.type_mask
    if mask & NO_ATTITUDE:
        return "body rates alone are not flown: send the attitude with them"
    if mask & NO_THRUST or mask & THRUST_BODY:
        return "an attitude is flown with a thrust along the nose"
    wire = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    rates = flip([0.0 if mask & ignored else rate for ignored, rate in zip(NO_RATES, wire, strict=True)])
    return autopilot.set_offboard_attitude(
        AttitudeReference(Quaternion(*flip_quaternion(message.q)), Vector(*rates), message.thrust)
    )


def _unsupported(frame: int) -> str:
    entry = mavlink.enums["MAV_FRAME"].get(frame)
    name = "" if entry is None else f" ({str(entry.name).removeprefix('MAV_FRAME_')})"
    return f"set-point frame {frame} is not supported{name}"
