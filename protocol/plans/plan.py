"""A plan as the files carry it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans.mission import MissionItem

__all__ = ["Plan"]


@dataclass(frozen=True)
class Plan:
    """Mission items and what a plan file says beside them.

    Item k of ``items`` is mission item k on the wire; the home position is not one of them. What nothing here
    interprets is kept as the file has it, so that saving loses nothing.
    """

    items: tuple[MissionItem, ...] = ()
    planned_home: Geodetic | None = None
    cruise_speed: float = 15.0  # [m/s]
    hover_speed: float = 3.0  # [m/s]
    geo_fence: dict[str, Any] = field(default_factory=lambda: {"circles": [], "polygons": [], "version": 2})
    rally_points: dict[str, Any] = field(default_factory=lambda: {"points": [], "version": 2})
    file_keys: dict[str, Any] = field(default_factory=lambda: {"groundStation": "DarkO"})
    mission_keys: dict[str, Any] = field(
        default_factory=lambda: {
            "firmwareType": mavlink.MAV_AUTOPILOT_PX4,
            "vehicleType": mavlink.MAV_TYPE_VTOL_DUOROTOR,
        }
    )
    item_keys: tuple[dict[str, Any], ...] = ()  # one table for each item, or none when all would be empty
    source: Path | None = field(default=None, compare=False)  # the file it was loaded from
