"""The parameters of plan items (mission, fence, rally points), as this project's vehicle takes them.

One row for each MAV_CMD: its ``params`` 1 to 4, and its ``place``, which is parameters 5 to 7. To add an item, add a
row; :func:`item_flaw` then refuses what is out of range, with the parameter's number and name. A command without a row
may have any finite numbers.

https://mavlink.io/en/messages/common.html#mav_commands
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.limits import MAX_AIRSPEED, MAX_PLAN_ITEMS, MIN_CORNERS
from protocol.mav_frames import is_global_frame
from protocol.names.labels import DEFAULT_SPEED, NO_CHANGE
from protocol.ranges.value_range import ANY_NUMBER, Flaw, ValueRange, finite, first_flaw, one_of, whole

__all__ = [
    "ALSO_COMMANDS",
    "ITEM_RANGES",
    "KNOWN_FRAMES",
    "MAX_ITEM_ALTITUDE",
    "ItemRanges",
    "item_flaw",
    "item_ranges",
]

KNOWN_FRAMES = frozenset(
    number for number, entry in mavlink.enums["MAV_FRAME"].items() if not entry.name.endswith("_ENUM_END")
)
MAX_DISTANCE = 1e5  # of a radius [m]
MAX_ITEM_ALTITUDE = 2e4  # above or below the sea, home or the origin [m]
MAX_WAIT = 1e6  # [s]
SPEED_TYPES = tuple(
    sorted(kind for kind, entry in mavlink.enums["SPEED_TYPE"].items() if not entry.name.endswith("_ENUM_END"))
)
MIN_SPEED = 0.1  # slower is standing still [m/s]

LATITUDE = finite("latitude", -90.0, 90.0, "deg")
LONGITUDE = finite("longitude", -180.0, 180.0, "deg")
ALTITUDE = finite("altitude", -MAX_ITEM_ALTITUDE, MAX_ITEM_ALTITUDE, "m", default=False)
OPEN_ALTITUDE = finite("altitude", -MAX_ITEM_ALTITUDE, MAX_ITEM_ALTITUDE, "m")
COORDINATE = ValueRange("coordinate")  # in a local frame [m]
YAW = finite("yaw", -360.0, 360.0, "deg")
PITCH = finite("pitch", -180.0, 180.0, "deg")
HEADING_REQUIRED = one_of("heading required", 0, 1, default=True)
DISTANCE = finite("distance", 0.0, MAX_DISTANCE, "m", default=False)
TRIGGER_DISTANCE = finite("distance", 0.1, MAX_DISTANCE, "m", also=(0.0,), default=False)
MOUNT_MODE = one_of("MAV_MOUNT_MODE", 0, 1, 2, default=True)
CAMERA_ID = one_of("camera", 0, 1, default=True)  # all, or the one there is
HOLD_TIME = finite("hold time", 0.0, MAX_WAIT, "s")
RADIUS = finite("radius", -MAX_DISTANCE, MAX_DISTANCE, "m")  # negative: counter-clockwise
# One that is smaller could never be met; 0 leaves it to the vehicle.
ACCEPTANCE = finite("acceptance radius", 0.05, MAX_DISTANCE, "m", also=(0.0,))
CORNERS = whole("number of corners", MIN_CORNERS, MAX_PLAN_ITEMS)
ZONE_RADIUS = finite("radius", 0.01, MAX_DISTANCE, "m", default=False)

Params = tuple[ValueRange, ValueRange, ValueRange, ValueRange]
Place = tuple[ValueRange, ValueRange, ValueRange]

_ = ANY_NUMBER
PLACE: Place = (LATITUDE, LONGITUDE, ALTITUDE)
GROUND_PLACE: Place = (LATITUDE, LONGITUDE, _)  # without a height
OPEN_PLACE: Place = (LATITUDE, LONGITUDE, OPEN_ALTITUDE)
NO_PLACE: Place = (_, _, _)


class ItemRanges(NamedTuple):
    """The ranges of an item's seven parameters."""

    params: Params = (_, _, _, _)
    place: Place = NO_PLACE


ITEM_RANGES: dict[int, ItemRanges] = {
    mavlink.MAV_CMD_NAV_WAYPOINT: ItemRanges((HOLD_TIME, ACCEPTANCE, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_UNLIM: ItemRanges((_, _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TURNS: ItemRanges((finite("number of turns", 0.0, 1e6), _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TIME: ItemRanges((HOLD_TIME, _, RADIUS, YAW), PLACE),
    mavlink.MAV_CMD_NAV_LOITER_TO_ALT: ItemRanges(
        (one_of("heading required", 0, 1, default=True), RADIUS, _, _), PLACE
    ),
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: ItemRanges(),
    mavlink.MAV_CMD_NAV_LAND: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_TAKEOFF: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_VTOL_TAKEOFF: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_VTOL_LAND: ItemRanges((_, _, _, YAW), PLACE),
    mavlink.MAV_CMD_NAV_DELAY: ItemRanges((finite("delay", 0.0, MAX_WAIT, "s", default=False), _, _, _)),
    mavlink.MAV_CMD_DO_JUMP: ItemRanges(
        (whole("jump target", 0, MAX_PLAN_ITEMS - 1), whole("repeat count", 0, 65535, also=(-1.0,)), _, _)
    ),
    mavlink.MAV_CMD_DO_CHANGE_SPEED: ItemRanges(
        (
            one_of("speed type", *SPEED_TYPES, default=True),
            finite("speed", MIN_SPEED, MAX_AIRSPEED, "m/s", also=(NO_CHANGE, DEFAULT_SPEED), default=False),
            one_of("throttle", 0.0, NO_CHANGE, DEFAULT_SPEED, default=True),
            _,
        )
    ),
    mavlink.MAV_CMD_DO_VTOL_TRANSITION: ItemRanges((one_of("VTOL state", 0, 3, 4), _, _, _)),
    mavlink.MAV_CMD_DO_LAND_START: ItemRanges(),
    mavlink.MAV_CMD_CONDITION_DELAY: ItemRanges((finite("delay", 0.0, MAX_WAIT, "s", default=False), _, _, _)),
    mavlink.MAV_CMD_CONDITION_DISTANCE: ItemRanges(
        (finite("distance", 0.0, MAX_DISTANCE, "m", default=False), _, _, _)
    ),
    mavlink.MAV_CMD_CONDITION_YAW: ItemRanges(
        (
            finite("angle", -360.0, 360.0, "deg", default=False),
            finite("rate", 0.0, 360.0, "deg/s"),
            one_of("direction", -1, 0, 1, default=True),
            one_of("relative", 0, 1, default=True),
        )
    ),
    mavlink.MAV_CMD_DO_SET_HOME: ItemRanges((one_of("here", 0, 1, default=True), _, _, _), OPEN_PLACE),
    mavlink.MAV_CMD_DO_FENCE_ENABLE: ItemRanges((one_of("enable", 0, 1), _, _, _)),
    mavlink.MAV_CMD_DO_SET_ROI_LOCATION: ItemRanges((_, _, _, _), OPEN_PLACE),
    mavlink.MAV_CMD_DO_SET_ROI: ItemRanges(
        (
            one_of("MAV_ROI", mavlink.MAV_ROI_NONE, mavlink.MAV_ROI_WPNEXT, mavlink.MAV_ROI_LOCATION, default=True),
            _,
            _,
            _,
        ),
        OPEN_PLACE,
    ),
    mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET: ItemRanges(place=(PITCH, _, YAW)),
    mavlink.MAV_CMD_DO_SET_ROI_NONE: ItemRanges(),
    mavlink.MAV_CMD_DO_MOUNT_CONFIGURE: ItemRanges(),
    mavlink.MAV_CMD_DO_MOUNT_CONTROL: ItemRanges(
        (PITCH, _, YAW, _), (_, _, one_of("MAV_MOUNT_MODE", 0, 1, 2, default=True))
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW: ItemRanges(
        (PITCH, YAW, _, _), (whole("GIMBAL_MANAGER_FLAGS", 0, 1023, default=True), _, _)
    ),
    mavlink.MAV_CMD_DO_GIMBAL_MANAGER_CONFIGURE: ItemRanges(),
    mavlink.MAV_CMD_DO_DIGICAM_CONTROL: ItemRanges(),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST: ItemRanges(
        (
            finite("distance", 0.1, MAX_DISTANCE, "m", also=(0.0,), default=False),
            _,
            one_of("at once", 0, 1, default=True),
            _,
        )
    ),
    mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL: ItemRanges(
        (finite("cycle time", 100.0, MAX_WAIT, "ms", also=(0.0, -1.0), default=False), _, _, _)
    ),
    mavlink.MAV_CMD_SET_CAMERA_MODE: ItemRanges((CAMERA_ID, one_of("CAMERA_MODE", 0, 1, 2), _, _)),
    mavlink.MAV_CMD_IMAGE_START_CAPTURE: ItemRanges(
        (CAMERA_ID, finite("interval", 0.1, MAX_WAIT, "s", also=(0.0,)), whole("images", 0, 1e6, default=True), _)
    ),
    mavlink.MAV_CMD_IMAGE_STOP_CAPTURE: ItemRanges((CAMERA_ID, _, _, _)),
    mavlink.MAV_CMD_VIDEO_START_CAPTURE: ItemRanges((_, finite("status frequency", 0.0, 100.0, "Hz"), CAMERA_ID, _)),
    mavlink.MAV_CMD_VIDEO_STOP_CAPTURE: ItemRanges(),
    mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT: ItemRanges(place=OPEN_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_RALLY_POINT: ItemRanges(place=PLACE),
}


ALSO_COMMANDS = frozenset(
    {
        mavlink.MAV_CMD_CONDITION_YAW,
        mavlink.MAV_CMD_DO_FENCE_ENABLE,
        mavlink.MAV_CMD_DO_SET_ROI_LOCATION,
        mavlink.MAV_CMD_DO_SET_ROI,
        mavlink.MAV_CMD_DO_SET_ROI_WPNEXT_OFFSET,
        mavlink.MAV_CMD_DO_SET_ROI_NONE,
        mavlink.MAV_CMD_DO_MOUNT_CONTROL,
        mavlink.MAV_CMD_DO_GIMBAL_MANAGER_PITCHYAW,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_DIST,
        mavlink.MAV_CMD_DO_SET_CAM_TRIGG_INTERVAL,
        mavlink.MAV_CMD_SET_CAMERA_MODE,
        mavlink.MAV_CMD_IMAGE_START_CAPTURE,
        mavlink.MAV_CMD_IMAGE_STOP_CAPTURE,
        mavlink.MAV_CMD_VIDEO_START_CAPTURE,
    }
)
"""Items whose numbers are commands too, with the same parameters."""


def item_ranges(command: int, frame: int) -> tuple[ValueRange, ...]:
    """The ranges of an item's seven parameters in a MAV_FRAME.

    Latitude and longitude are such in every item with a global frame, also where the item does not use them.
    """
    row = ITEM_RANGES.get(command, ItemRanges())
    x, y, z = row.place
    if is_global_frame(frame):
        x, y = LATITUDE, LONGITUDE
    elif x is LATITUDE:
        x, y, z = NO_PLACE if frame == mavlink.MAV_FRAME_MISSION else (COORDINATE, COORDINATE, z)
    return (*row.params, x, y, z)


def item_flaw(command: int, frame: int, values: tuple[float, ...]) -> Flaw | None:
    """First flaw of an item's seven parameters, or None.

    Args:
        command: MAV_CMD.
        frame: MAV_FRAME.
        values: Parameters 1 to 7: positions in degrees or metres, NaN where they are left open.
    """
    return first_flaw(item_ranges(command, frame), values)
