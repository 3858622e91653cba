"""Position of a plan's item in the vehicle's local frame."""

from __future__ import annotations

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.tui.render.map_drawing import NorthEast
from protocol.dialect import mavlink
from protocol.frames import Geodetic, is_global_frame
from protocol.plans import MissionItem
from protocol.units import from_e7, from_local_e4

__all__ = ["item_position"]


def item_position(s: Snapshot, item: MissionItem) -> NorthEast | None:
    """North and east [m]; None for an item without a place, or until home is known."""
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        x, y = from_local_e4(item.x), from_local_e4(item.y)
        here = s.from_vehicle_frame((y, x, 0.0) if item.frame == mavlink.MAV_FRAME_LOCAL_ENU else (x, y, 0.0))
        return None if here is None else here[:2]
    local = s.local(Geodetic(from_e7(item.x), from_e7(item.y), 0.0))
    return None if local is None else local[:2]
