"""Rally points: places beside home to return to."""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal
from protocol.frames import LocalFrame
from protocol.plans.mission import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7
from sitl.autopilot.arena import Arena
from sitl.autopilot.guidance import Vector
from sitl.autopilot.places import level

ABOVE_SEA = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
ABOVE_HOME = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})


def make_rally(items: Sequence[MissionItem], frame: LocalFrame, arena: Arena) -> tuple[Vector, ...] | Refusal:
    """The points, world NWU [m], that mission items of type RALLY describe, or why they describe none."""
    points = []
    for seq, item in enumerate(items):
        if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT:
            return Refusal(mavlink.MAV_MISSION_UNSUPPORTED, f"rally item {seq}: command {item.command} is none")
        if item.frame not in ABOVE_SEA | ABOVE_HOME:
            return Refusal(
                mavlink.MAV_MISSION_UNSUPPORTED_FRAME, f"rally item {seq}: frame {item.frame} is not supported"
            )
        if UNKNOWN_INT32 in {item.x, item.y}:
            return Refusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"rally item {seq}: a rally point needs a position")
        if not math.isfinite(item.z):
            return Refusal(mavlink.MAV_MISSION_INVALID_PARAM7, f"rally item {seq}: altitude is {item.z}")
        height = item.z - (frame.origin.alt if item.frame in ABOVE_SEA else 0.0)
        point = (*level(from_e7(item.x), from_e7(item.y), frame), height)
        reason = arena.refuse(point)
        if reason is not None:
            return Refusal(mavlink.MAV_MISSION_INVALID, f"rally item {seq}: {reason}")
        points.append(point)
    return tuple(points)
