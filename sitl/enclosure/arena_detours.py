"""Detours in an arena, as the autopilot asks for them: :mod:`sitl.enclosure.detours` where there are obstacles.

Elsewhere every straight way is free, and the libraries of geometry, which take 0.3 s, are not loaded.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from protocol.plans.plan import Refusal
from sitl.enclosure.arena_files import Arena, Obstacle, Place

if TYPE_CHECKING:
    from sitl.enclosure.detours import Detour


def detour(arena: Arena, start: Place, end: Place, clearance: float, *, level: bool = False) -> Detour | Refusal:
    """See :func:`sitl.enclosure.detours.detour`."""
    if not arena.obstacles:
        return (end,)
    from sitl.enclosure import detours  # noqa: PLC0415 - see above

    return detours.detour(arena, start, end, clearance, level=level)


def crossed(arena: Arena, start: Place, end: Place, clearance: float) -> list[Obstacle]:
    """See :func:`sitl.enclosure.detours.crossed`."""
    if not arena.obstacles:
        return []
    from sitl.enclosure import detours  # noqa: PLC0415 - see above

    return detours.crossed(arena, start, end, clearance)


def crosses_area(arena: Arena, corners: Iterable[Place], clearance: float) -> bool:
    """See :func:`sitl.enclosure.detours.crosses_area`."""
    if not arena.obstacles:
        return False
    from sitl.enclosure import detours  # noqa: PLC0415 - see above

    return detours.crosses_area(arena, corners, clearance)


def crosses_circle(arena: Arena, p: Place, centre: Place, radius: float, clearance: float) -> bool:
    """See :func:`sitl.enclosure.detours.crosses_circle`."""
    if not arena.obstacles:
        return False
    from sitl.enclosure import detours  # noqa: PLC0415 - see above

    return detours.crosses_circle(arena, p, centre, radius, clearance)


def prepare_detours(arena: Arena) -> None:
    """Load what the first detour would load in flight."""
    if arena.obstacles:
        from sitl.enclosure import detours  # noqa: F401, PLC0415 - see above
