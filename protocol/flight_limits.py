"""Limits of this project's vehicle that both ends must know."""

from __future__ import annotations

__all__ = [
    "LEGS_AHEAD",
    "MAX_AIRSPEED",
    "MAX_PLAN_FILE",
    "MAX_PLAN_ITEMS",
    "MIN_AIRSPEED",
    "MIN_CORNERS",
    "MIN_FORWARD_HEIGHT",
]

MIN_FORWARD_HEIGHT = 3.0
"""Least height of forward flight, and of a front transition [m]."""

MIN_AIRSPEED = 7.0
"""Least airspeed of the cruise: slower speeds are those of the hover [m/s]."""

MAX_AIRSPEED = 22.0
"""Greatest airspeed of the cruise [m/s]."""

LEGS_AHEAD = 8
"""Legs without a stop between them that the vehicle looks ahead, and the most it is asked about."""

MAX_PLAN_ITEMS = 1000
"""Items of a mission, a fence or a set of rally points."""

MAX_PLAN_FILE = 1_000_000
"""Bytes of a file of a flight plan, on the wire and on the disk."""

MIN_CORNERS = 3
"""Corners of a polygon: of a fence, or of a flight plan's sector."""
