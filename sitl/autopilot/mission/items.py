"""Acceptance of missions: a mission is checked as a whole when it is uploaded, so that none is refused in flight.

Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common dialect.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.limits import MAX_PLAN_ITEMS
from protocol.plans.mission_item import MissionItem
from protocol.plans.plan import Refusal
from sitl.autopilot.leg_planner import no_descent
from sitl.autopilot.mission.conditions import CONDITION_COMMANDS
from sitl.autopilot.mission.order_items import ORDER_COMMANDS, lacks_place
from sitl.autopilot.mission.places import height_of, position_of
from sitl.autopilot.mission.speeds import MAX_VERTICAL_SPEEDS, VERTICAL_WORDS
from sitl.autopilot.safety.fence_items import refuse_numbers
from sitl.autopilot.safety.world import World
from sitl.control.reference import Point
from sitl.enclosure.arena_detours import detour
from sitl.guidance.circles import rim

REASONS = {
    mavlink.MAV_CMD_NAV_SPLINE_WAYPOINT: "splines are not flown: use waypoints",
    mavlink.MAV_CMD_NAV_FOLLOW: "there is nothing that it could follow",
    mavlink.MAV_CMD_NAV_CONTINUE_AND_CHANGE_ALT: "use NAV_LOITER_TO_ALT",
    mavlink.MAV_CMD_NAV_PAYLOAD_PLACE: "the vehicle has no gripper and no winch",
    mavlink.MAV_CMD_NAV_GUIDED_ENABLE: "use the mode OFFBOARD",
    mavlink.MAV_CMD_CONDITION_CHANGE_ALT: "use NAV_LOITER_TO_ALT",
    mavlink.MAV_CMD_DO_SET_MODE: "a mission does not change its mode: use NAV_RETURN_TO_LAUNCH or NAV_LAND",
    mavlink.MAV_CMD_DO_SET_PARAMETER: "a mission does not change parameters",
    mavlink.MAV_CMD_DO_SET_RELAY: "the vehicle has no relay",
    mavlink.MAV_CMD_DO_REPEAT_RELAY: "the vehicle has no relay",
    mavlink.MAV_CMD_DO_SET_SERVO: "the vehicle has no servo outputs to spare",
    mavlink.MAV_CMD_DO_REPEAT_SERVO: "the vehicle has no servo outputs to spare",
    mavlink.MAV_CMD_DO_SET_ACTUATOR: "the vehicle has no actuators to spare",
    mavlink.MAV_CMD_DO_PARACHUTE: "the vehicle has no parachute",
    mavlink.MAV_CMD_DO_MOTOR_TEST: "motors are not tested in flight",
    mavlink.MAV_CMD_DO_INVERTED_FLIGHT: "the vehicle does not fly inverted",
    mavlink.MAV_CMD_DO_GRIPPER: "the vehicle has no gripper",
    mavlink.MAV_CMD_DO_WINCH: "the vehicle has no winch",
    mavlink.MAV_CMD_SET_CAMERA_ZOOM: "the camera has a fixed lens",
    mavlink.MAV_CMD_SET_CAMERA_FOCUS: "the camera has a fixed lens",
}


def refusal_of(command: int) -> str:
    """A sentence about a command that no mission may have here."""
    entry = mavlink.enums["MAV_CMD"].get(command)
    name = f"command {command}" if entry is None else f"{str(entry.name).removeprefix('MAV_CMD_')} ({command})"
    reason = REASONS.get(command)
    return f"{name} is not supported" + (f": {reason}" if reason else "")


TAKEOFF_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
LAND_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND})
LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_UNLIM}
)
CLIMB_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_LOITER_TO_ALT})
RADIUS_NUMBERS = dict.fromkeys(LOITER_COMMANDS, 3) | dict.fromkeys(CLIMB_COMMANDS, 2)  # their parameter with a radius
# Their position cannot be left open:
POSITION_COMMANDS = LOITER_COMMANDS | CLIMB_COMMANDS | {mavlink.MAV_CMD_NAV_WAYPOINT}
IMMEDIATE_COMMANDS = frozenset(
    {mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_DO_JUMP, mavlink.MAV_CMD_DO_VTOL_TRANSITION}
)
# A vehicle flies on while they are carried out.
PASSED_COMMANDS = (
    (IMMEDIATE_COMMANDS - {mavlink.MAV_CMD_DO_JUMP})
    | ORDER_COMMANDS
    | CONDITION_COMMANDS
    | {mavlink.MAV_CMD_DO_LAND_START}
)
SUPPORTED_COMMANDS = (
    TAKEOFF_COMMANDS
    | LAND_COMMANDS
    | POSITION_COMMANDS
    | IMMEDIATE_COMMANDS
    | PASSED_COMMANDS
    | {mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_DELAY}
)
# By the MAV_VTOL_STATE that DO_VTOL_TRANSITION asks for; undefined leaves the choice to the vehicle again.
WAY_OF_VTOL_STATE = {
    mavlink.MAV_VTOL_STATE_UNDEFINED: LegMode.NONE,
    mavlink.MAV_VTOL_STATE_MC: LegMode.HOVER,
    mavlink.MAV_VTOL_STATE_FW: LegMode.FORWARD,
}


def next_flown(items: Sequence[MissionItem], seq: int) -> int | None:
    """Number of the first item after one that is flown; None if there is none, or a jump before it."""
    flown = range(seq + 1, len(items))
    following = next((number for number in flown if items[number].command not in PASSED_COMMANDS), None)
    return None if following is None or items[following].command == mavlink.MAV_CMD_DO_JUMP else following


def validate(items: Sequence[MissionItem], world: World) -> Refusal | None:
    """Check a whole mission. None if it can be flown, else the first reason why not."""
    if len(items) > MAX_PLAN_ITEMS:
        return Refusal(f"{len(items)} items: the limit is {MAX_PLAN_ITEMS}", mavlink.MAV_MISSION_NO_SPACE)
    for seq, item in enumerate(items):
        refusal = _validate_item(seq, item, len(items), world)
        if refusal is not None:
            return refusal
    blocked = refuse_detours(items, world)
    return None if blocked is None else Refusal(blocked, mavlink.MAV_MISSION_INVALID)


def refuse_detours(items: Sequence[MissionItem], world: World) -> str | None:
    """The reason why obstacles leave no way from item to item; or None. The way to the first item is not checked."""
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
            route = detour(world.arena, before, end, world.arena.clearance)
            reason = route.text if isinstance(route, Refusal) else ""
        if reason:
            return f"item {seq}: {reason}"
        before = None if position_of(item, world) is None else end
    return None


def refuse_items(items: Sequence[MissionItem], world: World) -> str | None:
    """The reason why a mission that was valid cannot be flown with the present fence and home; None if it can."""
    for seq, item in enumerate(items):
        if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
            continue
        reason = world.arena.refuse(_end(item, world))
        if reason is not None:
            return f"item {seq}: {reason}"
        point = position_of(item, world)
        breach = None if point is None else world.fence.breach([point, *_circle(item, point, world)])
        if breach is not None:
            return f"item {seq} is {breach.text}"
    return refuse_detours(items, world)


def _end(item: MissionItem, world: World) -> Point:
    """End of an item, world NWU [m]; one that leaves its position open is taken to be over home."""
    point = position_of(item, world) or (world.home[0], world.home[1], height_of(item, world))
    # The ground decides where a landing ends.
    return point if item.command not in LAND_COMMANDS else (point[0], point[1], max(point[2], 0.0))


def _validate_item(seq: int, item: MissionItem, count: int, world: World) -> Refusal | None:
    if item.command not in SUPPORTED_COMMANDS:
        return Refusal(f"item {seq}: {refusal_of(item.command)}", mavlink.MAV_MISSION_UNSUPPORTED)
    if (refusal := refuse_numbers(item, f"item {seq}")) is not None:
        return refusal
    if item.command == mavlink.MAV_CMD_DO_JUMP and item.params[0] >= count:
        text = f"item {seq}: param1 is {item.params[0]:g}, not a whole number from 0 to {count - 1} (jump target)"
        return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM1)
    if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
        return _refuse_vertical_speed(seq, *item.params[:2])
    return _validate_place(seq, item, world)


def _validate_place(seq: int, item: MissionItem, world: World) -> Refusal | None:
    if lacks_place(item, world):
        return Refusal(f"item {seq}: it needs a position in a known frame", mavlink.MAV_MISSION_INVALID_PARAM5_X)
    if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
        return None
    try:
        point = position_of(item, world)
    except ValueError as error:
        return Refusal(f"item {seq}: {error}", mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if point is None and item.command in POSITION_COMMANDS:
        return Refusal(f"item {seq}: a waypoint needs a position", mavlink.MAV_MISSION_INVALID_PARAM5_X)
    reason = world.arena.refuse(_end(item, world))
    if reason is not None:
        return Refusal(f"item {seq}: {reason}", mavlink.MAV_MISSION_INVALID)
    return None if point is None else _refuse_circle(seq, item, point, world)


def _refuse_circle(seq: int, item: MissionItem, centre: Point, world: World) -> Refusal | None:
    """The reason why a circle is refused: it leaves the arena; None if it does not."""
    outside = next(filter(None, map(world.arena.refuse, _circle(item, centre, world))), None)
    if outside is None:
        return None
    number = RADIUS_NUMBERS[item.command]
    text = f"item {seq}: param{number} is {item.params[number - 1]:g} (radius): on the circle, {outside}"
    return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM1 + number - 1)


def _circle(item: MissionItem, centre: Point, world: World) -> list[Point]:
    """Points of the circle that an item names by its radius; none without one, or under a net, where none is flown."""
    if item.command not in RADIUS_NUMBERS or world.arena.has_net:
        return []
    radius = item.params[RADIUS_NUMBERS[item.command] - 1]
    return [] if radius == 0.0 or math.isnan(radius) else rim(centre, abs(radius))


def _refuse_vertical_speed(seq: int, kind: float, speed: float) -> Refusal | None:
    """The reason why a hover cannot climb or descend so fast [m/s], or None; other types of speed have one limit."""
    limit = MAX_VERTICAL_SPEEDS.get(kind)
    if limit is None or speed <= limit:
        return None
    text = f"item {seq}: param2 (speed) is {speed:g} m/s, the hover {VERTICAL_WORDS[kind]} with up to {limit:g} m/s"
    return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM2)
