"""Decoding of streamed set-points; docs/clients.md has the table of those that are flown and those that are refused.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_GLOBAL_INT
https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET
"""

from __future__ import annotations

import math

from protocol import units
from protocol.dialect import mavlink
from protocol.frames import flip, flip_quaternion, flying_attitude, flying_axes
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES, BODY_FRAMES, OFFSET_FRAMES
from protocol.wire.message import Message
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.safety.world import POSITION_FRAMES
from sitl.control.reference import AttitudeReference, Point
from sitl.guidance.attitude_setpoints import MIN_THRUST
from sitl.guidance.moving_reference import KEEP_HEADING, HeadingSetpoint
from sitl.model.quaternions import Quaternion
from sitl.model.vectors import Vector

# POSITION_TARGET_TYPEMASK
IGNORE_POSITION = 0b0000_0000_0000_0111
IGNORE_VELOCITY = 0b0000_0000_0011_1000
IGNORE_ACCELERATION = 0b0000_0001_1100_0000
IS_FORCE = mavlink.POSITION_TARGET_TYPEMASK_FORCE_SET
IGNORE_YAW = mavlink.POSITION_TARGET_TYPEMASK_YAW_IGNORE
IGNORE_YAW_RATE = mavlink.POSITION_TARGET_TYPEMASK_YAW_RATE_IGNORE

# ATTITUDE_TARGET_TYPEMASK
IGNORE_RATES = (
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_ROLL_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_PITCH_RATE_IGNORE,
    mavlink.ATTITUDE_TARGET_TYPEMASK_BODY_YAW_RATE_IGNORE,
)
THRUST_BODY = 0b0010_0000  # THRUST_BODY_SET, newer than the generator's definitions
IGNORE_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
IGNORE_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE

DIRECTION_FRAMES = BODY_FRAMES | {mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_OFFSET_NED}

NOT_A_NUMBER = "set-point is not a number"


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return _take_attitude(autopilot, message)
    if message.get_type() == "SET_ACTUATOR_CONTROL_TARGET":
        return "motors and elevons follow the control laws only"
    return _take_position_or_motion(autopilot, message)


def _take_position_or_motion(autopilot: Autopilot, message: Message) -> str | None:
    mask = message.type_mask
    heading = _heading(message)
    if heading is None:
        return NOT_A_NUMBER
    if not mask & IGNORE_POSITION:  # velocity and acceleration beside a position are a feed-forward, which is not used
        return _take_position(autopilot, message, heading)
    if mask & IGNORE_POSITION != IGNORE_POSITION:
        return "a set-point with part of a position is not flown"
    if not mask & IGNORE_VELOCITY:
        v = _direction(autopilot, message, (message.vx, message.vy, message.vz))
        return v if isinstance(v, str) else autopilot.offboard.set_velocity(v, heading)
    if mask & IGNORE_VELOCITY != IGNORE_VELOCITY:
        return "a set-point with part of a velocity is not flown"
    if mask & IGNORE_ACCELERATION or mask & IS_FORCE:
        return "set-point without position, velocity or acceleration"
    a = _direction(autopilot, message, (message.afx, message.afy, message.afz))
    return a if isinstance(a, str) else autopilot.offboard.set_acceleration(a, heading)


def _heading(message: Message) -> HeadingSetpoint | None:
    """The heading or its rate; None if that is not a number. A NaN yaw asks for no heading."""
    if not message.type_mask & IGNORE_YAW and not math.isnan(message.yaw):
        return HeadingSetpoint(heading=-message.yaw) if math.isfinite(message.yaw) else None
    if message.type_mask & IGNORE_YAW_RATE or math.isnan(message.yaw_rate):
        return KEEP_HEADING
    return HeadingSetpoint(turn_rate=-message.yaw_rate) if math.isfinite(message.yaw_rate) else None


def _take_position(autopilot: Autopilot, message: Message, heading: HeadingSetpoint) -> str | None:
    frame = message.coordinate_frame
    if message.get_type() == "SET_POSITION_TARGET_LOCAL_NED":
        p = flip((message.x, message.y, message.z))
        if frame in OFFSET_FRAMES:
            return autopilot.offboard.set_offset(p, heading, body=frame in BODY_FRAMES)
        if frame != mavlink.MAV_FRAME_LOCAL_NED:
            return _unsupported(frame)
        return autopilot.offboard.set_position(p, heading)
    if frame not in POSITION_FRAMES:
        return _unsupported(frame)
    world = autopilot.world
    up = world.up(message.alt, above_sea=frame in ABSOLUTE_ALTITUDE_FRAMES)
    p = world.local(units.from_e7(message.lat_int), units.from_e7(message.lon_int), up)
    return autopilot.offboard.set_position(p, heading)


def _direction(autopilot: Autopilot, message: Message, wire: tuple[float, float, float]) -> Point | str:
    """A velocity or an acceleration in world NWU, or why it is invalid."""
    frame, v = message.coordinate_frame, flip(wire)
    if not all(map(math.isfinite, v)):
        return NOT_A_NUMBER
    if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
        return v if frame in POSITION_FRAMES else _unsupported(frame)
    if frame not in DIRECTION_FRAMES:
        return _unsupported(frame)
    return autopilot.offboard.from_body(v) if frame in BODY_FRAMES else v


def _take_attitude(autopilot: Autopilot, message: Message) -> str | None:
    """An attitude in the hover frame, as ATTITUDE has it: attitudes are flown in hover only."""
    mask = message.type_mask
    if mask & IGNORE_ATTITUDE:
        return "body rates alone are not flown: send the attitude with them"
    if mask & IGNORE_THRUST or mask & THRUST_BODY:
        return "an attitude needs a thrust along the nose"
    wire = (message.body_roll_rate, message.body_pitch_rate, message.body_yaw_rate)
    wanted = [0.0 if mask & ignored else rate for ignored, rate in zip(IGNORE_RATES, wire, strict=True)]
    attitude = Quaternion(*flip_quaternion(flying_attitude(message.q)))
    rates = Vector(*flip(flying_axes(wanted)))
    # Programs begin with no thrust, and drop the vehicle with none: that much keeps the elevons in a slipstream.
    thrust = max(message.thrust, MIN_THRUST) if message.thrust >= 0.0 else message.thrust
    return autopilot.offboard.set_attitude(AttitudeReference(attitude, rates, thrust))


def _unsupported(frame: int) -> str:
    entry = mavlink.enums["MAV_FRAME"].get(frame)
    name = "" if entry is None else f" ({str(entry.name).removeprefix('MAV_FRAME_')})"
    return f"set-point frame {frame} is not supported{name}"
