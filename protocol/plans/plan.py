"""Plans: mission, fence and rally points, and why one is refused."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from difflib import SequenceMatcher
from pathlib import Path
from typing import Any, NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.mavlink import MAV_MISSION_ERROR
from protocol.frames import Geodetic
from protocol.plans.complex_items import ComplexItem
from protocol.plans.mission_item import MissionItem

__all__ = [
    "Plan",
    "Refusal",
    "Validate",
]


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
    complex_items: tuple[ComplexItem, ...] = ()  # those that the items came from, in their order
    source: Path | None = field(default=None, compare=False)  # the file it was loaded from

    def with_items(self, items: Sequence[MissionItem]) -> Plan:
        """The plan with other mission items. Those that are as before keep what a file tells of them aside.

        Their ``doJumpId`` is not kept: items are numbered anew when the plan is saved.
        """
        keys: list[dict[str, Any]] = [{} for _ in items]
        if self.item_keys:
            for old, new, count in SequenceMatcher(None, self.items, items, autojunk=False).get_matching_blocks():
                keys[new : new + count] = [
                    {key: value for key, value in others.items() if key != "doJumpId"}
                    for others in self.item_keys[old : old + count]
                ]
        return replace(self, items=tuple(items), item_keys=tuple(keys) if any(keys) else ())


class Refusal(NamedTuple):
    """A request that cannot be carried out, in a sentence with the reason."""

    text: str
    result: int = MAV_MISSION_ERROR  # MAV_MISSION_RESULT, of a plan


Validate = Callable[[Sequence[MissionItem]], Refusal | None]
"""Checks a complete new plan; None accepts it."""
