"""What missions are accepted: a mission is checked whole when it is uploaded, so that no refusal waits in the air.

Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common dialect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal
from protocol.frames import Geodetic, LocalFrame, flip
from protocol.plans.mission import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.arena import Arena
from sitl.autopilot.decision import Way
from sitl.autopilot.fence import Fence
from sitl.autopilot.guidance import FASTEST, Vector
from sitl.autopilot.places import level

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
MOST_ITEMS = 1000


class World(NamedTuple):
    """Where missions are flown: the geodetic origin of the world frame, the arena about it, fence and rally points."""

    frame: LocalFrame
    arena: Arena
    fence: Fence = Fence()
    rally: tuple[Vector, ...] = ()  # world NWU [m]

    @property
    def home(self) -> Geodetic:
        """The origin of the world frame."""
        return self.frame.origin

    def local(self, lat_deg: float, lon_deg: float, height: float) -> Vector:
        """World NWU [m] of a geodetic point at a height above the origin."""
        return (*level(lat_deg, lon_deg, self.frame), height)

    def refuse(self, p: Vector) -> str | None:
        """Why the vehicle may not be sent to a point, world NWU [m], or None if it may."""
        breach = None if (outside := self.arena.refuse(p)) else self.fence.breach([p])
        return breach.text if breach is not None else outside

    def safe_point(self, p: Vector) -> Vector:
        """Where to return to from a point: the nearest of home and the rally points, world NWU [m]."""
        return min(((0.0, 0.0, 0.0), *self.rally), key=lambda point: math.dist(point[:2], p[:2]))


def place(item: MissionItem, world: World) -> Vector | None:
    """The point an item names, world NWU [m]; None where it names none ("here").

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
    """Height an item names above the origin [m], also where it leaves its place open."""
    if item.frame == mavlink.MAV_FRAME_LOCAL_NED:
        return -item.z
    return item.z - (world.home.alt if item.frame in GLOBAL_FRAMES else 0.0)


def validate(items: Sequence[MissionItem], world: World) -> Refusal | None:
    """Check a whole mission. None if it can be flown, else the first reason why not."""
    if len(items) > MOST_ITEMS:
        return Refusal(mavlink.MAV_MISSION_NO_SPACE, f"{len(items)} items: at most {MOST_ITEMS} fit")
    for seq, item in enumerate(items):
        refusal = _validate_item(seq, item, len(items), world)
        if refusal is not None:
            return refusal
    return None


def out_of_bounds(items: Sequence[MissionItem], world: World) -> str | None:
    """Why a valid mission cannot be flown within the fence, or None: the first item that names a place outside."""
    for seq, item in enumerate(items):
        point = place(item, world) if item.command in PLACED | LAND | TAKEOFF else None
        breach = None if point is None else world.fence.breach([point])
        if breach is not None:
            return f"item {seq} is {breach.text}"
    return None


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
    if point is None:
        if item.command in PLACED:
            return Refusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"item {seq}: a waypoint needs a position")
        point = (0.0, 0.0, height(item, world))
    if item.command in LAND:  # the ground decides where a landing ends
        point = (point[0], point[1], max(point[2], 0.0))
    reason = world.arena.refuse(point)
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
    return None if 0.0 < speed <= FASTEST or speed == -1.0 else _bad_parameter(seq, 2, "speed", speed)


def _bad_parameter(seq: int, number: int, what: str, value: float) -> Refusal:
    codes = (
        mavlink.MAV_MISSION_INVALID_PARAM1,
        mavlink.MAV_MISSION_INVALID_PARAM2,
        mavlink.MAV_MISSION_INVALID_PARAM3,
        mavlink.MAV_MISSION_INVALID_PARAM4,
    )
    return Refusal(codes[number - 1], f"item {seq}: {what} {value:g} is not possible")
