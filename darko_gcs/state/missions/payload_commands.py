"""Items of camera, mount, conditions and landing patterns as the operator reads them: their names and parameters.

They come with plans of other stations, and are shown and kept; the list of items to insert does not have them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink as m

Params = tuple[float, float, float, float]


@dataclass(frozen=True, kw_only=True)
class MissionCommand:
    """A command that missions are made of. A parameter without a name is not used."""

    command: int  # MAV_CMD
    label: str
    params: tuple[str, str, str, str]  # names of param1 to param4
    defaults: Params
    has_place: bool = True


_UNUSED = ("",) * 4
_ZEROS: Params = (0.0,) * 4
_OPEN = math.nan


def _aside(
    command: int, label: str, params: tuple[str, str, str, str] = _UNUSED, defaults: Params = _ZEROS
) -> MissionCommand:
    """An item without a place."""
    return MissionCommand(command=command, label=label, params=params, defaults=defaults, has_place=False)


PAYLOAD_COMMANDS = (
    MissionCommand(
        command=m.MAV_CMD_NAV_VTOL_TAKEOFF, label="Take off", params=("", "", "", "Yaw [deg]"),
        defaults=(0.0, 0.0, 0.0, _OPEN),
    ),
    MissionCommand(
        command=m.MAV_CMD_NAV_VTOL_LAND, label="Land", params=("", "", "", "Yaw [deg]"),
        defaults=(0.0, 0.0, 0.0, _OPEN),
    ),
    MissionCommand(
        command=m.MAV_CMD_NAV_LOITER_TO_ALT, label="Circle to a height",
        params=("Leave towards the next (0, 1)", "Radius [m], - anticlockwise", "", "Exit by a tangent (0, 1)"),
        defaults=(1.0, 40.0, 0.0, 1.0),
    ),
    _aside(m.MAV_CMD_DO_LAND_START, "Landing begins"),
    _aside(m.MAV_CMD_CONDITION_DELAY, "Next items wait", ("Delay [s]", "", "", ""), (5.0, 0.0, 0.0, 0.0)),
    _aside(m.MAV_CMD_CONDITION_DISTANCE, "Next items wait", ("Distance [m]", "", "", ""), (10.0, 0.0, 0.0, 0.0)),
    _aside(
        m.MAV_CMD_CONDITION_YAW, "Turn",
        ("Angle [deg]", "Rate [deg/s]", "Way (0 shorter, 1 clockwise, -1)", "Relative (0, 1)"),
    ),
    MissionCommand(
        command=m.MAV_CMD_DO_SET_HOME, label="Move home", params=("Here (0, 1)", "", "", ""), defaults=_ZEROS
    ),
    _aside(m.MAV_CMD_DO_FENCE_ENABLE, "Fence", ("In force (0, 1)", "", "", ""), (1.0, 0.0, 0.0, 0.0)),
    MissionCommand(command=m.MAV_CMD_DO_SET_ROI_LOCATION, label="Look at a place", params=_UNUSED, defaults=_ZEROS),
    MissionCommand(
        command=m.MAV_CMD_DO_SET_ROI, label="Look at a place", params=("Mode (0 none, 1 along, 3 place)", "", "", ""),
        defaults=(3.0, 0.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET, "Look along the way"),
    _aside(m.MAV_CMD_DO_SET_ROI_NONE, "Look nowhere"),
    _aside(m.MAV_CMD_DO_MOUNT_CONFIGURE, "Configure mount", ("Mode", "", "", "")),
    _aside(m.MAV_CMD_DO_MOUNT_CONTROL, "Point mount", ("Pitch [deg]", "Roll [deg]", "Yaw [deg]", "")),
    _aside(
        m.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW, "Point gimbal",
        ("Pitch [deg]", "Yaw [deg]", "Pitch rate [deg/s]", "Yaw rate [deg/s]"), (0.0, 0.0, _OPEN, _OPEN),
    ),
    _aside(m.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE, "Configure gimbal"),
    _aside(m.MAV_CMD_DO_DIGICAM_CONTROL, "Take an image"),
    _aside(
        m.MAV_CMD_DO_SET_CAM_TRIGG_DIST, "Images by distance",
        ("Distance [m], 0 ends", "Shutter [ms]", "At once (0, 1)", ""), (25.0, 0.0, 1.0, 0.0),
    ),
    _aside(
        m.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL, "Images by time", ("Cycle [ms], 0 ends", "Shutter [ms]", "", ""),
        (2000.0, 0.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_SET_CAMERA_MODE, "Camera mode", ("", "Mode (0 image, 1 video, 2 survey)", "", "")),
    _aside(
        m.MAV_CMD_IMAGE_START_CAPTURE, "Take images", ("", "Interval [s]", "Images, 0 without end", ""),
        (0.0, 2.0, 0.0, 0.0),
    ),
    _aside(m.MAV_CMD_IMAGE_STOP_CAPTURE, "Stop images"),
    _aside(m.MAV_CMD_VIDEO_START_CAPTURE, "Start video"),
    _aside(m.MAV_CMD_VIDEO_STOP_CAPTURE, "Stop video"),
)  # fmt: skip
