"""The fence in flight: a breach is noticed before it happens.

In forward flight the vehicle cannot stop at once. So not only its position is checked but also the path straight on to
where it can stand still: the fence is breached when that path leaves it. A vehicle that follows its legs or its circle
turns, or stops, before: while it is on the way that was predicted for them, it may fly on as long as the way from how
it moves now stays inside, by a margin, to its end or to where a straight path to a stop does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from protocol.dialect.vocabulary import Law
from sitl.autopilot.path_watch import ALONG_PATH, distance_off_path, is_same_path
from sitl.autopilot.world import Breach, Fence
from sitl.control.reference import Path, Point
from sitl.guidance.circles import rim
from sitl.guidance.view import VehicleView
from sitl.guidance.way_ahead import WAY_STEP, Way, WayStretch, way_ahead

SPACING = 2.0  # of the points checked on the path to a stop [m]
HOVER_STOP_DURATION = 1.5  # a hovering vehicle stands still after this time at its speed [s]
REACTION_TIME = 0.3  # until an order to stop has an effect in forward flight [s]
BREACH_HOLD_TIME = 1.0  # a breach is over when there was none for this long [s]
OFF_WAY = 8.0  # farther from the way that was predicted, the vehicle does not follow it [m]
WAY_MARGIN = 10.0  # between a way and the fence as it is begun: error of tracking and of the prediction [m]
STOP_PIECES = 24  # of a straight path to a stop from a point of a way
PLACES_APART, STOPS_APART, RIM_APART = 2, 5, 3  # so many points of a way, and of a rim, are one that is looked at


def path_to_stop(view: VehicleView) -> list[Point]:
    """Points from where the vehicle is straight on to where it can stand still, world NWU [m]."""
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


def stays_inside(way: Way, view: VehicleView, fence: Fence) -> bool:
    """Whether a way stays inside a fence, by a margin, to its end or to where the vehicle can stop straight on.

    Args:
        way: From where the vehicle is.
        view: The vehicle as it is now.
        fence: Where it may be.
    """
    if not way.points:
        return False
    looked_at = (*way.points[::PLACES_APART], way.points[-1])
    places = [[point.p, *rim(point.p, WAY_MARGIN)[::RIM_APART]] for point in looked_at]
    inside = fence.allows(np.array(places).reshape(-1, 3)).reshape(len(places), -1).all(axis=1)
    if inside.all() and way.is_whole:
        return True
    begins = looked_at[: len(places) if inside.all() else int(np.argmin(inside))][::STOPS_APART]
    if not begins:
        return False
    p, v = np.array([point.p for point in begins]), np.array([point.v for point in begins])
    now, speed = math.hypot(view.v[0], view.v[1]), np.maximum(np.hypot(v[:, 0], v[:, 1]), 1.0)
    distance = REACTION_TIME * speed + view.stopping_distance * np.maximum((speed / max(now, 1.0)) ** 2, 1.0)
    shares = np.linspace(0.0, 1.0, STOP_PIECES + 1)
    stops = np.repeat(p[:, None, :], len(shares), axis=1)
    stops[:, :, :2] += (distance / speed)[:, None, None] * shares[None, :, None] * v[:, None, :]
    return bool(fence.allows(stops.reshape(-1, 3)).reshape(len(begins), -1).all(axis=1).any())


def way_outside(way: Way, fence: Fence) -> float:
    """Length of a way outside a fence [m]; infinite for one that leads nowhere."""
    points = [point.p for point in way.points]
    return WAY_STEP * _count_outside(points, fence) if points and way.is_whole else math.inf


def _count_outside(points: Sequence[Point], fence: Fence) -> int:
    return int(np.count_nonzero(~fence.allows(np.array(points))))


@dataclass(slots=True)
class _FollowedWay:
    """The way that was predicted as a leg or circle began, and whether the vehicle is on it."""

    _path: Path | None = None
    _points: list[Point] = field(default_factory=list)

    def is_followed(self, view: VehicleView, stretches: Sequence[WayStretch]) -> bool:
        """Whether the vehicle is on its way; to be called at every check.

        Args:
            view: The vehicle.
            stretches: That it flies.
        """
        if not (view.forward and stretches and view.law is Law.INDI):
            self._path = None
            return False
        path = stretches[0].path
        if self._path is None or not is_same_path(self._path, path):
            self._path = path
            self._points = [point.p for point in way_ahead(view, stretches).points]
        off, along = distance_off_path(path, view)
        if off < OFF_WAY and along > ALONG_PATH * math.hypot(view.v[0], view.v[1]):
            return True
        return any(math.dist(p[:2], view.p[:2]) < OFF_WAY for p in self._points)


@dataclass(slots=True)
class FenceWatch:
    """Reports each breach once: it begins when the path to a stop leaves the fence, and ends after a while inside."""

    breached: bool = False
    count: int = 0
    kind: int = 0  # FENCE_BREACH of the last one
    time: float = 0.0  # when it began [s]
    _last: float = 0.0  # when there last was a breach [s]
    _way: _FollowedWay = field(default_factory=_FollowedWay)
    _trusts: bool = False  # a stop straight on would leave the fence, the way that is flown does not

    def check(self, view: VehicleView, fence: Fence, stretches: Sequence[WayStretch] = ()) -> Breach | None:
        """A breach that begins now, or None.

        Args:
            view: The vehicle as it is now.
            fence: Where it may be.
            stretches: Legs or a circle that it flies by a plan; none in flight by hand.
        """
        is_followed = self._way.is_followed(view, stretches)
        breach = fence.breach(path_to_stop(view))
        is_due = breach is not None and is_followed and fence.breach([view.p]) is None
        self._trusts = is_due and self._flies_on(way_ahead(view, stretches), view, fence)
        breach = None if self._trusts else breach
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

    def _flies_on(self, way: Way, view: VehicleView, fence: Fence) -> bool:
        """Whether a way is better than a stop straight on, which would leave the fence.

        A vehicle that is beyond its last stop inside has only its turn: that is broken off where the stop is shorter
        outside.
        """
        if stays_inside(way, view, fence):
            return True
        return self._trusts and way_outside(way, fence) < SPACING * _count_outside(path_to_stop(view), fence)
