"""Fences from mission items of type FENCE (https://mavlink.io/en/services/mission.html#geofence)."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from protocol.dialect import mavlink
from protocol.frames import LocalFrame
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, is_global_frame
from protocol.plans.item_values import numbers_of
from protocol.plans.plan import MissionItem, Refusal
from protocol.ranges import KNOWN_FRAMES, item_flaw
from protocol.units import UNKNOWN_INT32, from_e7
from sitl.autopilot.safety.fence import Circle, Fence, Polygon, Zone
from sitl.autopilot.safety.world import POSITION_FRAMES, World, north_west
from sitl.control.reference import Point

_RESULTS = (
    mavlink.MAV_MISSION_INVALID_PARAM1,
    mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3,
    mavlink.MAV_MISSION_INVALID_PARAM4,
    mavlink.MAV_MISSION_INVALID_PARAM5_X,
    mavlink.MAV_MISSION_INVALID_PARAM6_Y,
    mavlink.MAV_MISSION_INVALID_PARAM7,
)


def refuse_numbers(item: MissionItem, name: str) -> Refusal | None:
    """The reason why an item's numbers are invalid, whatever is around it; None if they are valid.

    Args:
        item: The item.
        name: What the pilot knows it by.
    """
    if item.frame not in KNOWN_FRAMES:
        return Refusal(f"{name}: frame {item.frame} is not supported", mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    flaw = item_flaw(item.command, item.frame, numbers_of(item))
    return None if flaw is None else Refusal(f"{name}: {flaw.text}", _RESULTS[flaw.number - 1])


def make_rally(items: Sequence[MissionItem], world: World) -> tuple[Point, ...] | Refusal:
    """The points, world NWU [m], that mission items of type RALLY describe, or why they are not valid."""
    points = []
    for seq, item in enumerate(items):
        if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT:
            text = f"rally item {seq}: command {item.command} is not a rally point"
            return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED)
        if item.frame not in POSITION_FRAMES:
            text = f"rally item {seq}: frame {item.frame} is not supported"
            return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
        if UNKNOWN_INT32 in {item.x, item.y}:
            return Refusal(f"rally item {seq}: a rally point needs a position", mavlink.MAV_MISSION_INVALID_PARAM5_X)
        if (refusal := refuse_numbers(item, f"rally item {seq}")) is not None:
            return refusal
        up = world.up(item.z, above_sea=item.frame in ABSOLUTE_ALTITUDE_FRAMES)
        point = world.local(from_e7(item.x), from_e7(item.y), up)
        reason = world.arena.refuse(point)
        if reason is not None:
            return Refusal(f"rally item {seq}: {reason}", mavlink.MAV_MISSION_INVALID)
        points.append(point)
    return tuple(points)


# Whether the zone of an item is to stay in.
VERTEX_COMMANDS = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLE_COMMANDS = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}
RETURN_POINT = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT


def make_fence(items: Sequence[MissionItem], world: World) -> Fence | Refusal:
    """The fence that mission items of type FENCE describe, or why they are not valid."""
    inclusions: list[Zone] = []
    exclusions: list[Zone] = []
    frame, seq, return_seq = world.frame, 0, -1
    while seq < len(items):
        command = items[seq].command
        if command == RETURN_POINT:
            if return_seq >= 0:
                text = f"fence item {seq}: a second return point beside item {return_seq}"
                return Refusal(text, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return_seq, seq = seq, seq + 1
            continue
        is_circle = command in CIRCLE_COMMANDS
        zone = _circle(seq, items[seq], frame) if is_circle else _polygon(seq, items, frame)
        if isinstance(zone, Refusal):
            return zone
        inclusion = CIRCLE_COMMANDS[command] if is_circle else VERTEX_COMMANDS[command]
        (inclusions if inclusion else exclusions).append(zone)
        seq += len(zone.corners) if isinstance(zone, Polygon) else 1
    fence = Fence(tuple(inclusions), tuple(exclusions))
    if return_seq < 0:
        return fence
    point = _return_point(return_seq, items[return_seq], fence, world)
    return point if isinstance(point, Refusal) else fence._replace(return_point=point)


def _return_point(seq: int, item: MissionItem, fence: Fence, world: World) -> Point | Refusal:
    """End of a return after a breach, world NWU [m]; at a height that is left open, as low as a return may be."""
    if item.frame not in POSITION_FRAMES:
        text = f"fence item {seq}: frame {item.frame} is not supported for a return point"
        return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if (refusal := refuse_numbers(item, f"fence item {seq}")) is not None:
        return refusal
    place = _position(seq, item, world.frame)
    if isinstance(place, Refusal):
        return place
    is_open = math.isnan(item.z)
    up = world.home[2] if is_open else world.up(item.z, above_sea=item.frame in ABSOLUTE_ALTITUDE_FRAMES)
    point = (*place, up)
    outside = world.arena.refuse((*place, max(up, 0.0)))
    if breach := None if outside else fence.breach([point]):
        outside = breach.text
    if outside is not None:
        return Refusal(f"fence item {seq}: the return point is wrong: {outside}", mavlink.MAV_MISSION_INVALID)
    return point


def _circle(seq: int, item: MissionItem, frame: LocalFrame) -> Circle | Refusal:
    centre = _position(seq, item, frame)
    return centre if isinstance(centre, Refusal) else Circle(centre, item.params[0])


def _polygon(seq: int, items: Sequence[MissionItem], frame: LocalFrame) -> Polygon | Refusal:
    first = items[seq]
    if first.command not in VERTEX_COMMANDS:
        code = mavlink.MAV_MISSION_UNSUPPORTED
        return Refusal(f"fence item {seq}: command {first.command} is not supported in a fence", code)
    if (refusal := refuse_numbers(first, f"fence item {seq}")) is not None:
        return refusal
    count = first.params[0]
    if count > len(items) - seq:
        text = f"fence item {seq}: {count:g} corners do not make a polygon here"
        return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM1)
    corners = []
    for index in range(seq, seq + int(count)):
        item = items[index]
        if item.command != first.command or item.params[0] != count:
            code = mavlink.MAV_MISSION_INVALID_SEQUENCE
            return Refusal(f"fence item {index}: expected corner {index - seq + 1} of {count:g} of a polygon", code)
        corner = _position(index, item, frame)
        if isinstance(corner, Refusal):
            return corner
        corners.append(corner)
    return Polygon(np.array(corners))


def _position(seq: int, item: MissionItem, frame: LocalFrame) -> tuple[float, float] | Refusal:
    """North and west of the origin [m], or why there is no such place."""
    if not is_global_frame(item.frame):
        code = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
        return Refusal(f"fence item {seq}: frame {item.frame} is not supported", code)
    if (refusal := refuse_numbers(item, f"fence item {seq}")) is not None:
        return refusal
    if UNKNOWN_INT32 in {item.x, item.y}:
        return Refusal(f"fence item {seq}: it needs latitude and longitude", mavlink.MAV_MISSION_INVALID_PARAM5_X)
    return north_west(from_e7(item.x), from_e7(item.y), frame)
