"""Obstacles that somebody measures while the vehicle flies: it stops before it comes nearer than it may."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.autopilot.safety.alarm import Alarm, SafetyAction
from sitl.autopilot.safety.arena_watch import RAISED_AGAIN, way_to_stop
from sitl.autopilot.settings import Settings
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView

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
