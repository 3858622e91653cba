"""Fence and rally points as shapes in the vehicle's local frame, and what a mission's legs cross of them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from typing import NamedTuple

from darko_gcs.state.map_overlay import Overlay
from darko_gcs.state.mission_legs import LOW_WARNING, MissionLeg, legs_to
from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import Items
from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.names import is_global_frame
from protocol.plans import MissionItem
from protocol.plans.item_circles import COMPASS
from protocol.ranges import MIN_CORNERS
from protocol.units import from_e7, from_local_e4

Place = tuple[float, float]  # north, east [m]

# State on the map by command: "fence" to stay inside, "keep-out" to stay outside.
POLYGON_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_POLYGON_VERTEX_EXCLUSION: "keep-out",
}
BLOCKED_WARNING, OUTSIDE_WARNING = "BLOCKED: ", "OUTSIDE: "  # before legs that must not be flown
CROSSED_WARNING = "CROSSED: "  # before a polygon of the fence that nobody can tell the inside of
WARNINGS = (LOW_WARNING, BLOCKED_WARNING, OUTSIDE_WARNING, CROSSED_WARNING)
CIRCLE_STATES = {
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_INCLUSION: "fence",
    mavlink.MAV_CMD_NAV_FENCE_CIRCLE_EXCLUSION: "keep-out",
}


def polygon_spans(fence: Items) -> Iterator[range]:
    """Numbers of the items of each complete polygon."""
    begin = 0
    while begin < len(fence):
        item = fence[begin]
        count = int(item.params[0]) if item.command in POLYGON_STATES and item.params[0] >= 1.0 else 1
        corners = fence[begin : begin + count]
        if item.command in POLYGON_STATES and len(corners) == count >= MIN_CORNERS:
            yield range(begin, begin + count)
        begin += count


def fence_polygons(s: Snapshot) -> list[tuple[tuple[Place, ...], str]]:
    """Corners and state of every polygon of the fence; incomplete polygons are left out."""
    fence = s.plans.fence
    placed = [(_positions(s, fence[span.start : span.stop]), span) for span in polygon_spans(fence)]
    return [
        (corners, POLYGON_STATES[fence[span.start].command]) for corners, span in placed if len(corners) == len(span)
    ]


def fence_circles(s: Snapshot) -> list[tuple[float, float, float, str]]:
    """North, east, radius [m] and state of every circle of the fence."""
    placed = ((item, item_position(s, item)) for item in s.plans.fence if item.command in CIRCLE_STATES)
    return [(*place, item.params[0], CIRCLE_STATES[item.command]) for item, place in placed if place is not None]


def rally_points(s: Snapshot) -> list[Place]:
    """North and east [m] of every rally point."""
    return list(_positions(s, s.plans.rally))


def _positions(s: Snapshot, items: Iterable[MissionItem]) -> tuple[Place, ...]:
    return tuple(place for place in (item_position(s, item) for item in items) if place is not None)


def item_position(s: Snapshot, item: MissionItem) -> Place | None:
    """North and east [m]; None for an item without a place, or until home is known."""
    if (item.x == 0 and item.y == 0 and is_global_frame(item.frame)) or item.frame == mavlink.MAV_FRAME_MISSION:
        return None
    if not is_global_frame(item.frame):
        x, y = from_local_e4(item.x), from_local_e4(item.y)
        here = s.position.from_vehicle_frame((y, x, 0.0) if item.frame == mavlink.MAV_FRAME_LOCAL_ENU else (x, y, 0.0))
        return None if here is None else here[:2]
    local = s.position.local(Geodetic(from_e7(item.x), from_e7(item.y), 0.0))
    return None if local is None else local[:2]


class Obstacle(NamedTuple):
    """An area that no leg may lead through below its top."""

    corners: tuple[Place, ...]
    top: float  # above home [m]; infinite for a fence


CIRCLE_CORNERS = 36  # of a circle as a polygon around it


def obstacles(s: Snapshot, overlay: Overlay) -> list[Obstacle]:
    """Areas of the fence to stay outside of, and areas of the overlay that have a height."""
    found = [Obstacle(corners, math.inf) for corners, state in fence_polygons(s) if state == "keep-out"]
    found += [Obstacle(_ring(circle), math.inf) for *circle, state in fence_circles(s) if state == "keep-out"]
    for shape in overlay:
        corners = [s.position.local(point) for point in shape.points] if shape.top is not None else []
        if shape.top is not None and len(corners) >= MIN_CORNERS:
            found.append(Obstacle(tuple(corner[:2] for corner in corners if corner is not None), shape.top))
    return [obstacle for obstacle in found if len(obstacle.corners) >= MIN_CORNERS]


def _ring(circle: Sequence[float]) -> tuple[Place, ...]:
    north, east, radius = circle
    around = radius / math.cos(math.pi / CIRCLE_CORNERS)
    angles = (2.0 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS))
    return tuple((north + around * math.cos(angle), east + around * math.sin(angle)) for angle in angles)


def blocked_legs(s: Snapshot, legs: Sequence[MissionLeg], ahead: Sequence[Obstacle]) -> tuple[int, ...]:
    """Items whose legs lead through an obstacle; a leg is as low as the lower of its ends.

    Args:
        s: Has the height of home.
        legs: Of the mission.
        ahead: The obstacles.
    """
    home_down = s.position.home_p[2]
    return tuple(
        leg.seq
        for leg in legs
        if any(
            home_down - max(leg.start[2], leg.end[2]) < obstacle.top
            and crosses((leg.start[0], leg.start[1]), (leg.end[0], leg.end[1]), obstacle.corners)
            for obstacle in ahead
        )
    )


def blocked_circles(s: Snapshot, legs: Sequence[MissionLeg], ahead: Sequence[Obstacle]) -> tuple[int, ...]:
    """Items whose circles lead through an obstacle; arguments as above."""
    home_down = s.position.home_p[2]
    return tuple(
        leg.seq
        for leg in legs
        if any(
            home_down - leg.end[2] < obstacle.top
            and any(crosses(a, b, obstacle.corners) for a, b in pairwise((*rim(leg), *rim(leg)[:1])))
            for obstacle in ahead
        )
    )


def rim(leg: MissionLeg) -> tuple[Place, ...]:
    """Points of the circle about a leg's end [m], as the vehicle looks at them; none without a circle."""
    if leg.circle == 0.0:
        return ()
    return tuple((leg.end[0] + leg.circle * north, leg.end[1] + leg.circle * east) for north, east in COMPASS)


LEG_SPACING = 2.0  # of the places of a leg that are looked at where it may leave the fence [m]
MAX_PLACES = 500  # of one leg


class Bounds(NamedTuple):
    """Places where a fence lets a vehicle be, its areas to stay out of aside."""

    polygons: tuple[tuple[Place, ...], ...] = ()  # at least one area has a place in it, if there are any
    circles: tuple[tuple[Place, float], ...] = ()  # centre, radius [m]
    home: Place = (0.0, 0.0)
    home_down: float = 0.0  # [m]
    max_distance: float = 0.0  # level, from home [m]; 0: any
    max_height: float = 0.0  # above home [m]; 0: any

    @property
    def is_empty(self) -> bool:
        """Whether it bounds nothing."""
        return not (self.polygons or self.circles or self.max_distance > 0.0 or self.max_height > 0.0)

    def has(self, place: Place, down: float) -> bool:
        """Whether a vehicle may be at a place, in the height of ``down`` [m]."""
        if 0.0 < self.max_height < self.home_down - down - TOLERANCE:
            return False
        if 0.0 < self.max_distance < math.dist(place, self.home) - TOLERANCE:
            return False
        within = any(is_inside(place, corners) for corners in self.polygons)
        within = within or any(math.dist(place, centre) <= radius for centre, radius in self.circles)
        return within or not (self.polygons or self.circles)

    def has_leg(self, leg: MissionLeg) -> bool:
        """Whether a leg stays within: its end, and where it began within, the way there."""
        start, end, down = (leg.start[0], leg.start[1]), (leg.end[0], leg.end[1]), leg.end[2]
        if not self.has(end, down):
            return False
        is_crossed = any(
            _meet(start, end, a, b) for corners in self.polygons for a, b in pairwise((*corners, corners[0]))
        )
        if not (is_crossed or self.circles) or not self.has(start, down):
            return True
        count = min(1 + int(math.dist(start, end) / LEG_SPACING), MAX_PLACES)
        shares = (k / count for k in range(1, count))
        places = ((start[0] + k * (end[0] - start[0]), start[1] + k * (end[1] - start[1])) for k in shares)
        return all(self.has(place, down) for place in places)


TOLERANCE = 0.01  # of distances that come as float32 and whole steps of the wire [m]
DISTANCE_LIMIT, HEIGHT_LIMIT = "GF_MAX_HOR_DIST", "GF_MAX_VER_DIST"  # parameters of the vehicle


def fence_bounds(s: Snapshot) -> Bounds:
    """The bounds that the fence and its parameters set to the vehicle, as far as they are known."""
    values, home = s.parameters.values, s.position.home_p
    return Bounds(
        polygons=tuple(corners for corners, state in fence_polygons(s) if state == "fence"),
        circles=tuple(((north, east), r) for north, east, r, state in fence_circles(s) if state == "fence"),
        home=(home[0], home[1]),
        home_down=home[2],
        max_distance=values.get(DISTANCE_LIMIT, 0.0),
        max_height=values.get(HEIGHT_LIMIT, 0.0),
    )


def leaving_legs(s: Snapshot, legs: Sequence[MissionLeg]) -> tuple[int, ...]:
    """Items whose legs end outside the fence, or leave it on their way; none where nothing bounds the flight."""
    bounds = fence_bounds(s)
    return () if bounds.is_empty else tuple(leg.seq for leg in legs if not bounds.has_leg(leg))


def leaving_circles(s: Snapshot, legs: Sequence[MissionLeg]) -> tuple[int, ...]:
    """Items whose circles are partly outside the fence."""
    bounds = fence_bounds(s)
    return (
        ()
        if bounds.is_empty
        else tuple(leg.seq for leg in legs if not all(bounds.has(place, leg.end[2]) for place in rim(leg)))
    )


FENCE_PARAMETER = "GF_ACTION"
FENCE_ACTIONS = {1.0: "warns", 2.0: "holds", 3.0: "returns", 4.0: "ends the flight", 5.0: "lands"}


def obedience_words(s: Snapshot, *, has_fence: bool, has_rally: bool) -> str:
    """Words for what a vehicle does with limits as soon as it has them, with a space before; empty without limits."""
    action = s.parameters.values.get(FENCE_PARAMETER)
    if not has_fence or action is None:
        them = {(True, True): "fence and rally points", (True, False): "the fence", (False, True): "the rally points"}
        limits = them.get((has_fence, has_rally), "")
        return f" The vehicle obeys {limits} at once." if limits else ""
    does = FENCE_ACTIONS.get(action)
    if does is None:
        return f" The vehicle ignores the fence ({FENCE_PARAMETER} {action:g})."
    rally = ", and a return may end at a rally point" if has_rally else ""
    return f" From now on the vehicle {does} at the fence ({FENCE_PARAMETER}){rally}."


def fence_breaches(s: Snapshot) -> list[str]:
    """Places that the fence would forbid at once, in words: the vehicle's, and its home."""
    places = {"THE VEHICLE IS": s.position.p, "HOME IS": None if s.position.home is None else s.position.home_p}
    polygons = fence_polygons(s)
    circles = [(circle[:2], circle[2], circle[3]) for circle in fence_circles(s)]
    words = []
    for what, p in places.items():
        if p is None:
            continue
        place = (p[0], p[1])
        held = [(state, is_inside(place, corners)) for corners, state in polygons]
        held += [(state, math.dist(place, middle) <= radius) for middle, radius, state in circles]
        if ("keep-out", True) in held:
            words.append(f"{what} IN AN AREA TO STAY OUT OF")
        inside = [is_in for state, is_in in held if state == "fence"]
        if inside and not any(inside):
            words.append(f"{what} OUTSIDE THE FENCE")
    return words


class LegDangers(NamedTuple):
    """Items whose legs, or the circles at their ends, must not be flown."""

    blocked: tuple[int, ...] = ()  # lead through an obstacle
    outside: tuple[int, ...] = ()  # end outside the fence, or leave it on their way
    crossed: tuple[int, ...] = ()  # first items of polygons of the fence whose sides cross each other
    blocked_circles: tuple[int, ...] = ()
    outside_circles: tuple[int, ...] = ()
    limits: str = ""  # parameters of the fence that a leg exceeds, with their values

    @property
    def warned(self) -> tuple[int, ...]:
        """All items with a danger."""
        return (*self.blocked, *self.outside, *self.blocked_circles, *self.outside_circles)

    @property
    def words(self) -> list[str]:
        """A warning for each kind."""
        blocked, outside = _named(self.blocked, self.blocked_circles), _named(self.outside, self.outside_circles)
        which = ", ".join(map(str, self.crossed))
        crossed = [f"{CROSSED_WARNING}the fence's polygon from item {which} crosses itself"] if self.crossed else []
        return [
            *([f"{BLOCKED_WARNING}{blocked} through an obstacle"] if blocked else []),
            *([f"{OUTSIDE_WARNING}{outside} outside the fence{self.limits}"] if outside else []),
            *crossed,
        ]


def _named(legs: Sequence[int], circles: Sequence[int]) -> str:
    """Legs and circles by their items: "legs to 0, 2 and circle of 4"; a leg that is named needs no circle."""
    rest = [seq for seq in circles if seq not in legs]
    turned = f"{'circle' if len(rest) == 1 else 'circles'} of {', '.join(map(str, rest))}" if rest else ""
    return " and ".join(filter(None, (legs_to(legs) if legs else "", turned)))


def leg_dangers(s: Snapshot, legs: Sequence[MissionLeg], overlay: Overlay) -> LegDangers:
    """The legs that must not be flown.

    Args:
        s: Has home and the fence.
        legs: Of the mission.
        overlay: Its areas that have a height are obstacles.
    """
    ahead, bounds = obstacles(s, overlay), fence_bounds(s)
    return LegDangers(
        blocked=blocked_legs(s, legs, ahead),
        outside=leaving_legs(s, legs),
        crossed=crossed_polygons(s),
        blocked_circles=blocked_circles(s, legs, ahead),
        outside_circles=leaving_circles(s, legs),
        limits=_exceeded(bounds, legs),
    )


def _exceeded(bounds: Bounds, legs: Sequence[MissionLeg]) -> str:
    """Parameters of the fence that legs or circles exceed: " (GF_MAX_HOR_DIST 100 m)"."""
    parts = ((DISTANCE_LIMIT, bounds.max_distance), (HEIGHT_LIMIT, bounds.max_height))
    single = (
        bounds._replace(polygons=(), circles=(), max_height=0.0),
        Bounds(home_down=bounds.home_down, max_height=bounds.max_height),
    )
    names = [
        f"{name} {value:g} m"
        for (name, value), bound in zip(parts, single, strict=True)
        if not all(bound.has(place, leg.end[2]) for leg in legs for place in ((leg.end[0], leg.end[1]), *rim(leg)))
    ]
    return f" ({', '.join(names)})" if names else ""


def crossed_polygons(s: Snapshot) -> tuple[int, ...]:
    """First items of the polygons of the fence whose sides cross each other."""
    spans = list(polygon_spans(s.plans.fence))
    placed = [(span.start, _positions(s, s.plans.fence[span.start : span.stop])) for span in spans]
    return tuple(start for start, corners in placed if _crosses_itself(corners))


def _crosses_itself(corners: Sequence[Place]) -> bool:
    sides = list(pairwise((*corners, *corners[:1])))
    apart = ((a, b) for k, a in enumerate(sides) for b in sides[k + 2 : len(sides) - (k == 0)])
    return any(_meet(*a, *b) for a, b in apart)


def crosses(start: Place, end: Place, corners: Sequence[Place]) -> bool:
    """Whether a straight leg enters a polygon, ends in it or begins in it."""
    edges = pairwise((*corners, corners[0]))
    return is_inside(start, corners) or any(_meet(start, end, a, b) for a, b in edges)


def is_inside(place: Place, corners: Sequence[Place]) -> bool:
    """Whether a place lies in a polygon: a ray to the east crosses its border an odd number of times."""
    inside = False
    for (north, east), (other_north, other_east) in pairwise((*corners, corners[0])):
        if (north > place[0]) != (other_north > place[0]):
            share = (place[0] - north) / (other_north - north)
            inside ^= place[1] < east + share * (other_east - east)
    return inside


def _meet(start: Place, end: Place, a: Place, b: Place) -> bool:
    """Whether two segments have a point in common."""
    for one, two, three, four in zip(start, end, a, b, strict=True):
        if max(one, two) < min(three, four) or max(three, four) < min(one, two):
            return False  # also on one line, where the sides below tell nothing
    return _side(start, end, a) * _side(start, end, b) <= 0.0 and _side(a, b, start) * _side(a, b, end) <= 0.0


def _side(start: Place, end: Place, place: Place) -> float:
    return (end[0] - start[0]) * (place[1] - start[1]) - (end[1] - start[1]) * (place[0] - start[0])
