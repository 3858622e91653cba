"""Geometry of an arena in the world frame NWU: box, obstacles and wind wall, and the points it refuses."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from sitl.enclosure.jet import Outlet
from sitl.model.airframe import Array
from sitl.model.vectors import Vector

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
