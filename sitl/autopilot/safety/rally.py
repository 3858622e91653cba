"""Rally points: places beside home to return to (https://mavlink.io/en/services/mission.html#rally)."""

from __future__ import annotations

from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans.mission_item import MissionItem
from protocol.plans.validation import Refusal
from protocol.units import UNKNOWN_INT32, from_e7
from sitl.autopilot.safety.item_numbers import refuse_numbers
from sitl.autopilot.safety.world import POSITION_FRAMES, World
from sitl.control.reference import Point


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
