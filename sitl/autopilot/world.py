"""The world of flights: its place on the globe, arena, geofence, rally points and home."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.frames import Geodetic, LocalFrame
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES, is_global_frame
from protocol.plans.item_values import numbers_of
from protocol.plans.plan import MissionItem, Refusal
from protocol.ranges import KNOWN_FRAMES, item_flaw
from protocol.units import UNKNOWN_INT32, from_e7
from sitl.control.reference import Point
from sitl.enclosure.arena_files import Arena, load_arena, shipped_arenas
from sitl.model.airframe import Array

# The geofence: where the vehicle may be, and whether it will stay there.
#
# There are zones to stay in and zones to stay out of, polygons and circles. The vehicle must be in at least one zone to
# stay in, if there are any, and in no zone to stay out of. Two parameters add a cylinder about home. Zones, like all
# positions here, are in the world frame NWU.
#
Flags = NDArray[np.bool_]


class Breach(NamedTuple):
    """A breach of the fence: a FENCE_BREACH and words."""

    kind: int
    text: str


class Circle(NamedTuple):
    """A vertical cylinder."""

    centre: tuple[float, float]  # world NWU, level [m]
    radius: float  # [m]

    def contains(self, p: Array) -> Flags:
        """Mask of the points (n, 2) that are inside, (n,)."""
        inside: Flags = np.hypot(p[:, 0] - self.centre[0], p[:, 1] - self.centre[1]) <= self.radius
        return inside


class Polygon(NamedTuple):
    """A vertical prism."""

    corners: Array  # world NWU, level, (k, 2) [m]

    def contains(self, p: Array) -> Flags:
        """Mask of the points (n, 2) inside, (n,): a ray to the west crosses the outline an odd number of times."""
        x, y = p[:, 0, None], p[:, 1, None]
        x1, y1 = self.corners.T
        x2, y2 = np.roll(self.corners, -1, axis=0).T
        straddles = (x1 > x) != (x2 > x)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = y1 + (x - x1) * (y2 - y1) / (x2 - x1)
        inside: Flags = np.count_nonzero(straddles & (crossing > y), axis=1) % 2 == 1
        return inside


Zone = Circle | Polygon


class Fence(NamedTuple):
    """All zones, and the cylinder about home; an empty fence bounds nothing."""

    inclusions: tuple[Zone, ...] = ()
    exclusions: tuple[Zone, ...] = ()
    max_distance: float = 0.0  # level, from home [m]; 0: any
    max_height: float = 0.0  # above home [m]; 0: any
    home: Point = (0.0, 0.0, 0.0)  # world NWU [m]
    return_point: Point | None = None  # where a return after a breach ends, world NWU [m]; None: at home

    def allows(self, p: Array) -> Flags:
        """Mask of the points (n, 3), world NWU [m], at which nothing is wrong, (n,)."""
        within = np.ones(len(p), dtype=bool)
        if self.max_height > 0.0:
            within &= p[:, 2] - self.home[2] <= self.max_height
        if self.max_distance > 0.0:
            within &= np.hypot(p[:, 0] - self.home[0], p[:, 1] - self.home[1]) <= self.max_distance
        if self.inclusions:
            within &= np.any([zone.contains(p) for zone in self.inclusions], axis=0)
        for zone in self.exclusions:
            within &= ~zone.contains(p)
        return within

    def breach(self, points: Sequence[Point]) -> Breach | None:
        """The first thing wrong with any of the points, world NWU [m]."""
        p = np.array(points)
        if self.max_height > 0.0 and p[:, 2].max() - self.home[2] > self.max_height:
            return Breach(mavlink.FENCE_BREACH_MAXALT, f"higher than {self.max_height:g} m above home")
        away = np.hypot(p[:, 0] - self.home[0], p[:, 1] - self.home[1])
        if self.max_distance > 0.0 and away.max() > self.max_distance:
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, f"farther than {self.max_distance:g} m from home")
        if self.inclusions and not np.any([zone.contains(p) for zone in self.inclusions], axis=0).all():
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, "outside the fence")
        if any(zone.contains(p).any() for zone in self.exclusions):
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, "in an exclusion zone")
        return None


# The world of flights: the world frame on the globe, the arena, the fence, rally points and home.


ARENAS = {name: load_arena(name) for name in shipped_arenas()}


POSITION_FRAMES = ABSOLUTE_ALTITUDE_FRAMES | RELATIVE_ALTITUDE_FRAMES  # the vehicle knows no terrain


class World(NamedTuple):
    """The world frame's place on the globe, and what bounds a flight in it."""

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
        """World NWU [m] of a latitude and longitude [deg] at a height of the world frame [m]."""
        return (*north_west(lat_deg, lon_deg, self.frame), up)

    def refuse(self, p: Point) -> str | None:
        """The reason why the vehicle may not be sent to a point, world NWU [m]; None if it may."""
        breach = None if (outside := self.arena.refuse(p)) else self.fence.breach([p])
        return breach.text if breach is not None else outside

    def safe_point(self, p: Point, min_height: float = -math.inf) -> Point:
        """The point to return to from a point: the nearest of home and the rally points, world NWU [m].

        Args:
            p: World NWU [m].
            min_height: Height above home [m] below which no return is flown.
        """
        north, west, up = min((self.home, *self.rally), key=lambda point: math.dist(point[:2], p[:2]))
        return north, west, max(up, self.home[2] + min_height)


def north_west(lat_deg: float, lon_deg: float, frame: LocalFrame) -> tuple[float, float]:
    """North and west of the frame's origin [m] of a latitude and longitude [deg]."""
    north, east, _ = frame.to_ned(Geodetic(lat_deg, lon_deg, frame.origin.alt))
    return (north, -east)


# Fences from mission items of type FENCE (https://mavlink.io/en/services/mission.html#geofence).


_RESULTS = (
    mavlink.MAV_MISSION_INVALID_PARAM1,
    mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3,
    mavlink.MAV_MISSION_INVALID_PARAM4,
    mavlink.MAV_MISSION_INVALID_PARAM5_X,
    mavlink.MAV_MISSION_INVALID_PARAM6_Y,
    mavlink.MAV_MISSION_INVALID_PARAM7,
)


def refuse_numbers(item: MissionItem, name: str) -> Refusal | None:
    """The reason why an item's numbers are invalid, whatever is around it; None if they are valid.

    Args:
        item: The item.
        name: What the pilot knows it by.
    """
    if item.frame not in KNOWN_FRAMES:
        return Refusal(f"{name}: frame {item.frame} is not supported", mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    flaw = item_flaw(item.command, item.frame, numbers_of(item))
    return None if flaw is None else Refusal(f"{name}: {flaw.text}", _RESULTS[flaw.number - 1])


def make_rally(items: Sequence[MissionItem], world: World) -> tuple[Point, ...] | Refusal:
    """The points, world NWU [m], that mission items of type RALLY describe, or why they are not valid."""
    points = []
    for seq, item in enumerate(items):
        if item.command != mavlink.MAV_CMD_NAV_RALLY_POINT:
            text = f"rally item {seq}: command {item.command} is not a rally point"
            return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED)
        if item.frame not in POSITION_FRAMES:
            text = f"rally item {seq}: frame {item.frame} is not supported"
            return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
        if UNKNOWN_INT32 in {item.x, item.y}:
            return Refusal(f"rally item {seq}: a rally point needs a position", mavlink.MAV_MISSION_INVALID_PARAM5_X)
        if (refusal := refuse_numbers(item, f"rally item {seq}")) is not None:
            return refusal
        up = world.up(item.z, above_sea=item.frame in ABSOLUTE_ALTITUDE_FRAMES)
        point = world.local(from_e7(item.x), from_e7(item.y), up)
        reason = world.arena.refuse(point)
        if reason is not None:
            return Refusal(f"rally item {seq}: {reason}", mavlink.MAV_MISSION_INVALID)
        points.append(point)
    return tuple(points)


# Whether the zone of an item is to stay in.
VERTEX_COMMANDS = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLE_COMMANDS = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}
RETURN_POINT = mavlink.MAV_CMD_NAV_FENCE_RETURN_POINT


def make_fence(items: Sequence[MissionItem], world: World) -> Fence | Refusal:
    """The fence that mission items of type FENCE describe, or why they are not valid."""
    inclusions: list[Zone] = []
    exclusions: list[Zone] = []
    frame, seq, return_seq = world.frame, 0, -1
    while seq < len(items):
        command = items[seq].command
        if command == RETURN_POINT:
            if return_seq >= 0:
                text = f"fence item {seq}: a second return point beside item {return_seq}"
                return Refusal(text, mavlink.MAV_MISSION_INVALID_SEQUENCE)
            return_seq, seq = seq, seq + 1
            continue
        is_circle = command in CIRCLE_COMMANDS
        zone = _circle(seq, items[seq], frame) if is_circle else _polygon(seq, items, frame)
        if isinstance(zone, Refusal):
            return zone
        inclusion = CIRCLE_COMMANDS[command] if is_circle else VERTEX_COMMANDS[command]
        (inclusions if inclusion else exclusions).append(zone)
        seq += len(zone.corners) if isinstance(zone, Polygon) else 1
    fence = Fence(tuple(inclusions), tuple(exclusions))
    if return_seq < 0:
        return fence
    point = _return_point(return_seq, items[return_seq], fence, world)
    return point if isinstance(point, Refusal) else fence._replace(return_point=point)


def _return_point(seq: int, item: MissionItem, fence: Fence, world: World) -> Point | Refusal:
    """End of a return after a breach, world NWU [m]; at a height that is left open, as low as a return may be."""
    if item.frame not in POSITION_FRAMES:
        text = f"fence item {seq}: frame {item.frame} is not supported for a return point"
        return Refusal(text, mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    if (refusal := refuse_numbers(item, f"fence item {seq}")) is not None:
        return refusal
    place = _position(seq, item, world.frame)
    if isinstance(place, Refusal):
        return place
    is_open = math.isnan(item.z)
    up = world.home[2] if is_open else world.up(item.z, above_sea=item.frame in ABSOLUTE_ALTITUDE_FRAMES)
    point = (*place, up)
    outside = world.arena.refuse((*place, max(up, 0.0)))
    if breach := None if outside else fence.breach([point]):
        outside = breach.text
    if outside is not None:
        return Refusal(f"fence item {seq}: the return point is wrong: {outside}", mavlink.MAV_MISSION_INVALID)
    return point


def _circle(seq: int, item: MissionItem, frame: LocalFrame) -> Circle | Refusal:
    centre = _position(seq, item, frame)
    return centre if isinstance(centre, Refusal) else Circle(centre, item.params[0])


def _polygon(seq: int, items: Sequence[MissionItem], frame: LocalFrame) -> Polygon | Refusal:
    first = items[seq]
    if first.command not in VERTEX_COMMANDS:
        code = mavlink.MAV_MISSION_UNSUPPORTED
        return Refusal(f"fence item {seq}: command {first.command} is not supported in a fence", code)
    if (refusal := refuse_numbers(first, f"fence item {seq}")) is not None:
        return refusal
    count = first.params[0]
    if count > len(items) - seq:
        text = f"fence item {seq}: {count:g} corners do not make a polygon here"
        return Refusal(text, mavlink.MAV_MISSION_INVALID_PARAM1)
    corners = []
    for index in range(seq, seq + int(count)):
        item = items[index]
        if item.command != first.command or item.params[0] != count:
            code = mavlink.MAV_MISSION_INVALID_SEQUENCE
            return Refusal(f"fence item {index}: expected corner {index - seq + 1} of {count:g} of a polygon", code)
        corner = _position(index, item, frame)
        if isinstance(corner, Refusal):
            return corner
        corners.append(corner)
    return Polygon(np.array(corners))


def _position(seq: int, item: MissionItem, frame: LocalFrame) -> tuple[float, float] | Refusal:
    """North and west of the origin [m], or why there is no such place."""
    if not is_global_frame(item.frame):
        code = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
        return Refusal(f"fence item {seq}: frame {item.frame} is not supported", code)
    if (refusal := refuse_numbers(item, f"fence item {seq}")) is not None:
        return refusal
    if UNKNOWN_INT32 in {item.x, item.y}:
        return Refusal(f"fence item {seq}: it needs latitude and longitude", mavlink.MAV_MISSION_INVALID_PARAM5_X)
    return north_west(from_e7(item.x), from_e7(item.y), frame)
