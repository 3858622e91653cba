"""Arenas: their net, obstacles and wind wall, and the TOML files that describe them."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from protocol.tools.files import decode_text
from sitl.enclosure.wind_wall import Outlet
from sitl.errors import SitlError
from sitl.model.airframe import Array
from sitl.model.vectors import Vector
from sitl.tools.toml_table import TomlTable

# Arenas from TOML files: every key is known and every value checked; docs/arena.md describes the format.

# Geometry of an arena in the world frame NWU: box, obstacles and wind wall, and the points it refuses.


Place = tuple[float, float, float]  # world NWU [m]
THE_NET = "the net"  # what it is called


class WindWall(NamedTuple):
    """A wall of fans, and what it blows when."""

    outlet: Outlet
    intensity: float  # of the turbulence in the core: deviation over mean speed [-]
    length: float  # of that turbulence [m]
    schedule: tuple[tuple[float, float], ...] = ()  # time [s], speed [m/s]; between two lines in proportion
    bursts: tuple[tuple[float, float, float], ...] = ()  # of 1-cos: begin [s], duration [s], rise [m/s]


class Obstacle(NamedTuple):
    """A box or a pillar that stands or hangs upright; a net is a thin box."""

    name: str
    is_round: bool
    north: float  # of its centre [m]
    west: float  # [m]
    course: float  # of its length, from north towards west [rad]
    half_length: float  # the radius of a pillar [m]
    half_width: float  # likewise [m]
    bottom: float  # [m]
    top: float  # [m]

    def blocks(self, low: float, high: float, clearance: float) -> bool:
        """Whether a flight between two heights comes nearer than a clearance from above or below [m]."""
        return high > self.bottom - clearance and low < self.top + clearance

    def gap(self, p: Place) -> float:
        """Distance of a point from it [m]; 0 inside."""
        x, y = p[0] - self.north, p[1] - self.west
        above = max(self.bottom - p[2], p[2] - self.top, 0.0)
        if self.is_round:
            return math.hypot(max(math.hypot(x, y) - self.half_length, 0.0), above)
        c, s = math.cos(self.course), math.sin(self.course)
        ahead, left = abs(x * c + y * s) - self.half_length, abs(y * c - x * s) - self.half_width
        return math.hypot(max(ahead, 0.0), max(left, 0.0), above)


NORTHWARD_SIDES = (("north", "south"), ("east", "west"))
TURNED_SIDES = (("ahead", "behind"), ("to the right", "to the left"))


class Arena(NamedTuple):
    """A box that stands on the ground; touching its sides, where they are a net, is a crash."""

    name: str
    half_length: float  # [m]
    half_width: float  # [m]
    height: float  # [m]
    north: float = 0.0  # of its centre [m]
    west: float = 0.0  # [m]
    course: float = 0.0  # of its length, from north towards west [rad]
    has_net: bool = False
    margin: float = 0.0  # how far inside of it requests must stay [m]
    clearance: float = 0.0  # how far from obstacles requests and ways must stay [m]
    obstacles: tuple[Obstacle, ...] = ()
    wall: WindWall | None = None
    origin: tuple[float, float, float] | None = None  # of the world frame: latitude, longitude [deg], altitude [m]

    def inside(self, p: Place) -> tuple[float, float]:
        """A point's place along the length and to the left of it, from the centre [m]."""
        x, y = p[0] - self.north, p[1] - self.west
        c, s = math.cos(self.course), math.sin(self.course)
        return x * c + y * s, y * c - x * s

    def outside(self, ahead: float, left: float) -> Place:
        """The point of the ground, world NWU [m], at a place along the length and to the left of it [m]."""
        c, s = math.cos(self.course), math.sin(self.course)
        return (self.north + ahead * c - left * s, self.west + ahead * s + left * c, 0.0)

    def room(self, p: Place) -> tuple[float, str]:
        """Distance of a point to the nearest thing to touch [m], negative beyond the net, and what that is."""
        ahead, left = self.inside(p)
        nearest = (math.inf, "")
        if self.has_net:
            away = min(self.half_length - abs(ahead), self.half_width - abs(left), self.height - p[2])
            nearest = (away, THE_NET)
        return min([nearest, *((obstacle.gap(p), obstacle.name) for obstacle in self.obstacles)])

    def keeps(self, at: tuple[float, float]) -> bool:
        """Whether a place, north and west [m], is inside by the margin."""
        ahead, left = self.inside((at[0], at[1], 0.0))
        return abs(ahead) <= self.half_length - self.margin and abs(left) <= self.half_width - self.margin

    def clamped(self, p: Place, further: float = 0.0) -> Place:
        """The nearest point to ``p`` that is inside by the margin and something more [m], where there is a net."""
        if not self.has_net:
            return p
        ahead, left = self.inside(p)
        inset = self.margin + further
        long, wide = max(self.half_length - inset, 0.0), max(self.half_width - inset, 0.0)
        at = self.outside(min(max(ahead, -long), long), min(max(left, -wide), wide))
        return (at[0], at[1], min(p[2], max(self.height - inset, 0.5 * self.height)))

    def refuse(self, p: Place) -> str | None:
        """The reason why the vehicle may not be sent to a point, world NWU [m]; None if it may."""
        ahead, left = self.inside(p)
        sides = NORTHWARD_SIDES if self.course == 0.0 else TURNED_SIDES
        for value, half, words in ((ahead, self.half_length, sides[0]), (-left, self.half_width, sides[1])):
            limit, side = half - self.margin, words[value < 0.0]
            if abs(value) > limit:
                return f"{abs(value):.1f} m {side} is outside the arena '{self.name}' (limit {limit:g} m)"
        if not 0.0 <= p[2] <= self.height - self.margin:
            return f"altitude {p[2]:.1f} m is outside the arena '{self.name}' (0 to {self.height - self.margin:g} m)"
        for obstacle in self.obstacles:
            if obstacle.gap(p) < self.clearance:
                return f"the point is {obstacle.gap(p):.1f} m from '{obstacle.name}', less than {self.clearance:g} m"
        return None


NET, BOX, PILLAR = 0.0, 1.0, 2.0  # kinds of rows of :func:`solids`


def solids(arena: Arena) -> Array:
    """Solids of an arena that can be touched, as the compiled loop takes them: a row each, its net first, (n, 9)."""
    rows = []
    if arena.has_net:
        rows.append(
            (NET, arena.north, arena.west, math.cos(arena.course), math.sin(arena.course), arena.half_length,
             arena.half_width, 0.0, arena.height)
        )  # fmt: skip
    for o in arena.obstacles:
        kind = PILLAR if o.is_round else BOX
        rows.append(
            (kind, o.north, o.west, math.cos(o.course), math.sin(o.course), o.half_length, o.half_width, o.bottom,
             o.top)
        )  # fmt: skip
    return np.array(rows, float).reshape(-1, 9)


def touched_name(arena: Arena, number: int) -> str:
    """Name of a row of :func:`solids`, counted from 1."""
    if arena.has_net and number == 1:
        return f"the net of {arena.name}"
    return arena.obstacles[number - 1 - arena.has_net].name


def outlet_of(north: float, west: float, up: float, course: float, width: float, height: float) -> Outlet:
    """A wind wall's outlet.

    Args:
        north: Of its centre [m].
        west: [m].
        up: [m].
        course: Where it blows, from north towards west [rad].
        width: [m].
        height: [m].
    """
    along = Vector(math.cos(course), math.sin(course), 0.0)
    return Outlet(Vector(north, west, up), along, 0.5 * width, 0.5 * height)


MAX_SIZE = 1e5  # of an arena [m]
MAX_OBSTACLES = 30
MAX_WALL_SPEED = 30.0  # of a wind wall [m/s]
NET_THICKNESS = 0.04  # [m]
MIN_OPENING = 0.2  # of a wind wall; and of an arena, of which as much must be left inside the margin [m]
ARENA_KEYS = {
    "name",
    "size",
    "centre",
    "heading",
    "net",
    "margin",
    "origin",
    "box",
    "pillar",
    "hanging_net",
    "wind_wall",
}
WALL_KEYS = {"place", "height", "size", "heading", "turbulence", "length", "schedule", "gusts"}
Table = Mapping[str, Any]


class ArenaError(SitlError):
    """An arena file cannot be used; the message names file, key and value."""


class _Frame(NamedTuple):
    """The arena's own axes: ahead along its length, and to the right of it."""

    north: float  # of the centre [m]
    west: float  # [m]
    course: float  # from north towards west [rad]

    def place(self, ahead: float, right: float) -> tuple[float, float]:
        """North and west of the world frame [m]."""
        c, s = math.cos(self.course), math.sin(self.course)
        return self.north + ahead * c + right * s, self.west + ahead * s - right * c


def shipped_arenas() -> list[str]:
    """Names of the arenas that are shipped."""
    names = [entry.name for entry in files("sitl.enclosure.arenas").iterdir()]
    return sorted(name.removesuffix(".toml") for name in names if name.endswith(".toml"))


@cache
def load_arena(name_or_path: str) -> Arena:
    """A shipped arena by its name, or one from a TOML file.

    Raises:
        ArenaError: If there is no such arena or its file is not valid; the message names file, key and value.
    """
    if name_or_path in shipped_arenas():
        name_or_path = str(files("sitl.enclosure.arenas") / f"{name_or_path}.toml")
    path = Path(name_or_path)
    try:
        raw = tomllib.loads(decode_text(path.read_bytes()))
    except OSError as error:
        known = ", ".join(shipped_arenas())
        raise ArenaError(f"arena {name_or_path}: {error.strerror}; shipped are {known}") from error
    except (tomllib.TOMLDecodeError, UnicodeError) as error:
        raise ArenaError(f"{path}: not a TOML file: {error}") from error
    return _arena(str(path), raw)


def _arena(file: str, raw: Table) -> Arena:
    top = TomlTable(file, raw, "", ARENA_KEYS, ArenaError)
    name = top.text("name")
    length, width, height = top.numbers("size", 3, MIN_OPENING, MAX_SIZE)
    north, east = top.numbers("centre", 2, -MAX_SIZE, MAX_SIZE, (0.0, 0.0))
    frame = _Frame(north, -east, -math.radians(top.number("heading", -360.0, 360.0, 0.0)))
    margin = top.number("margin", 0.0, MAX_SIZE, 0.0)
    if 2.0 * margin > min(length, width) - MIN_OPENING or margin > height - MIN_OPENING:
        raise top.error("margin", f"= {margin:g} leaves no room in {length:g} x {width:g} x {height:g} m")
    origin = None
    if top.has("origin"):
        place = TomlTable(file, top.table("origin"), "origin", {"latitude", "longitude", "altitude"}, ArenaError)
        origin = (
            place.number("latitude", -85.0, 85.0),
            place.number("longitude", -180.0, 180.0),
            place.number("altitude", -500.0, 9000.0),
        )
    obstacles = [_box(file, table, i, frame, height) for i, table in enumerate(top.tables("box"), 1)]
    obstacles += [_pillar(file, table, i, frame, height) for i, table in enumerate(top.tables("pillar"), 1)]
    obstacles += [_net(file, table, i, frame, height) for i, table in enumerate(top.tables("hanging_net"), 1)]
    if len(obstacles) > MAX_OBSTACLES:
        raise ArenaError(f"{file}: there are {len(obstacles)} obstacles, at most {MAX_OBSTACLES} are ways found past")
    _refuse_twins(top, obstacles)
    wall = _wall(file, top.table("wind_wall"), frame) if top.has("wind_wall") else None
    return Arena(
        name, 0.5 * length, 0.5 * width, height, *frame, top.flag("net"), margin, 0.0, tuple(obstacles), wall, origin
    )


def _refuse_twins(top: TomlTable, obstacles: list[Obstacle]) -> None:
    names = [obstacle.name for obstacle in obstacles]
    for name in names:
        if names.count(name) > 1:
            raise top.error("name", f"{name!r} is given to two obstacles")


def _band(table: TomlTable, height: float) -> tuple[float, float]:
    """Bottom and top of an obstacle [m]: from the ground to the ceiling unless it says otherwise."""
    bottom = table.number("bottom", 0.0, MAX_SIZE, 0.0)
    top = table.number("top", 0.0, MAX_SIZE, max(height, bottom + NET_THICKNESS))
    if top <= bottom:
        raise table.error("top", f"= {top:g} is not above its bottom at {bottom:g}")
    return bottom, top


def _box(file: str, raw: object, number: int, frame: _Frame, height: float) -> Obstacle:
    table = TomlTable(file, raw, f"box {number}", {"name", "place", "size", "heading", "bottom", "top"}, ArenaError)
    north, west = frame.place(*table.numbers("place", 2, -MAX_SIZE, MAX_SIZE))
    length, width = table.numbers("size", 2, NET_THICKNESS, MAX_SIZE)
    course = frame.course - math.radians(table.number("heading", -360.0, 360.0, 0.0))
    return Obstacle(table.text("name"), False, north, west, course, 0.5 * length, 0.5 * width, *_band(table, height))


def _pillar(file: str, raw: object, number: int, frame: _Frame, height: float) -> Obstacle:
    table = TomlTable(file, raw, f"pillar {number}", {"name", "place", "radius", "bottom", "top"}, ArenaError)
    north, west = frame.place(*table.numbers("place", 2, -MAX_SIZE, MAX_SIZE))
    radius = table.number("radius", 0.5 * NET_THICKNESS, MAX_SIZE)
    return Obstacle(table.text("name"), True, north, west, 0.0, radius, radius, *_band(table, height))


def _net(file: str, raw: object, number: int, frame: _Frame, height: float) -> Obstacle:
    table = TomlTable(file, raw, f"hanging_net {number}", {"name", "from", "to", "bottom", "top"}, ArenaError)
    start = frame.place(*table.numbers("from", 2, -MAX_SIZE, MAX_SIZE))
    end = frame.place(*table.numbers("to", 2, -MAX_SIZE, MAX_SIZE))
    length = math.dist(start, end)
    if length < NET_THICKNESS:
        raise table.error("to", "is where it begins")
    course = math.atan2(end[1] - start[1], end[0] - start[0])
    middle = 0.5 * (start[0] + end[0]), 0.5 * (start[1] + end[1])
    half = 0.5 * NET_THICKNESS
    return Obstacle(table.text("name"), False, *middle, course, 0.5 * length, half, *_band(table, height))


def _wall(file: str, raw: object, frame: _Frame) -> WindWall:
    table = TomlTable(file, raw, "wind_wall", WALL_KEYS, ArenaError)
    north, west = frame.place(*table.numbers("place", 2, -MAX_SIZE, MAX_SIZE))
    width, height = table.numbers("size", 2, MIN_OPENING, MAX_SIZE)
    course = frame.course - math.radians(table.number("heading", -360.0, 360.0))
    outlet = outlet_of(north, west, table.number("height", 0.5 * height, MAX_SIZE), course, width, height)
    schedule = [(time, speed) for time, speed in table.lines("schedule", 2)]
    if any(later[0] <= earlier[0] for earlier, later in itertools.pairwise(schedule)):
        raise table.error("schedule", "has times that do not increase")
    gusts = [(begin, duration, rise) for begin, duration, rise in table.lines("gusts", 3)]
    if any(duration <= 0.0 for _, duration, _ in gusts):
        raise table.error("gusts", "has one that lasts no time")
    if any(speed > MAX_WALL_SPEED for _, speed in schedule) or any(rise > MAX_WALL_SPEED for *_, rise in gusts):
        raise table.error("schedule", f"or gusts are faster than {MAX_WALL_SPEED:g} m/s")
    return WindWall(
        outlet=outlet,
        intensity=table.number("turbulence", 0.0, 1.0),
        length=table.number("length", 0.05, 100.0),
        schedule=tuple(schedule),
        bursts=tuple(gusts),
    )
