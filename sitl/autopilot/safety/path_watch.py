"""A vehicle in forward flight that does not come to its path, whatever the cause: it stops before it is far away.

A vehicle turns onto its path from wherever it is, and may have to turn round first: until it has come to it, it may go
farther away by two turning radii. Once it flies along it, a set distance is all. Where a leg that stops is too short to
stop on, as a return that is asked for on the way past home, its end may be overflown by what stopping takes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.control.reference import LEG, Path, Reference
from sitl.guidance.view import VehicleView

ON_PATH, ALONG_PATH = 10.0, 0.7  # distance from it [m], and share of the speed along it, of a vehicle that follows it
LEAST_TURN = 3.0  # least acceleration of a turn [m/s2]
PERSISTS = 2.0  # [s]
STOPPING_MARGIN = 1.5  # times the distance that stopping takes, it may be overflown by in wind [-]
SPEED_MARGIN = 10.0  # that no ground speed exceeds the wanted airspeed and the wind by [m/s]
SAME_PATH = 1.0  # paths whose ends move less are one [m]
CRITICAL = mavlink.MAV_SEVERITY_CRITICAL


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
        if self._path is None or not _is_same(self._path, reference.path):
            self._path, self._nearest, self._follows = reference.path, math.inf, False
            self._overflown = _overshoot(view, reference.path)
        reason = self._problem(view, reference.path, room)
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
        off, along = _distance(path, view, self._overflown)
        self._nearest = min(self._nearest, off)
        self._follows |= off < ON_PATH and along > ALONG_PATH * speed
        turn = 0.0 if self._follows else 2.0 * (path.airspeed + wind) ** 2 / LEAST_TURN
        return f"{off:.0f} m off the path" if off - self._nearest > room + turn else ""


def _is_same(a: Path, b: Path) -> bool:
    ends = math.dist(a.start, b.start) < SAME_PATH and math.dist(a.end, b.end) < SAME_PATH
    return a.kind == b.kind and ends and abs(a.radius - b.radius) < SAME_PATH


def _overshoot(view: VehicleView, path: Path) -> float:
    """Overshoot past the end of a leg that stops, for a vehicle that begins it too near that end [m]."""
    if path.kind != LEG or not path.stop:
        return 0.0
    remaining = math.dist(view.p[:2], (path.end.x, path.end.y))
    return max(STOPPING_MARGIN * view.stopping_distance - remaining, 0.0)


def _distance(path: Path, view: VehicleView, overflown: float) -> tuple[float, float]:
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
