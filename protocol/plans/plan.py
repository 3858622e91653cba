"""A plan as in the files."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from protocol.dialect import mavlink
from protocol.frames import Geodetic
from protocol.plans.mission_item import MissionItem

__all__ = ["Plan"]


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Mission items and the other content of a plan file.

    Item k of ``items`` is mission item k on the wire; the home position is not one of them. Content that is not
    interpreted is stored unchanged, so that saving loses nothing.
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
    item_keys: tuple[dict[str, Any], ...] = ()  # one table for each item, or () if all are empty
    source: Path | None = field(default=None, compare=False)  # the file it was loaded from
