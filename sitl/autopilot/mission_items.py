"""What missions are accepted: a mission is checked whole when it is uploaded, so that no refusal waits in the air.

Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common dialect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.engines.mission_server import Refusal
from protocol.frames import LocalFrame, flip
from protocol.plans.mission import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.arena import Arena
from sitl.autopilot.fence import Fence
from sitl.autopilot.guidance import MAX_AIRSPEED
from sitl.autopilot.places import level
from sitl.control.reference import Point

TAKEOFF = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
LAND = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND})
# Items that name a place, where a missing one cannot be guessed.
PLACED = frozenset(
    {
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_TURNS,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    }
)
IMMEDIATE = frozenset({mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_VTOL_TRANSITION})
# MAV_VTOL_STATE that DO_VTOL_TRANSITION asks for; undefined leaves the choice to the vehicle again.
WAYS = {
    mavlink.MAV_VTOL_STATE_UNDEFINED: Way.NONE,
    mavlink.MAV_VTOL_STATE_MC: Way.HOVER,
    mavlink.MAV_VTOL_STATE_FW: Way.FORWARD,
}
SUPPORTED = TAKEOFF | LAND | PLACED | IMMEDIATE | {mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_DELAY}
GLOBAL_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
RELATIVE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
TURNS = frozenset({mavlink.MAV_CMD_NAV_LOITER_TURNS})
CIRCLES = TURNS | {mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_UNLIM}
MISSION_FRAME = mavlink.MAV_FRAME_MISSION  # items without a place
MAX_ITEMS = 1000


class World(NamedTuple):
    """Where missions are flown: the world frame's place on the globe, the arena about it, fence, rally points, home."""

    frame: LocalFrame
    arena: Arena
    fence: Fence = Fence()
    rally: tuple[Point, ...] = ()  # world NWU [m]
    home: Point = (0.0, 0.0, 0.0)  # world NWU [m]

    @property
    def home_alt(self) -> float:
        """Altitude of home above the sea [m]."""
        return self.frame.origin.alt + self.home[2]

    def up(self, altitude: float, *, above_sea: bool) -> float:
        """World NWU height [m] of an altitude above the sea, or else above home [m]."""
        return altitude - self.frame.origin.alt if above_sea else altitude + self.home[2]

    def local(self, lat_deg: float, lon_deg: float, up: float) -> Point:
        """World NWU [m] of a geodetic point at a height of that frame [m]."""
        return (*level(lat_deg, lon_deg, self.frame), up)

    def refuse(self, p: Point) -> str | None:
        """Why the vehicle may not be sent to a point, world NWU [m], or None if it may."""
        breach = None if (outside := self.arena.refuse(p)) else self.fence.breach([p])
        return breach.text if breach is not None else outside

    def safe_point(self, p: Point, least: float = -math.inf) -> Point:
        """Where to return to from a point: the nearest of home and the rally points, world NWU [m].

        Args:
            p: World NWU [m].
            least: Height above home [m] below which no return is flown.
        """
        north, west, up = min((self.home, *self.rally), key=lambda point: math.dist(point[:2], p[:2]))
        return north, west, max(up, self.home[2] + least)


def place(item: MissionItem, world: World) -> Point | None:
    """The point an item names, world NWU [m]; None where it names no place ("here").

    Raises:
        ValueError: If the item's frame is not one this vehicle knows, or a coordinate is not a number.
    """
    if item.frame == MISSION_FRAME:
        return None
    if not math.isfinite(item.z):
        raise ValueError(f"altitude is {item.z}")
    if item.frame == mavlink.MAV_FRAME_LOCAL_NED:
        return flip((from_local_e4(item.x), from_local_e4(item.y), item.z))
    if item.frame == mavlink.MAV_FRAME_LOCAL_ENU:
        return (from_local_e4(item.y), -from_local_e4(item.x), item.z)
    if item.frame not in GLOBAL_FRAMES | RELATIVE_FRAMES:
        raise ValueError(f"frame {item.frame} is not supported")
    if UNKNOWN_INT32 in {item.x, item.y} or (item.x == 0 and item.y == 0):  # MAVLink's way of leaving the place open
        return None
    return world.local(from_e7(item.x), from_e7(item.y), height(item, world))


def height(item: MissionItem, world: World) -> float:
    """World NWU height that an item names [m], also where it leaves its place open."""
    if item.frame == mavlink.MAV_FRAME_LOCAL_NED:
        return -item.z
    return world.up(item.z, above_sea=item.frame in GLOBAL_FRAMES)


def validate(items: Sequence[MissionItem], world: World) -> Refusal | None:
    """Check a whole mission. None if it can be flown, else the first reason why not."""
    if len(items) > MAX_ITEMS:
        return Refusal(mavlink.MAV_MISSION_NO_SPACE, f"{len(items)} items: at most {MAX_ITEMS} fit")
    for seq, item in enumerate(items):
        refusal = _validate_item(seq, item, len(items), world)
        if refusal is not None:
            return refusal
    return None


def out_of_bounds(items: Sequence[MissionItem], world: World) -> str | None:
    """Why a mission that was valid cannot be flown with fence and home as they are now, or None if it can."""
    for seq, item in enumerate(items):
        if item.command not in PLACED | LAND | TAKEOFF:
            continue
        reason = world.arena.refuse(_end(item, world))
        if reason is not None:
            return f"item {seq}: {reason}"
        point = place(item, world)
        breach = None if point is None else world.fence.breach([point])
        if breach is not None:
            return f"item {seq} is {breach.text}"
    return None


def _end(item: MissionItem, world: World) -> Point:
    """Where an item ends, world NWU [m]; what names no place is taken to be over home."""
    point = place(item, world) or (world.home[0], world.home[1], height(item, world))
    # The ground decides where a landing ends.
    return point if item.command not in LAND else (point[0], point[1], max(point[2], 0.0))


def _validate_item(seq: int, item: MissionItem, count: int, world: World) -> Refusal | None:
    if item.command not in SUPPORTED:
        return Refusal(mavlink.MAV_MISSION_UNSUPPORTED, f"item {seq}: command {item.command} is not supported")
    if item.command in IMMEDIATE:
        return _validate_immediate(seq, item, count)
    if item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
        return None
    if item.command == mavlink.MAV_CMD_NAV_DELAY:
        return None if item.params[0] >= 0.0 else _bad_parameter(seq, 1, "delay", item.params[0])
    try:
        point = place(item, world)
    except ValueError as error:
        code = mavlink.MAV_MISSION_INVALID_PARAM7 if "altitude" in str(error) else mavlink.MAV_MISSION_UNSUPPORTED_FRAME
        return Refusal(code, f"item {seq}: {error}")
    if point is None and item.command in PLACED:
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"item {seq}: a waypoint needs a position")
    reason = world.arena.refuse(_end(item, world))
    if reason is not None:
        return Refusal(mavlink.MAV_MISSION_INVALID, f"item {seq}: {reason}")
    return _validate_times(seq, item)


def _validate_times(seq: int, item: MissionItem) -> Refusal | None:
    hold, acceptance = item.params[0], item.params[1]
    if item.command in PLACED and hold < 0.0:
        return _bad_parameter(seq, 1, "number of turns" if item.command in TURNS else "hold time", hold)
    if item.command in CIRCLES and math.isinf(item.params[2]):
        return _bad_parameter(seq, 3, "radius", item.params[2])
    if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and acceptance < 0.0:
        return _bad_parameter(seq, 2, "acceptance radius", acceptance)
    return None


def _validate_immediate(seq: int, item: MissionItem, count: int) -> Refusal | None:
    if item.command == mavlink.MAV_CMD_DO_JUMP:
        target = item.params[0]
        if not (target >= 0 and target < count and target == int(target)):
            return _bad_parameter(seq, 1, "jump target", target)
        if not item.params[1] >= -1:
            return _bad_parameter(seq, 2, "repeat count", item.params[1])
        return None
    if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
        return None if item.params[0] in WAYS else _bad_parameter(seq, 1, "VTOL state", item.params[0])
    speed = item.params[1]
    return None if 0.0 < speed <= MAX_AIRSPEED or speed == -1.0 else _bad_parameter(seq, 2, "speed", speed)


def _bad_parameter(seq: int, number: int, what: str, value: float) -> Refusal:
    codes = (
        mavlink.MAV_MISSION_INVALID_PARAM1,
        mavlink.MAV_MISSION_INVALID_PARAM2,
        mavlink.MAV_MISSION_INVALID_PARAM3,
        mavlink.MAV_MISSION_INVALID_PARAM4,
    )
    return Refusal(codes[number - 1], f"item {seq}: {what} {value:g} is not possible")
