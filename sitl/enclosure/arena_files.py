"""Arenas from TOML files: every key is known and every value checked; docs/arena.md describes the format."""

from __future__ import annotations

import itertools
import math
import tomllib
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

from protocol.tools.files import decode_text
from sitl.enclosure.geometry import Arena, Obstacle, WindWall, outlet_of
from sitl.errors import SitlError
from sitl.tools.toml_table import TomlTable

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
