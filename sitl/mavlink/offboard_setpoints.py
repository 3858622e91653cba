"""Decoding of streamed set-points; docs/clients.md has the table of those that are flown and those that are refused.

https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_LOCAL_NED
https://mavlink.io/en/messages/common.html#SET_POSITION_TARGET_GLOBAL_INT
https://mavlink.io/en/messages/common.html#SET_ATTITUDE_TARGET
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from protocol import units
from protocol.dialect import mavlink
from protocol.frames import flip, flip_quaternion, flying_attitude, flying_axes
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES, BODY_FRAMES, OFFSET_FRAMES
from protocol.plans.plan import Refusal
from protocol.ranges.message_ranges import message_flaw
from protocol.wire.message import Message
from sitl.autopilot.autopilot import Autopilot
from sitl.autopilot.world import POSITION_FRAMES
from sitl.control.reference import AttitudeReference, Point
from sitl.guidance.setpoints import KEEP_HEADING, MIN_THRUST, HeadingSetpoint
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
RATE_FIELDS = ("body_roll_rate", "body_pitch_rate", "body_yaw_rate")
THRUST_BODY = 0b0010_0000  # THRUST_BODY_SET, newer than the generator's definitions
IGNORE_THRUST = mavlink.ATTITUDE_TARGET_TYPEMASK_THROTTLE_IGNORE
IGNORE_ATTITUDE = mavlink.ATTITUDE_TARGET_TYPEMASK_ATTITUDE_IGNORE

DIRECTION_FRAMES = BODY_FRAMES | {mavlink.MAV_FRAME_LOCAL_NED, mavlink.MAV_FRAME_LOCAL_OFFSET_NED}


def take_setpoint(autopilot: Autopilot, message: Message) -> str | None:
    """Hand a set-point to the autopilot. Returns why it was refused, or None."""
    if message.get_type() == "SET_ATTITUDE_TARGET":
        return _take_attitude(autopilot, message)
    if message.get_type() == "SET_ACTUATOR_CONTROL_TARGET":
        return "motors and elevons follow the control laws only"
    return _take_position_or_motion(autopilot, message)


def _take_position_or_motion(autopilot: Autopilot, message: Message) -> str | None:
    mask = message.type_mask
    if flaw := _flaw(message, _heading_fields(mask)):
        return flaw
    heading = _heading(message)
    if not mask & IGNORE_POSITION:  # velocity and acceleration beside a position are a feed-forward, which is not used
        return _take_position(autopilot, message, heading)
    if mask & IGNORE_POSITION != IGNORE_POSITION:
        return "a set-point with part of a position is not flown"
    if not mask & IGNORE_VELOCITY:
        v = _direction(autopilot, message, ("vx", "vy", "vz"))
        return v.text if isinstance(v, Refusal) else autopilot.offboard.set_velocity(v, heading)
    if mask & IGNORE_VELOCITY != IGNORE_VELOCITY:
        return "a set-point with part of a velocity is not flown"
    if mask & IGNORE_ACCELERATION or mask & IS_FORCE:
        return "set-point without position, velocity or acceleration"
    a = _direction(autopilot, message, ("afx", "afy", "afz"))
    return a.text if isinstance(a, Refusal) else autopilot.offboard.set_acceleration(a, heading)


def _flaw(message: Message, fields: Iterable[str]) -> str:
    """The reason why a set-point cannot have the values of these fields; empty if it can."""
    return message_flaw(message.get_type(), {field: getattr(message, field) for field in fields})


def _heading_fields(mask: int) -> list[str]:
    """The fields of the heading that count."""
    yaw, rate = not mask & IGNORE_YAW, not mask & IGNORE_YAW_RATE
    return ["yaw"] * yaw + ["yaw_rate"] * rate


def _heading(message: Message) -> HeadingSetpoint:
    """The heading or its rate. A NaN yaw asks for no heading."""
    if not message.type_mask & IGNORE_YAW and not math.isnan(message.yaw):
        return HeadingSetpoint(heading=-message.yaw)
    if message.type_mask & IGNORE_YAW_RATE or math.isnan(message.yaw_rate):
        return KEEP_HEADING
    return HeadingSetpoint(turn_rate=-message.yaw_rate)


def _take_position(autopilot: Autopilot, message: Message, heading: HeadingSetpoint) -> str | None:
    frame = message.coordinate_frame
    is_local = message.get_type() == "SET_POSITION_TARGET_LOCAL_NED"
    if flaw := _flaw(message, ("x", "y", "z") if is_local else ("lat_int", "lon_int", "alt")):
        return flaw
    if is_local:
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


def _direction(autopilot: Autopilot, message: Message, fields: tuple[str, str, str]) -> Point | Refusal:
    """A velocity or an acceleration in world NWU, or why it is invalid."""
    if flaw := _flaw(message, fields):
        return Refusal(flaw)
    first, second, third = (getattr(message, field) for field in fields)
    frame, v = message.coordinate_frame, flip((first, second, third))
    if message.get_type() == "SET_POSITION_TARGET_GLOBAL_INT":
        return v if frame in POSITION_FRAMES else Refusal(_unsupported(frame))
    if frame not in DIRECTION_FRAMES:
        return Refusal(_unsupported(frame))
    return autopilot.offboard.from_body(v) if frame in BODY_FRAMES else v


def _take_attitude(autopilot: Autopilot, message: Message) -> str | None:
    """An attitude in the hover frame, as ATTITUDE has it: attitudes are flown in hover only."""
    mask = message.type_mask
    if mask & IGNORE_ATTITUDE:
        return "body rates alone are not flown: send the attitude with them"
    if mask & IGNORE_THRUST or mask & THRUST_BODY:
        return "an attitude needs a thrust along the nose"
    used = [field for ignored, field in zip(IGNORE_RATES, RATE_FIELDS, strict=True) if not mask & ignored]
    parts = {f"q[{k}]": part for k, part in enumerate(message.q)} | {"thrust": message.thrust}
    if flaw := message_flaw(message.get_type(), parts | {field: getattr(message, field) for field in used}):
        return flaw
    wire = [getattr(message, field) for field in RATE_FIELDS]
    wanted = [0.0 if mask & ignored else rate for ignored, rate in zip(IGNORE_RATES, wire, strict=True)]
    attitude = Quaternion(*flip_quaternion(flying_attitude(message.q)))
    rates = Vector(*flip(flying_axes(wanted)))
    # Programs begin with no thrust, and drop the vehicle with none: that much keeps the elevons in a slipstream.
    return autopilot.offboard.set_attitude(AttitudeReference(attitude, rates, max(message.thrust, MIN_THRUST)))


def _unsupported(frame: int) -> str:
    entry = mavlink.enums["MAV_FRAME"].get(frame)
    name = "" if entry is None else f" ({str(entry.name).removeprefix('MAV_FRAME_')})"
    return f"set-point frame {frame} is not supported{name}"
