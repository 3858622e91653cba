"""Detours round, over and under obstacles: straight pieces that keep a clearance, shortest by a visibility graph."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence

import networkx as nx
import numpy as np
import shapely
from shapely.geometry import LineString, Point, Polygon
from shapely.geometry.base import BaseGeometry

from protocol.plans.plan import Refusal
from sitl.enclosure.arena_files import Arena, Obstacle, Place

MIN_DETOUR_HEIGHT = 1.0  # no detour leads nearer to the ground [m]
SPARE = 0.02  # corners of a way keep so much more than the clearance [m]
TOUCH = 1e-6  # what is less far inside is not crossed [m]
INSIDE_COST = 10.0  # of a metre within the clearance, in metres outside
QUARTER = 2  # chords of a quarter circle about a corner
CHORD_GROWTH = 1.0 / math.cos(math.pi / (4 * QUARTER))  # puts those chords outside of the circle
Detour = tuple[Place, ...]


def detour(arena: Arena, start: Place, end: Place, clearance: float, *, level: bool = False) -> Detour | Refusal:
    """The corners of the shortest way between two points, its end among them; or why there is none.

    Args:
        arena: With the obstacles.
        start: World NWU [m].
        end: World NWU [m].
        clearance: From obstacles [m].
        level: Whether the height changes evenly along the way, as in forward flight, and nowhere else.
    """
    if not crossed(arena, start, end, clearance):
        return (end,)
    for obstacle in arena.obstacles:
        if obstacle.gap(end) < clearance - TOUCH:
            return Refusal(f"its end is within {clearance:g} m of {obstacle.name!r}")
    best, shortest = None, math.inf
    heights = _level_heights(start, end) if level else _heights(arena, start, end, clearance)
    for height in sorted(heights, key=lambda height: _least_length(start, end, height)):
        if _least_length(start, end, height) >= shortest:
            break
        route = _detour_at(arena, start, end, clearance, height, level=level)
        if route is not None and length_of((start, *route)) < shortest:
            best, shortest = route, length_of((start, *route))
    if best is None:
        names = ", ".join(repr(obstacle.name) for obstacle in crossed(arena, start, end, clearance))
        return Refusal(f"no way past {names} keeps {clearance:g} m from everything")
    return best


def _least_length(start: Place, end: Place, height: float) -> float:
    """Least length of a way at a height [m]."""
    return abs(height - start[2]) + math.dist(start[:2], end[:2]) + abs(height - end[2])


def length_of(points: Sequence[Place]) -> float:
    """Length of straight pieces [m]."""
    return sum(math.dist(a, b) for a, b in itertools.pairwise(points))


def crossed(arena: Arena, start: Place, end: Place, clearance: float) -> list[Obstacle]:
    """The obstacles that a straight piece comes nearer to than a clearance [m]."""
    return [obstacle for obstacle in arena.obstacles if _comes_near(obstacle, start, end, clearance)]


def crosses_area(arena: Arena, corners: Iterable[Place], clearance: float) -> bool:
    """Whether what is flown somewhere within the area between points can come nearer to an obstacle [m]."""
    points = list(corners)
    area = shapely.MultiPoint([point[:2] for point in points]).convex_hull
    low, high = min(point[2] for point in points), max(point[2] for point in points)
    return any(o.blocks(low, high, clearance) and _grown(o, clearance).intersects(area) for o in arena.obstacles)


def crosses_circle(arena: Arena, p: Place, centre: Place, radius: float, clearance: float) -> bool:
    """Whether a circle, or the straight way to its nearest point, comes nearer to an obstacle than a clearance [m]."""
    away = max(math.dist(p[:2], centre[:2]), TOUCH)
    share = radius / away
    rim = (centre[0] + share * (p[0] - centre[0]), centre[1] + share * (p[1] - centre[1]), centre[2])
    ring = Point(centre[:2]).buffer(radius).exterior
    on_it = [o for o in arena.obstacles if o.blocks(centre[2], centre[2], clearance)]
    return bool(crossed(arena, p, rim, clearance)) or any(_grown(o, clearance).intersects(ring) for o in on_it)


def outline(obstacle: Obstacle) -> BaseGeometry:
    """An obstacle from above, north and west [m]."""
    if obstacle.is_round:
        return Point(obstacle.north, obstacle.west)
    c, s = math.cos(obstacle.course), math.sin(obstacle.course)
    a, b = obstacle.half_length, obstacle.half_width
    corners = ((a, b), (a, -b), (-a, -b), (-a, b))
    return Polygon([(obstacle.north + x * c - y * s, obstacle.west + x * s + y * c) for x, y in corners])


def _grown(obstacle: Obstacle, clearance: float) -> BaseGeometry:
    radius = obstacle.half_length if obstacle.is_round else 0.0
    return outline(obstacle).buffer((radius + clearance) * CHORD_GROWTH, quad_segs=QUARTER)


def _comes_near(obstacle: Obstacle, start: Place, end: Place, clearance: float) -> bool:
    if not obstacle.blocks(min(start[2], end[2]), max(start[2], end[2]), clearance):
        return False
    shape = _grown(obstacle, clearance - TOUCH)
    if math.dist(start[:2], end[:2]) < TOUCH:
        return bool(shape.contains(Point(start[:2])))
    line = LineString([start[:2], end[:2]])
    if outline(obstacle).distance(line) - (obstacle.half_length if obstacle.is_round else 0.0) >= clearance - TOUCH:
        return False
    piece = shape.intersection(line)
    if piece.is_empty:
        return False
    shares = [line.project(Point(at), normalized=True) for at in shapely.get_coordinates(piece)]
    heights = [start[2] + share * (end[2] - start[2]) for share in (min(shares), max(shares))]
    return obstacle.blocks(min(heights), max(heights), clearance)


def _heights(arena: Arena, start: Place, end: Place, clearance: float) -> list[float]:
    """Heights to fly a way at: those of its ends, and just over and under every obstacle [m]."""
    tried = {start[2], end[2]}
    for obstacle in arena.obstacles:
        tried |= {obstacle.top + clearance + SPARE, obstacle.bottom - clearance - SPARE}
    ends = {start[2], end[2]}
    return sorted(h for h in tried if h in ends or MIN_DETOUR_HEIGHT <= h <= arena.height - arena.margin)


def _level_heights(start: Place, end: Place) -> list[float]:
    return [max(start[2], end[2])]


def _detour_at(
    arena: Arena, start: Place, end: Place, clearance: float, height: float, *, level: bool
) -> Detour | None:
    """The shortest way whose level part is at a height; None if there is none."""
    band = (min(start[2], end[2]), max(start[2], end[2])) if level else (height, height)
    here, there = (start[0], start[1], height), (end[0], end[1], height)
    if not level and (_rises_into(arena, start, here, clearance) or _rises_into(arena, end, there, clearance)):
        return None
    shapes = [_grown(o, clearance) for o in arena.obstacles if o.blocks(*band, clearance)]
    flat = _round(arena, shapes, start[:2], end[:2])
    if flat is None:
        return None
    if level:
        return (*((x, y, height) for x, y in flat[1:-1]), end)
    route = [here] * (here != start) + [(x, y, height) for x, y in flat[1:]] + [end] * (there != end)
    return tuple(route)


def _rises_into(arena: Arena, low: Place, high: Place, clearance: float) -> bool:
    """Whether going straight up or down leads nearer to an obstacle than where it begins."""
    return any(o.gap(low) >= clearance - TOUCH for o in crossed(arena, low, high, clearance))


def _round(
    arena: Arena, shapes: list[BaseGeometry], start: tuple[float, float], end: tuple[float, float]
) -> list[tuple[float, float]] | None:
    """The shortest level way round shapes, within the arena's margin."""
    if math.dist(start, end) < TOUCH:
        return [start]
    core = shapely.union_all(shapes).buffer(-TOUCH)
    outer = shapely.union_all([shape.buffer(SPARE, join_style="mitre") for shape in shapes])
    corners = [(float(x), float(y)) for x, y in shapely.get_coordinates(outer)]
    shapely.prepare(core)
    free = [c for c in corners if arena.keeps(c) and not core.contains(Point(c))]
    nodes = np.array(list(dict.fromkeys([start, end, *free])))
    first, second = np.triu_indices(len(nodes), 1)
    lines = shapely.linestrings(np.stack([nodes[first], nodes[second]], axis=1))
    is_free = ~shapely.intersects(core, lines)
    lengths = shapely.length(lines)
    if core.contains(Point(start)):  # too near already, it may leave: by the way that is least far inside
        within = shapely.length(shapely.intersection(lines, core))
        leaves = (first == 0) & (second != 1) & (within < lengths)
        is_free, lengths = is_free | leaves, np.where(leaves, lengths + INSIDE_COST * within, lengths)
    graph = nx.Graph()
    pairs = zip(first[is_free].tolist(), second[is_free].tolist(), lengths[is_free].tolist(), strict=True)
    graph.add_weighted_edges_from(pairs)
    try:
        route = nx.shortest_path(graph, 0, 1, weight="weight")
    except (nx.NetworkXNoPath, nx.NodeNotFound):
        return None
    return [(float(x), float(y)) for x, y in nodes[route]]
