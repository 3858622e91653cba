"""The geofence: where the vehicle may be, and whether it will stay there.

Zones come as mission items of type FENCE (https://mavlink.io/en/services/mission.html): polygons and circles, each to
stay in or to stay out of. The vehicle must be in at least one of those to stay in, if there are any, and in none of the
others. Two parameters add a cylinder about home. Zones are seen in the world frame NWU, as are all positions here.

In forward flight the vehicle cannot stop at once. So what is checked is not only where it is but the way to where it
can stand still: the fence is breached when that way leaves it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from protocol.engines.mission_server import Refusal
from protocol.frames import LocalFrame
from protocol.plans.mission import MissionItem
from protocol.units import UNKNOWN_INT32, from_e7, is_global_frame
from sitl.autopilot.guidance import View
from sitl.autopilot.places import level
from sitl.control.reference import Point

SPACING = 2.0  # of the points looked at on the way to a stop [m]
HOVER_STOP = 1.5  # an upright vehicle stands still after so many seconds at its speed [s]
REACTION = 0.3  # until an order to stop has an effect in forward flight [s]
WELL_AGAIN = 1.0  # a breach is over when the fence was kept so long [s]
LARGEST = 1e5  # radius [m]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

VERTICES = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
CIRCLES = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: True,
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: False,
}


class Breach(NamedTuple):
    """What is wrong with a place: a FENCE_BREACH and words."""

    kind: int
    text: str


class Circle(NamedTuple):
    """A vertical cylinder."""

    centre: tuple[float, float]  # world NWU, level [m]
    radius: float  # [m]

    def contains(self, p: Array) -> Flags:
        """Which of the points (n, 2) are inside, (n,)."""
        inside: Flags = np.hypot(p[:, 0] - self.centre[0], p[:, 1] - self.centre[1]) <= self.radius
        return inside


class Polygon(NamedTuple):
    """A vertical prism."""

    corners: Array  # world NWU, level, (k, 2) [m]

    def contains(self, p: Array) -> Flags:
        """Which of the points (n, 2) are inside, (n,): a ray to the west crosses the outline an odd number of times."""
        x, y = p[:, 0, None], p[:, 1, None]
        x1, y1 = self.corners.T
        x2, y2 = np.roll(self.corners, -1, axis=0).T
        straddles = (x1 > x) != (x2 > x)
        with np.errstate(divide="ignore", invalid="ignore"):
            crossing = y1 + (x - x1) * (y2 - y1) / (x2 - x1)
        inside: Flags = np.count_nonzero(straddles & (crossing > y), axis=1) % 2 == 1
        return inside


class Fence(NamedTuple):
    """All zones, and the cylinder about home; empty: no bounds."""

    within: tuple[Circle | Polygon, ...] = ()
    without: tuple[Circle | Polygon, ...] = ()
    reach: float = 0.0  # level distance from home [m]; 0: any
    ceiling: float = 0.0  # height above home [m]; 0: any
    home: Point = (0.0, 0.0, 0.0)  # world NWU [m]

    def breach(self, points: Sequence[Point]) -> Breach | None:
        """The first thing wrong with any of the points, world NWU [m]."""
        p = np.array(points)
        if self.ceiling > 0.0 and p[:, 2].max() - self.home[2] > self.ceiling:
            return Breach(mavlink.FENCE_BREACH_MAXALT, f"higher than {self.ceiling:g} m above home")
        if self.reach > 0.0 and np.hypot(p[:, 0] - self.home[0], p[:, 1] - self.home[1]).max() > self.reach:
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, f"farther than {self.reach:g} m from home")
        if self.within and not np.any([zone.contains(p) for zone in self.within], axis=0).all():
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, "outside the fence")
        if any(zone.contains(p).any() for zone in self.without):
            return Breach(mavlink.FENCE_BREACH_BOUNDARY, "in a zone to stay out of")
        return None


def make_fence(items: Sequence[MissionItem], frame: LocalFrame) -> Fence | Refusal:
    """The fence that mission items of type FENCE describe, or why they are not valid."""
    within: list[Circle | Polygon] = []
    without: list[Circle | Polygon] = []
    seq = 0
    while seq < len(items):
        item = items[seq]
        made = _circle(seq, item, frame) if item.command in CIRCLES else _polygon(seq, items, frame)
        if isinstance(made, Refusal):
            return made
        inclusion = CIRCLES[item.command] if item.command in CIRCLES else VERTICES[item.command]
        (within if inclusion else without).append(made)
        seq += len(made.corners) if isinstance(made, Polygon) else 1
    return Fence(tuple(within), tuple(without))


def _circle(seq: int, item: MissionItem, frame: LocalFrame) -> Circle | Refusal:
    radius = item.params[0]
    if not 0.0 < radius <= LARGEST:
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM1, f"fence item {seq}: {radius:g} m is no radius")
    centre = _place(seq, item, frame)
    return centre if isinstance(centre, Refusal) else Circle(centre, radius)


def _polygon(seq: int, items: Sequence[MissionItem], frame: LocalFrame) -> Polygon | Refusal:
    first = items[seq]
    if first.command not in VERTICES:
        code = mavlink.MAV_MISSION_UNSUPPORTED
        return Refusal(code, f"fence item {seq}: command {first.command} is not supported in a fence")
    count = first.params[0]
    if not (3 <= count <= len(items) - seq and count == int(count)):
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM1, f"fence item {seq}: {count:g} corners are no polygon here")
    corners = []
    for index in range(seq, seq + int(count)):
        item = items[index]
        if item.command != first.command or item.params[0] != count:
            code = mavlink.MAV_MISSION_INVALID_SEQUENCE
            return Refusal(code, f"fence item {index}: no corner {index - seq + 1} of {count:g} of its polygon")
        corner = _place(index, item, frame)
        if isinstance(corner, Refusal):
            return corner
        corners.append(corner)
    return Polygon(np.array(corners))


def _place(seq: int, item: MissionItem, frame: LocalFrame) -> tuple[float, float] | Refusal:
    if not is_global_frame(item.frame):
        code = mavlink.MAV_MISSION_UNSUPPORTED_FRAME
        return Refusal(code, f"fence item {seq}: frame {item.frame} is not supported")
    latitude, longitude = from_e7(item.x), from_e7(item.y)
    if UNKNOWN_INT32 in {item.x, item.y} or abs(latitude) > 90.0 or abs(longitude) > 180.0:
        return Refusal(mavlink.MAV_MISSION_INVALID_PARAM5_X, f"fence item {seq}: it needs a position on the globe")
    return level(latitude, longitude, frame)


def way_to_a_stop(view: View) -> list[Point]:
    """Points from where the vehicle is to where it can stand still, world NWU [m]."""
    speed = math.hypot(view.v[0], view.v[1])
    seconds = HOVER_STOP
    if view.forward and speed > 1.0:
        seconds = REACTION + view.stopping / speed
    ahead = [seconds * view.v[0], seconds * view.v[1], HOVER_STOP * max(view.v[2], 0.0)]
    count = 1 + math.ceil(math.hypot(*ahead) / SPACING)
    return [
        (view.p[0] + share * ahead[0], view.p[1] + share * ahead[1], view.p[2] + share * ahead[2])
        for share in np.linspace(0.0, 1.0, count + 1).tolist()
    ]


@dataclass(slots=True)
class FenceWatch:
    """Tells each breach once: it begins when the way to a stop leaves the fence, and ends when it was kept a while."""

    breached: bool = False
    count: int = 0
    kind: int = 0  # FENCE_BREACH of the last one
    time: float = 0.0  # when it began [s]
    _last: float = 0.0  # when the fence was not kept [s]

    def check(self, view: View, fence: Fence) -> Breach | None:
        """A breach that begins now, or None.

        Args:
            view: The vehicle as it is now.
            fence: Where it may be.
        """
        breach = fence.breach(way_to_a_stop(view))
        if breach is None:
            self.breached = self.breached and view.time - self._last < WELL_AGAIN
            return None
        self._last = view.time
        if self.breached:
            return None
        here = fence.breach([view.p])
        self.breached, self.kind, self.time = True, breach.kind, view.time
        self.count += 1
        return breach if here is not None else breach._replace(text=f"about to be {breach.text}")
