"""The net that the vehicle flies under, on the map and in numbers."""

from __future__ import annotations

import math

from darko_gcs.state.snapshot import Snapshot
from darko_gcs.state.values import NetArena

Place = tuple[float, float]  # north, east [m]
SQUARE = math.radians(0.5)  # from north or east, within which a net's sides are told by them


def net_corners(s: Snapshot) -> tuple[Place, ...]:
    """Corners of the net on the ground, in order, the first one in front and on the left; empty without one."""
    if s.arena is None:
        return ()
    c, r = math.cos(s.arena.heading), math.sin(s.arena.heading)
    ahead, aside = s.arena.length / 2.0, s.arena.width / 2.0
    own = [
        (s.arena.centre[0] + c * x - r * y, s.arena.centre[1] + r * x + c * y)
        for x, y in ((ahead, -aside), (ahead, aside), (-ahead, aside), (-ahead, -aside))
    ]
    placed = [s.position.from_vehicle_frame((*place, 0.0)) for place in own]
    return tuple(place[:2] for place in placed if place is not None)


def net_label(arena: NetArena) -> str:
    """A net on the map: "net 7 m high"."""
    return f"net {arena.height:g} m high"


def net_words(s: Snapshot) -> str:
    """The net's size and place, and what targets it leaves room for; empty without one."""
    arena = s.arena
    if arena is None:
        return ""
    size = f"{arena.name}: net {arena.length:g} x {arena.width:g} m, {arena.height:g} m high"
    ahead, aside = (max(side / 2.0 - arena.margin, 0.0) for side in (arena.length, arena.width))
    top = max(arena.height - arena.margin, 0.0)
    if abs(math.remainder(arena.heading, math.pi)) < SQUARE:
        north, east = arena.centre
        room = f"{_span(north, ahead, ('north', 'south'))}, {_span(east, aside, ('east', 'west'))}"
    else:
        course = math.degrees(arena.heading) % 360.0
        room = f"{ahead:.1f} m from its centre along {course:.0f} deg, {aside:.1f} m across"
    return f"{size}. Targets: {room}, 0 to {top:.1f} m up"


def _span(centre: float, reach: float, names: tuple[str, str]) -> str:
    """The ends of the room for targets on one axis: "3.8 m north to 3.8 m south"."""
    ends = [centre + reach, centre - reach]
    return " to ".join(f"{abs(end):.1f} m {names[end < 0.0]}" for end in ends)
