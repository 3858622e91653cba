"""The arenas that are shipped: the volume that the vehicle may be sent into."""

from __future__ import annotations

from sitl.enclosure.arena_files import load_arena, shipped_arenas

ARENAS = {name: load_arena(name) for name in shipped_arenas()}
