"""DO items that other parts of the vehicle carry out: camera, mount, region of interest, home, fence.

The same numbers come as commands outside of missions; both become an :class:`Order`.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.plans.item_values import numbers_of
from protocol.plans.plan import MissionItem
from sitl.autopilot.mission.places import position_of
from sitl.autopilot.safety.world import World
from sitl.control.reference import Point

ROI_PLACE_COMMANDS = frozenset({mavlink.MAV_CMD_DO_SET_ROI_LOCATION, mavlink.MAV_CMD_DO_SET_ROI})
CAMERA_COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_DO_DIGICAM_CONTROL,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
        mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
        mavlink.MAV_CMD_VIDEO_STOP_CAPTURE,
    }
)
MOUNT_COMMANDS = ROI_PLACE_COMMANDS | {
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET,
    mavlink.MAV_CMD_DO_SET_ROI_NONE,
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE,
    mavlink.MAV_CMD_DO_MOUNT_CONTROL,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE,
}
PLACE_COMMANDS = ROI_PLACE_COMMANDS | {mavlink.MAV_CMD_DO_SET_HOME}
ORDER_COMMANDS = CAMERA_COMMANDS | MOUNT_COMMANDS | {mavlink.MAV_CMD_DO_SET_HOME, mavlink.MAV_CMD_DO_FENCE_ENABLE}


class Order(NamedTuple):
    """An order, of a mission or of a peer."""

    command: int  # MAV_CMD
    params: tuple[float, ...]  # 1 to 7; positions in degrees, NaN where they are left open
    point: Point | None  # the place that parameters 5 to 7 name, world NWU [m]; the height may be NaN
    seq: int = -1  # of the mission item; -1: a command

    @property
    def is_of_mission(self) -> bool:
        """Whether a mission gives it."""
        return self.seq >= 0

    def param(self, number: int, default: float = 0.0) -> float:
        """A parameter, from 1; the default where it is left open."""
        value = self.params[number - 1]
        return default if math.isnan(value) else value


def order_of(seq: int, item: MissionItem, world: World) -> Order:
    """The order of a mission item."""
    try:
        point = position_of(item, world) if item.command in PLACE_COMMANDS else None
    except ValueError:  # a frame that is not known, of an item that needs no place
        point = None
    return Order(item.command, numbers_of(item), point, seq)


def lacks_place(item: MissionItem, world: World) -> bool:
    """Whether an order has to name a place, and does not."""
    params = item.params
    wants = {
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION: True,
        mavlink.MAV_CMD_DO_SET_ROI: params[0] == mavlink.MAV_ROI_LOCATION,
        mavlink.MAV_CMD_DO_SET_HOME: params[0] != 1.0,
    }
    if not wants.get(item.command, False):
        return False
    try:
        return position_of(item, world) is None
    except ValueError:  # a frame that is not known
        return True
