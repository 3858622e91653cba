"""A plan as the files carry it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from protocol.frames import Geodetic
from protocol.plans.mission import MissionItem

__all__ = ["Plan"]


@dataclass(frozen=True)
class Plan:
    """Mission items and what a plan file says beside them."""

    items: tuple[MissionItem, ...] = ()
    planned_home: Geodetic | None = None
    cruise_speed: float = 15.0  # [m/s]
    hover_speed: float = 3.0  # [m/s]
    # Parts of a .plan that nothing here interprets: kept as they are, so that saving loses nothing.
    geo_fence: dict[str, Any] = field(default_factory=lambda: {"circles": [], "polygons": [], "version": 2})
    rally_points: dict[str, Any] = field(default_factory=lambda: {"points": [], "version": 2})
