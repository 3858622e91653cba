"""Which missions are accepted: a mission is checked as a whole when it is uploaded, so that none is refused in flight.

Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common dialect.
"""

from __future__ import annotations

from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Way
from protocol.flight_limits import MAX_PLAN_ITEMS
from protocol.frames import flip
from protocol.mav_frames import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans.mission_item import MissionItem
from protocol.plans.validation import Refusal
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.mission.speeds import MAX_VERTICAL_SPEEDS, VERTICAL_WORDS
from sitl.autopilot.routes import no_descent
from sitl.autopilot.safety.item_numbers import refuse_numbers
from sitl.autopilot.safety.world import POSITION_FRAMES, World
from sitl.control.reference import Point
from sitl.enclosure.arena_detours import detour

TAKEOFF_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
LAND_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND})
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_UNLIM}
)
POSITION_COMMANDS = LOITER_COMMANDS | {mavlink.MAV_CMD_NAV_WAYPOINT}  # their position cannot be left open
IMMEDIATE_COMMANDS = frozenset(
    {mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_VTOL_TRANSITION}
)
SUPPORTED_COMMANDS = (
    TAKEOFF_COMMANDS
    | LAND_COMMANDS
    | POSITION_COMMANDS
    | IMMEDIATE_COMMANDS
    | {mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_DELAY}
)
# By the MAV_VTOL_STATE that DO_VTOL_TRANSITION asks for; undefined leaves the choice to the vehicle again.
WAY_OF_VTOL_STATE = {
    mavlink.MAV_VTOL_STATE_UNDEFINED: Way.NONE,
    mavlink.MAV_VTOL_STATE_MC: Way.HOVER,
    mavlink.MAV_VTOL_STATE_FW: Way.FORWARD,
}


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


def validate(items: Sequence[MissionItem], world: World) -> Refusal | None:
    """Check a whole mission. None if it can be flown, else the first reason why not."""
    if len(items) > MAX_PLAN_ITEMS:
        return Refusal(mavlink.MAV_MISSION_NO_SPACE, f"{len(items)} items: the limit is {MAX_PLAN_ITEMS}")
    for seq, item in enumerate(items):
        refusal = _validate_item(seq, item, len(items), world)
        if refusal is not None:
            return refusal
    blocked = refuse_detours(items, world)
    return None if blocked is None else Refusal(mavlink.MAV_MISSION_INVALID, blocked)


def refuse_detours(items: Sequence[MissionItem], world: World) -> str | None:
    """Why there is no way from item to item past the obstacles, or None; from where it begins nobody knows yet."""
    before: Point | None = None
    for seq, item in enumerate(items if world.arena.obstacles else ()):
        if item.command == mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH:
            before = None
        if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
            continue
        end = _end(item, world)
        lands = item.command in LAND_COMMANDS
        if lands:
            end = (end[0], end[1], end[2] if before is None else max(end[2], before[2]))
        reason = no_descent(world.arena, end, world.arena.clearance) if lands else ""
        if not reason and before is not None:
            way = detour(world.arena, before, end, world.arena.clearance)
            reason = way if isinstance(way, str) else ""
        if reason:
            return f"item {seq}: {reason}"
        before = None if position_of(item, world) is None else end
    return None


def refuse_items(items: Sequence[MissionItem], world: World) -> str | None:
    """Why a mission that was valid cannot be flown with fence and home as they are now, or None if it can."""
    for seq, item in enumerate(items):
        if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
            continue
        reason = world.arena.refuse(_end(item, world))
        if reason is not None:
            return f"item {seq}: {reason}"
        point = position_of(item, world)
        breach = None if point is None else world.fence.breach([point])
        if breach is not None:
            return f"item {seq} is {breach.text}"
    return refuse_detours(items, world)


def _end(item: MissionItem, world: World) -> Point:
    """Where an item ends, world NWU [m]; one that leaves its position open is taken to be over home."""
    point = position_of(item, world) or (world.home[0], world.home[1], height_of(item, world))
    # The ground decides where a landing ends.
    return point if item.command not in LAND_COMMANDS else (point[0], point[1], max(point[2], 0.0))


def _validate_item(seq: int, item: MissionItem, count: int, world: World) -> Refusal | None:
    if item.command not in SUPPORTED_COMMANDS:
        return Refusal(mavlink.MAV_MISSION_UNSUPPORTED, f"item {seq}: command {item.command} is not supported")
    if (refusal := refuse_numbers(item, f"item {seq}")) is not None:
        return refusal
    if item.command == mavlink.MAV_CMD_DO_JUMP and item.params[0] >= count:
        text = f"item {seq}: param1 is {item.params[0]:g}, not a whole number from 0 to {count - 1} (jump target)"
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM1, text)
    if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
        return _refuse_vertical_speed(seq, *item.params[:2])
    if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
        return None
    try:
        point = position_of(item, world)
    except ValueError as error:
        return Refusal(mavlink.MAV_MISSION_UNSUPPORTED_FRAME, f"item {seq}: {error}")
    if point is None and item.command in POSITION_COMMANDS:
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"item {seq}: a waypoint needs a position")
    reason = world.arena.refuse(_end(item, world))
    return None if reason is None else Refusal(mavlink.MAV_MISSION_INVALID, f"item {seq}: {reason}")


def _refuse_vertical_speed(seq: int, kind: float, speed: float) -> Refusal | None:
    """Why a hover cannot climb or descend so fast [m/s], or None; other types of speed have one limit."""
    limit = MAX_VERTICAL_SPEEDS.get(kind)
    if limit is None or speed <= limit:
        return None
    text = f"item {seq}: param2 (speed) is {speed:g} m/s, the hover {VERTICAL_WORDS[kind]} with up to {limit:g} m/s"
    return Refusal(mavlink.MAV_MISSION_INVALID_PARAM2, text)
