"""The world of flights: the world frame on the globe, the arena, the fence, rally points and home."""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.frames import Geodetic, LocalFrame
from protocol.names import ABSOLUTE_ALTITUDE_FRAMES, RELATIVE_ALTITUDE_FRAMES
from sitl.autopilot.safety.fence import Fence
from sitl.control.reference import Point
from sitl.enclosure.arena_files import load_arena, shipped_arenas
from sitl.enclosure.geometry import Arena

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
