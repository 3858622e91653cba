"""Missions: what is accepted, and how it is flown.

Item semantics follow https://mavlink.io/en/services/mission.html and the MAV_CMD definitions of the common
dialect. A mission is checked whole when it is uploaded, so that no refusal waits in the air.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal
from protocol.frames import Geodetic, LocalFrame, flip
from protocol.plans.mission import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, from_local_e4
from sitl.autopilot.arena import Arena
from sitl.autopilot.guidance import FlyTo, Guidance, Hold, Ramp, Setpoint, Vector, View, distance, land_at
from sitl.autopilot.guidance import Sequence as Steps
from sitl.autopilot.settings import Settings

TAKEOFF = frozenset({mavlink.MAV_CMD_NAV_TAKEOFF, mavlink.MAV_CMD_NAV_VTOL_TAKEOFF})
LAND = frozenset({mavlink.MAV_CMD_NAV_LAND, mavlink.MAV_CMD_NAV_VTOL_LAND})
# Items that name a place, where a missing one cannot be guessed.
PLACED = frozenset(
    {
        mavlink.MAV_CMD_NAV_WAYPOINT,
        mavlink.MAV_CMD_NAV_LOITER_TIME,
        mavlink.MAV_CMD_NAV_LOITER_UNLIM,
    }
)
IMMEDIATE = frozenset({mavlink.MAV_CMD_DO_CHANGE_SPEED, mavlink.MAV_CMD_DO_JUMP})
SUPPORTED = TAKEOFF | LAND | PLACED | IMMEDIATE | {mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH, mavlink.MAV_CMD_NAV_DELAY}
GLOBAL_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL, mavlink.MAV_FRAME_GLOBAL_INT})
RELATIVE_FRAMES = frozenset({mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT, mavlink.MAV_FRAME_GLOBAL_RELATIVE_ALT_INT})
MISSION_FRAME = mavlink.MAV_FRAME_MISSION  # items without a place
MOST_ITEMS = 1000
SAME_PLACE = 0.5  # take-off and landing points nearer than this are "here" [m]


class World(NamedTuple):
    """Where missions are flown: the geodetic origin of the world frame and the arena about it."""

    frame: LocalFrame
    arena: Arena

    @property
    def home(self) -> Geodetic:
        """The origin of the world frame."""
        return self.frame.origin

    def local(self, lat_deg: float, lon_deg: float, height: float) -> Vector:
        """World NWU [m] of a geodetic point at a height above the origin."""
        north, east, _ = self.frame.to_ned(Geodetic(lat_deg, lon_deg, self.home.alt))
        return (north, -east, height)


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
        return _bad_parameter(seq, 1, "hold time", hold)
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
    speed = item.params[1]
    return None if speed > 0.0 or speed == -1.0 else _bad_parameter(seq, 2, "speed", speed)


def _bad_parameter(seq: int, number: int, what: str, value: float) -> Refusal:
    codes = (
        mavlink.MAV_MISSION_INVALID_PARAM1,
        mavlink.MAV_MISSION_INVALID_PARAM2,
        mavlink.MAV_MISSION_INVALID_PARAM3,
        mavlink.MAV_MISSION_INVALID_PARAM4,
    )
    return Refusal(codes[number - 1], f"item {seq}: {what} {value:g} is not possible")


@dataclass(slots=True)
class MissionRunner:
    """Flies one mission. After ``update``: read ``reached`` and ``notices`` and clear them."""

    items: tuple[MissionItem, ...]
    world: World
    settings: Settings
    current: int = 0
    finished: bool = False
    reached: list[int] = field(default_factory=list)
    notices: list[str] = field(default_factory=list)
    _guidance: Guidance | None = None
    _setpoint: Setpoint | None = None
    _speed: float | None = None
    _jumps_left: dict[int, int] = field(default_factory=dict)

    def jump_to(self, seq: int) -> None:
        """Make an item the current one; the next update starts it.

        Raises:
            IndexError: If the mission has no such item.
        """
        if not 0 <= seq < len(self.items):
            raise IndexError(f"item {seq} of {len(self.items)}")
        self.current, self._guidance, self.finished = seq, None, False

    def interrupt(self) -> None:
        """Forget how far the current item was flown: on resuming it starts anew, from wherever it is."""
        self._guidance = None

    @property
    def landing(self) -> bool:
        """Whether the current item ends on the ground."""
        return self._guidance is not None and self._guidance.landing

    def update(self, view: View) -> Setpoint:
        """The set-point for this tick; moves through as many items as are done."""
        setpoint = self._setpoint or Setpoint(view.p, view.heading, self.speed)
        for _ in range(2 * len(self.items) + 1):  # bounds a loop of jumps with nothing to fly between
            if self.finished:
                break
            if self._guidance is None:
                self._guidance = self._start(self.items[self.current], view, setpoint)
            if self._guidance is not None:
                setpoint = self._guidance.update(view)
                if not self._guidance.done(view):
                    break
            self._advance()
        else:
            self.notices.append("Mission stopped: its jumps loop without a waypoint")
            self.finished = True
        self._setpoint = setpoint
        return setpoint

    def touched_down(self) -> None:
        """The ground ended the current landing."""
        if not self.finished and self.landing:
            self._advance()

    @property
    def speed(self) -> float:
        """Speed limit in force [m/s]."""
        return self.settings.hover_speed if self._speed is None else self._speed

    def _advance(self) -> None:
        item = self.items[self.current]
        self.reached.append(self.current)
        self._guidance = None
        following = self._jump(item) if item.command == mavlink.MAV_CMD_DO_JUMP else self.current + 1
        self.finished = following >= len(self.items)
        if not self.finished:
            self.current = following

    def _jump(self, item: MissionItem) -> int:
        left = self._jumps_left.setdefault(self.current, int(item.params[1]))
        if left == 0:
            return self.current + 1
        if left > 0:
            self._jumps_left[self.current] = left - 1
        return int(item.params[0])

    def _start(self, item: MissionItem, view: View, last: Setpoint) -> Guidance | None:
        if item.command == mavlink.MAV_CMD_DO_CHANGE_SPEED:
            self.change_speed(item.params[1])
            return None
        if item.command == mavlink.MAV_CMD_DO_JUMP:
            return None
        return _BUILDERS[item.command](self, item, view, last)

    def change_speed(self, wanted: float) -> None:
        """Limit the speed of the items to come; -1 returns to the set one [m/s]."""
        if wanted < 0.0:
            self._speed = None
            return
        self._speed = min(wanted, self.settings.hover_speed)
        if wanted > self._speed:
            self.notices.append(f"Speed {wanted:g} m/s: hovering at no more than {self._speed:g} m/s")

    def _take_off(self, item: MissionItem, view: View, last: Setpoint) -> Guidance:
        here = (view.p[0], view.p[1], height(item, self.world))
        climb = Ramp(Setpoint(here, _heading(item, last), self.speed), self.settings.climb_rate)
        point = place(item, self.world)
        if point is None or distance(point, here) < SAME_PLACE:
            return climb
        return Steps((climb, FlyTo(climb.setpoint._replace(p=point), self.settings.acceptance)))

    def _waypoint(self, item: MissionItem, view: View, last: Setpoint) -> Guidance:  # noqa: ARG002 - one signature for all builders
        point = place(item, self.world)
        if point is None:
            raise ValueError("a waypoint without a place passed validation")
        setpoint = Setpoint(point, _heading(item, last), self.speed)
        if item.command == mavlink.MAV_CMD_NAV_LOITER_UNLIM:
            return Hold(setpoint)
        acceptance = self.settings.acceptance
        if item.command == mavlink.MAV_CMD_NAV_WAYPOINT and item.params[1] > 0.0:
            acceptance = item.params[1]
        hold = item.params[0] if math.isfinite(item.params[0]) else 0.0
        return FlyTo(setpoint, acceptance, hold)

    def _delay(self, item: MissionItem, view: View, last: Setpoint) -> Guidance:  # noqa: ARG002 - one signature for all builders
        return FlyTo(last, math.inf, item.params[0])

    def _land(self, item: MissionItem, view: View, last: Setpoint) -> Guidance:
        point = place(item, self.world)
        setpoint = last._replace(heading=_heading(item, last), speed=self.speed)
        if point is None or math.dist(point[:2], view.p[:2]) < SAME_PLACE:
            return land_at(setpoint if point is None else setpoint._replace(p=point), self.settings.descent_rate)
        above = setpoint._replace(p=(point[0], point[1], max(last.p[2], point[2])))
        return Steps((FlyTo(above, self.settings.acceptance), land_at(above, self.settings.descent_rate)))

    def _return(self, item: MissionItem, view: View, last: Setpoint) -> Guidance:  # noqa: ARG002 - one signature for all builders
        return return_home(view, last, self.settings)


def return_home(view: View, last: Setpoint, settings: Settings) -> Guidance:
    """Climb to the return altitude, fly over the origin, land there."""
    high = max(view.p[2], settings.return_altitude)
    here = Setpoint((view.p[0], view.p[1], high), last.heading, settings.hover_speed)
    above_home = here._replace(p=(0.0, 0.0, high))
    return Steps(
        (
            Ramp(here, settings.climb_rate),
            FlyTo(above_home, settings.acceptance),
            land_at(above_home, settings.descent_rate),
        )
    )


def _heading(item: MissionItem, last: Setpoint) -> float:
    """The item's yaw (degrees clockwise from north) as a heading, or the last one where it is NaN."""
    yaw = item.params[3]
    return -math.radians(yaw) if math.isfinite(yaw) else last.heading


_Builder = Callable[[MissionRunner, MissionItem, View, Setpoint], Guidance]
_BUILDERS: dict[int, _Builder] = {
    **dict.fromkeys(TAKEOFF, MissionRunner._take_off),  # noqa: SLF001 - the table is part of the class
    **dict.fromkeys(LAND, MissionRunner._land),  # noqa: SLF001
    **dict.fromkeys(PLACED, MissionRunner._waypoint),  # noqa: SLF001
    mavlink.MAV_CMD_NAV_DELAY: MissionRunner._delay,  # noqa: SLF001
    mavlink.MAV_CMD_NAV_RETURN_TO_LAUNCH: MissionRunner._return,  # noqa: SLF001
}
