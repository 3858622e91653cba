"""Where an item of a plan is, about the vehicle's local origin."""

from __future__ import annotations

from darko_gcs.snapshot import Snapshot
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans.mission import MissionItem
from protocol.units import from_e7, from_local_e4, is_global_frame

__all__ = ["place_of"]


def place_of(s: Snapshot, item: MissionItem) -> tuple[float, float] | None:
    """North and east [m]; None where the item names no place, or home is not known."""
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        return from_local_e4(item.x), from_local_e4(item.y)
    local = s.local(Geodetic(from_e7(item.x), from_e7(item.y), 0.0))
    return None if local is None else local[:2]
