"""The geofence: where the vehicle may be, and whether it will stay there.

There are zones to stay in and zones to stay out of, polygons and circles. The vehicle must be in at least one zone to
stay in, if there are any, and in no zone to stay out of. Two parameters add a cylinder about home. Zones, like all
positions here, are in the world frame NWU.

In forward flight the vehicle cannot stop at once. So not only its position is checked but also the path to where it
can stand still: the fence is breached when that path leaves it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from protocol.dialect import mavlink
from sitl.control.reference import Point
from sitl.guidance.view import VehicleView
from sitl.model.airframe import Array

SPACING = 2.0  # of the points checked on the path to a stop [m]
HOVER_STOP_DURATION = 1.5  # a hovering vehicle stands still after this time at its speed [s]
REACTION_TIME = 0.3  # until an order to stop has an effect in forward flight [s]
BREACH_HOLD_TIME = 1.0  # a breach is over when there was none for this long [s]

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


def path_to_stop(view: VehicleView) -> list[Point]:
    """Points from where the vehicle is to where it can stand still, world NWU [m]."""
    speed = math.hypot(view.v[0], view.v[1])
    seconds = HOVER_STOP_DURATION
    if view.forward and speed > 1.0:
        seconds = REACTION_TIME + view.stopping_distance / speed
    ahead = [seconds * view.v[0], seconds * view.v[1], HOVER_STOP_DURATION * max(view.v[2], 0.0)]
    count = 1 + math.ceil(math.hypot(*ahead) / SPACING)
    return [
        (view.p[0] + share * ahead[0], view.p[1] + share * ahead[1], view.p[2] + share * ahead[2])
        for share in np.linspace(0.0, 1.0, count + 1).tolist()
    ]


@dataclass(slots=True)
class FenceWatch:
    """Reports each breach once: it begins when the path to a stop leaves the fence, and ends after a while inside."""

    breached: bool = False
    count: int = 0
    kind: int = 0  # FENCE_BREACH of the last one
    time: float = 0.0  # when it began [s]
    _last: float = 0.0  # when there last was a breach [s]

    def check(self, view: VehicleView, fence: Fence) -> Breach | None:
        """A breach that begins now, or None.

        Args:
            view: The vehicle as it is now.
            fence: Where it may be.
        """
        breach = fence.breach(path_to_stop(view))
        if breach is None:
            self.breached = self.breached and view.time - self._last < BREACH_HOLD_TIME
            return None
        self._last = view.time
        if self.breached:
            return None
        here = fence.breach([view.p])
        self.breached, self.kind, self.time = True, breach.kind, view.time
        self.count += 1
        return breach if here is not None else breach._replace(text=f"about to be {breach.text}")
