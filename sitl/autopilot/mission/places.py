"""Positions of mission items: their frames and altitudes."""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.frames import flip
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans.plan import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.safety.world import POSITION_FRAMES, World
from sitl.control.reference import Point


def position_of(item: MissionItem, world: World) -> Point | None:
    """The point an item names, world NWU [m]; None where it leaves its position open.

    Raises:
        ValueError: If the item's frame is not one this vehicle knows.
    """
    if item.frame == mavlink.MAV_FRAME_MISSION:  # an item without a position
        return None
    if (local := _local(item)) is not None:
        return local
    if item.frame not in POSITION_FRAMES:
        raise ValueError(f"frame {item.frame} is not supported")
    if UNKNOWN_INT32 in {item.x, item.y} or (item.x == 0 and item.y == 0):  # MAVLink's ways to leave a position open
        return None
    return world.local(from_e7(item.x), from_e7(item.y), height_of(item, world))


def height_of(item: MissionItem, world: World) -> float:
    """World NWU height that an item names [m], also where it leaves its position open."""
    local = _local(item)
    return world.up(item.z, above_sea=item.frame in ABSOLUTE_ALTITUDE_FRAMES) if local is None else local[2]


def _local(item: MissionItem) -> Point | None:
    """The point of an item in a local frame, world NWU [m]; None in another frame."""
    if item.frame == mavlink.MAV_FRAME_LOCAL_NED:
        return flip((from_local_e4(item.x), from_local_e4(item.y), item.z))
    if item.frame == mavlink.MAV_FRAME_LOCAL_ENU:
        return (from_local_e4(item.y), -from_local_e4(item.x), item.z)
    return None
