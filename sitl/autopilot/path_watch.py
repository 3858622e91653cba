"""Watches of the flight's path: before net and obstacles, and off the path that is flown."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law
from sitl.autopilot.answers import Alarm, SafetyAction
from sitl.autopilot.settings import Settings
from sitl.control.reference import LEG, Path, Point, Reference
from sitl.enclosure.arena_files import THE_NET, Arena
from sitl.guidance.view import VehicleView

# The arena in flight: hold before net and obstacles; at the net land, and at the last cut the motors.

HOLD, LAND, CUT = 2, 3, 4  # of DRK_NET_ACT
# A hovering vehicle that is told to hold stands after this time at its speed, and in a tail wind after longer.
HOVER_STANDS_AFTER, LATER_BY_WIND = 0.6, 0.25  # [s], [s per m/s]
RETREAT = 1.2  # since a law that does not know the wind stands downwind of where it should hold [m]
SPEEDING_UP_TIME = 0.6  # for which a transition to forward flight still gains speed after such an order [s]
PIECES = 4  # of the way to a stop, whose ends are looked at
RAISED_AGAIN = 1.0  # after so long, if something is neared still [s]
CALM_TIME = 2.0  # of room again after which an alarm is over [s]
WARNING, CRITICAL = mavlink.MAV_SEVERITY_WARNING, mavlink.MAV_SEVERITY_CRITICAL
EMERGENCY = mavlink.MAV_SEVERITY_EMERGENCY


def way_to_stop(view: VehicleView) -> list[Point]:
    """Points from where the vehicle is to where the law in force can stop it, world NWU [m]."""
    speed = math.hypot(view.v[0], view.v[1])
    tail_wind = (view.wind[0] * view.v[0] + view.wind[1] * view.v[1]) / max(speed, 0.1)
    seconds = HOVER_STANDS_AFTER + LATER_BY_WIND * max(tail_wind, 0.0)
    if view.forward and speed > 1.0:
        seconds = SPEEDING_UP_TIME + view.stopping_distance / speed
    times = [seconds * k / PIECES for k in range(PIECES + 1)]
    return [(view.p[0] + t * view.v[0], view.p[1] + t * view.v[1], view.p[2] + t * view.v[2]) for t in times]


@dataclass(slots=True)
class ArenaWatch:
    """Raises each stage of the chain once; it begins anew after a while with room enough."""

    near: bool = False  # too near, or about to be
    lands: bool = False
    is_cut: bool = False
    _since: float = 0.0  # when the vehicle itself came too near [s]
    _raised: float = -math.inf  # the first stage, last time [s]
    _last: float = -math.inf  # when there last was too little room [s]

    def check(self, view: VehicleView, arena: Arena, settings: Settings, *, landing: bool) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            view: The vehicle as it is now.
            arena: With its net and obstacles.
            settings: With the action and its thresholds.
            landing: Whether it lands already: then only the last stage is left.
        """
        rooms = [arena.room(p) for p in way_to_stop(view)]
        (room, what), (ahead, before) = rooms[0], min(rooms)
        if ahead >= settings.net_room:
            if view.time - self._last > CALM_TIME:
                self.near = self.lands = False
            self._since = view.time
            return []
        self._last = view.time
        at_net = what == THE_NET  # before an obstacle it holds: it may stand under the vehicle
        if room >= settings.net_room or not at_net:
            self._since = view.time
        if (
            at_net
            and room < settings.net_cut
            and settings.net_action >= CUT
            and not self.is_cut
            and self._nears(view, arena, room)
        ):
            self.is_cut = True
            return [Alarm(SafetyAction.TERMINATE, EMERGENCY, f"{room:.1f} m from {what}")]
        if landing:
            return []
        if settings.net_action >= LAND and not self.lands and view.time - self._since > settings.net_land_time:
            self.lands = True
            return [Alarm(SafetyAction.LAND, CRITICAL, f"Still {room:.1f} m from {what}")]
        if self.near and (view.time - self._raised < RAISED_AGAIN or not self._nears(view, arena, room)):
            return []
        self.near, self._raised = True, view.time
        action = SafetyAction.HOLD if settings.net_action >= HOLD else SafetyAction.NONE
        reason = f"{max(room, 0.0):.1f} m from {what}"
        if before != what:
            reason = f"Would stop {max(ahead, 0.0):.1f} m from {before}"
        return [Alarm(action, WARNING, reason, stop=True, always=True, retreat=RETREAT)]

    def _nears(self, view: VehicleView, arena: Arena, room: float) -> bool:
        """Whether the vehicle comes nearer still."""
        soon = (view.p[0] + 0.1 * view.v[0], view.p[1] + 0.1 * view.v[1], view.p[2] + 0.1 * view.v[2])
        return arena.room(soon)[0] < room


# A vehicle in forward flight that does not come to its path, whatever the cause: it stops before it is far away.
#
# A vehicle turns onto its path from wherever it is, and may have to turn round first: until it has come to it, it may
# go farther away by two turning radii. Once it flies along it, a set distance is all. Where a leg that stops is too
# short to stop on, as a return that is asked for on the way past home, its end may be overflown by what stopping takes.
# A vehicle that brakes at the end of its leg is left to it: to hold is to stop, too, but would give up the way back.


ON_PATH, ALONG_PATH = 10.0, 0.7  # distance from it [m], and share of the speed along it, of a vehicle that follows it
LEAST_TURN = 3.0  # least acceleration of a turn [m/s2]
PERSISTS = 2.0  # [s]
STOPPING_MARGIN = 1.5  # times the distance that stopping takes, it may be overflown by in wind [-]
SPEED_MARGIN = 10.0  # that no ground speed exceeds the wanted airspeed and the wind by [m/s]
SAME_PATH = 1.0  # paths whose ends move less are one [m]


@dataclass(slots=True)
class PathWatch:
    """Watches the distance to the path and the ground speed of a flight as it is estimated.

    Attributes:
        has_left: The path has been left, and is not flown any more.
    """

    has_left: bool = False
    _path: Path | None = None
    _nearest: float = math.inf  # to the path since it began [m]
    _follows: bool = False  # it has come to it
    _overflown: float = 0.0  # how far the end of the path may be [m]
    _wrong_since: float | None = None  # [s]

    def check(self, view: VehicleView, reference: Reference, room: float) -> list[Alarm]:
        """Alarms that begin now.

        Args:
            view: The vehicle.
            reference: That it flies by.
            room: Distance from the path that it may have [m]; 0: any.
        """
        if not (view.forward and reference.forward) or reference.steered or room <= 0.0:
            self._path, self._wrong_since = None, None
            self.has_left = self.has_left and view.forward
            return []
        if self._path is None or not is_same_path(self._path, reference.path):
            self._path, self._nearest, self._follows = reference.path, math.inf, False
            self._overflown = _overshoot(view, reference.path)
        reason = "" if view.law is Law.TO_HOVER else self._problem(view, reference.path, room)
        if not reason or self.has_left:
            self._wrong_since = None
            return []
        self._wrong_since = view.time if self._wrong_since is None else self._wrong_since
        if view.time - self._wrong_since < PERSISTS:
            return []
        self.has_left = True
        return [Alarm(SafetyAction.HOLD, CRITICAL, reason, always=True)]

    def _problem(self, view: VehicleView, path: Path, room: float) -> str:
        """The reason why the flight along the path cannot go on; empty if it can."""
        speed, wind = math.hypot(view.v[0], view.v[1]), math.hypot(view.wind[0], view.wind[1])
        if speed > path.airspeed + wind + SPEED_MARGIN:
            return f"Ground speed {speed:.0f} m/s, wanted airspeed {path.airspeed:.0f} m/s"
        off, along = distance_off_path(path, view, self._overflown)
        self._nearest = min(self._nearest, off)
        self._follows |= off < ON_PATH and along > ALONG_PATH * speed
        turn = 0.0 if self._follows else 2.0 * (path.airspeed + wind) ** 2 / LEAST_TURN
        return f"{off:.0f} m off the path" if off - self._nearest > room + turn else ""


def is_same_path(a: Path, b: Path) -> bool:
    """Whether two paths are one: their ends are hardly apart."""
    ends = math.dist(a.start, b.start) < SAME_PATH and math.dist(a.end, b.end) < SAME_PATH
    return a.kind == b.kind and ends and abs(a.radius - b.radius) < SAME_PATH


def _overshoot(view: VehicleView, path: Path) -> float:
    """Overshoot past the end of a leg that stops, for a vehicle that begins it too near that end [m]."""
    if path.kind != LEG or not path.stop:
        return 0.0
    remaining = math.dist(view.p[:2], (path.end.x, path.end.y))
    return max(STOPPING_MARGIN * view.stopping_distance - remaining, 0.0)


def distance_off_path(path: Path, view: VehicleView, overflown: float = 0.0) -> tuple[float, float]:
    """Level distance from a path [m], which ends ``overflown`` behind its end, and the speed along it [m/s]."""
    x, y = view.p[0] - path.start.x, view.p[1] - path.start.y
    if path.kind != LEG:
        away = max(math.hypot(x, y), 1e-9)
        sense = math.copysign(1.0, path.radius)
        return abs(away - abs(path.radius)), sense * (x * view.v[1] - y * view.v[0]) / away
    dx, dy = path.end.x - path.start.x, path.end.y - path.start.y
    length = max(math.hypot(dx, dy), 1e-9)
    dx, dy = dx / length, dy / length
    flown = x * dx + y * dy
    beyond = max(flown - length - overflown, -flown, 0.0)
    return math.hypot(beyond, y * dx - x * dy), view.v[0] * dx + view.v[1] * dy


# Obstacles that somebody measures while the vehicle flies: it stops before it comes nearer than it may.


MAX_SCAN_AGE = 0.5  # of a scan that is still believed [s]
MAX_SOURCES = 8  # whose scans are kept
NEARING_SPEED = 0.15  # towards an obstacle, above which it is approached [m/s]


class Scan(NamedTuple):
    """Points that one sensor has seen in one scan."""

    time: float  # of arrival [s]
    places: tuple[tuple[float, float], ...]  # north and west of the world frame [m]


def scan_of(view: VehicleView, distances: list[float], first: float, step: float, *, by_heading: bool) -> Scan:
    """A scan in the world frame.

    Args:
        view: The vehicle as it scanned.
        distances: Level, one for each direction; infinite where nothing was seen [m].
        first: Direction of the first, clockwise from north, or from the heading [rad].
        step: From one direction to the next, clockwise [rad].
        by_heading: Whether the directions are from the heading.
    """
    ahead = view.heading if by_heading else 0.0
    places = []
    for i, distance in enumerate(distances):
        if math.isfinite(distance):
            angle = ahead - first - i * step
            places.append((view.p[0] + distance * math.cos(angle), view.p[1] + distance * math.sin(angle)))
    return Scan(view.time, tuple(places))


@dataclass(slots=True)
class LiveObstacles:
    """The newest scans of every source, and the alarm about them."""

    scans: dict[Hashable, Scan] = field(default_factory=dict)
    _raised: float = -math.inf  # [s]

    def take(self, source: Hashable, scan: Scan) -> bool:
        """Keep the newest scan of a source; False if there are too many sources."""
        self.scans = {name: old for name, old in self.scans.items() if scan.time - old.time <= MAX_SCAN_AGE}
        if source not in self.scans and len(self.scans) >= MAX_SOURCES:
            return False
        self.scans[source] = scan
        return True

    def check(self, view: VehicleView, settings: Settings) -> list[Alarm]:
        """Hold where the way to a stop comes too near to something, and the vehicle nears it.

        Args:
            view: The vehicle as it is now.
            settings: With the distance to keep; negative: scans are ignored.
        """
        keep = settings.collision_distance
        if keep < 0.0 or view.time - self._raised < RAISED_AGAIN:
            return []
        way = way_to_stop(view)
        for place in self._places(view.time):
            now = math.dist(view.p[:2], place)
            if _closing_speed(view, place, now) > NEARING_SPEED and min(math.dist(p[:2], place) for p in way) < keep:
                self._raised = view.time
                text = f"Obstacle at {now:.1f} m, keep {keep:g} m"
                return [Alarm(SafetyAction.HOLD, mavlink.MAV_SEVERITY_WARNING, text, stop=True, always=True)]
        return []

    def _places(self, now: float) -> Iterator[tuple[float, float]]:
        for scan in self.scans.values():
            if now - scan.time <= MAX_SCAN_AGE:
                yield from scan.places


def _closing_speed(view: VehicleView, place: tuple[float, float], distance: float) -> float:
    """Closing speed of the vehicle to a place [m/s]."""
    to: Point = (place[0] - view.p[0], place[1] - view.p[1], 0.0)
    return (view.v[0] * to[0] + view.v[1] * to[1]) / max(distance, 0.01)
