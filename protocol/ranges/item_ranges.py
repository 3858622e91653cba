"""The parameters of plan items (mission, fence, rally points), as this project's vehicle takes them.

One row for each MAV_CMD: its ``params`` 1 to 4, and its ``place``, which is parameters 5 to 7. To add an item, add a
row; :func:`item_flaw` then refuses what is out of range, with the parameter's number and name. A command without a row
may have any finite numbers.

https://mavlink.io/en/messages/common.html#mav_commands
"""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.flight_limits import MAX_AIRSPEED, MAX_PLAN_ITEMS, MIN_CORNERS
from protocol.mav_frames import is_global_frame
from protocol.names.command_values import DEFAULT_SPEED, NO_CHANGE
from protocol.ranges.value_range import ANY_NUMBER, Flaw, ValueRange, finite, first_flaw, one_of, whole

__all__ = ["ITEM_RANGES", "KNOWN_FRAMES", "MAX_ITEM_ALTITUDE", "ItemRanges", "item_flaw", "item_ranges"]

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
    mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT: ItemRanges(place=(LATITUDE, LONGITUDE, OPEN_ALTITUDE)),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: ItemRanges((CORNERS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: ItemRanges((ZONE_RADIUS, _, _, _), GROUND_PLACE),
    mavlink.MAV_CMD_NAV_RALLY_POINT: ItemRanges(place=PLACE),
}


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
    """Why an item cannot have its seven parameters, or None.

    Args:
        command: MAV_CMD.
        frame: MAV_FRAME.
        values: Parameters 1 to 7: positions in degrees or metres, NaN where they are left open.
    """
    return first_flaw(item_ranges(command, frame), values)
