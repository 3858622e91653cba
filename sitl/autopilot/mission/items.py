"""Items of missions: their places, orders and conditions, and which are accepted."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.frames import flip
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES
from protocol.plans.item_circles import CLIMB_COMMANDS, LOITER_COMMANDS, RADIUS_NUMBERS, item_radius
from protocol.plans.item_values import numbers_of
from protocol.plans.plan import MissionItem, Refusal
from protocol.ranges import MAX_PLAN_ITEMS
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.leg_planner import no_descent
from sitl.autopilot.mission.speeds import MAX_VERTICAL_SPEEDS, VERTICAL_WORDS
from sitl.autopilot.world import POSITION_FRAMES, World, refuse_numbers
from sitl.control.reference import Point, Reference
from sitl.enclosure.arena_detours import detour
from sitl.guidance.circles import rim
from sitl.guidance.headings import YawTurn
from sitl.guidance.view import VehicleView

# Acceptance of missions: a mission is checked as a whole when it is uploaded, so that none is refused in flight.
#
# Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common dialect.

# Positions of mission items: their frames and altitudes.


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


# DO items that other parts of the vehicle carry out: camera, mount, region of interest, home, fence.
#
# The same numbers come as commands outside of missions; both become an :class:`Order`.


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


# Items that let the DO items after them wait (CONDITION_*), as ArduPilot means them.
#
# While the next item is flown they wait: for a time, for a distance to its end, for a heading. What still waits when
# that is reached is passed over. With nothing to fly after them, the vehicle waits where it is.


CONDITION_COMMANDS = frozenset(
    {mavlink.MAV_CMD_CONDITION_DELAY, mavlink.MAV_CMD_CONDITION_DISTANCE, mavlink.MAV_CMD_CONDITION_YAW}
)


@dataclass(slots=True)
class Condition:
    """A condition that is waited for."""

    command: int  # MAV_CMD
    value: float  # [s] or [m]
    since: float  # [s]
    turn: YawTurn | None = None

    @classmethod
    def of(cls, item: MissionItem, view: VehicleView) -> Condition:
        """The condition of an item, which begins now."""
        is_yaw = item.command == mavlink.MAV_CMD_CONDITION_YAW
        return cls(item.command, item.params[0], view.time, YawTurn.of(item.params, view) if is_yaw else None)

    def is_met(self, view: VehicleView, left: float) -> bool:
        """Whether it is waited for no more.

        Args:
            view: The vehicle as it is now.
            left: Level distance to the end of the item that is flown meanwhile [m]; 0 without one.
        """
        if self.turn is not None:
            return view.forward or self.turn.done(view)  # in forward flight there is no heading to turn to
        if self.command == mavlink.MAV_CMD_CONDITION_DISTANCE:
            return left <= self.value
        return view.time - self.since >= self.value


@dataclass(slots=True)
class AwaitCondition:
    """Stay at a reference until a condition is met; a heading is turned to meanwhile, and kept."""

    reference: Reference
    condition: Condition
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:
        """The reference of this tick."""
        if self.condition.turn is not None:
            self.reference = self.reference._replace(heading=self.condition.turn.update(view))
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Whether the condition is met."""
        return self.condition.is_met(view, 0.0)


@dataclass(slots=True)
class WaitingItems:
    """Items that wait while another is flown."""

    seqs: list[int] = field(default_factory=list)
    condition: Condition | None = None  # that is waited for

    def next_free(self, items: Sequence[MissionItem], view: VehicleView, end: Point | None) -> int | None:
        """The first of them if it waits no more, which is taken from them; a condition begins when it is the first.

        Args:
            items: All of the mission's.
            view: The vehicle as it is now.
            end: Where the item that is flown meanwhile ends, world NWU [m]; None if it has no place.
        """
        if not self.seqs:
            return None
        first = items[self.seqs[0]]
        if first.command in CONDITION_COMMANDS:
            self.condition = self.condition or Condition.of(first, view)
            if not self.condition.is_met(view, math.inf if end is None else math.dist(end[:2], view.p[:2])):
                return None
            self.condition = None
        return self.seqs.pop(0)

    @property
    def turn(self) -> YawTurn | None:
        """Of the heading, if that is waited for."""
        return None if self.condition is None else self.condition.turn

    @property
    def words(self) -> str:
        """The numbers of the items that wait, in words."""
        return f"item{'s' * (len(self.seqs) > 1)} {', '.join(map(str, self.seqs))}"


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


def refuse_items(items: Sequence[MissionItem], world: World, radius: float) -> str | None:
    """The reason why a mission that was valid cannot be flown with the present fence and home; None if it can.

    Args:
        items: All of the mission's.
        world: With fence and home.
        radius: Of circles that leave it open [m]; 0: those are hovered.
    """
    for seq, item in enumerate(items):
        if item.command not in POSITION_COMMANDS | LAND_COMMANDS | TAKEOFF_COMMANDS:
            continue
        reason = world.arena.refuse(_end(item, world))
        if reason is not None:
            return f"item {seq}: {reason}"
        if (reason := _outside_fence(seq, item, world, radius)) is not None:
            return reason
    return refuse_detours(items, world)


def _outside_fence(seq: int, item: MissionItem, world: World, radius: float) -> str | None:
    """The reason why the fence forbids an item that has a place, or its circle; None if it allows both."""
    point = position_of(item, world)
    if point is None:
        return None
    if (breach := world.fence.breach([point])) is not None:
        return f"item {seq} is {breach.text}"
    circle = _circle(item, point, world, radius)
    if circle and (breach := world.fence.breach(circle)) is not None:
        return f"the {item_radius(item, radius):g} m circle of item {seq} is partly {breach.text}"
    return None


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


def _circle(item: MissionItem, centre: Point, world: World, default: float = 0.0) -> list[Point]:
    """Points of the circle of an item; none without one, or under a net, where none is flown.

    Args:
        item: Of a mission.
        centre: World NWU [m].
        world: Where it is flown.
        default: Radius of an item that leaves it open [m]; 0: no circle.
    """
    radius = 0.0 if world.arena.has_net else item_radius(item, default)
    return rim(centre, radius) if radius > 0.0 else []


def _refuse_vertical_speed(seq: int, kind: float, speed: float) -> Refusal | None:
    """The reason why a hover cannot climb or descend so fast [m/s], or None; other types of speed have one limit."""
    limit = MAX_VERTICAL_SPEEDS.get(kind)
    if limit is None or speed <= limit:
        return None
    text = f"item {seq}: param2 (speed) is {speed:g} m/s, the hover {VERTICAL_WORDS[kind]} with up to {limit:g} m/s"
    return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM2)
