"""Events of the mission protocol: mission, fence and rally points, on both sides."""

from __future__ import annotations

from dataclasses import dataclass

from protocol.events.event import Event
from protocol.plans.mission_item import MissionItem

__all__ = [
    "CurrentItemRequested",
    "CurrentItemSet",
    "MissionCleared",
    "MissionDownloaded",
    "MissionFailed",
    "MissionProgress",
    "MissionReceived",
    "MissionRefused",
    "MissionUploaded",
]


@dataclass(frozen=True, slots=True)
class MissionProgress(Event):
    """``done`` of ``total`` items of a transfer; ``direction`` is "upload" or "download"."""

    direction: str
    done: int
    total: int


@dataclass(frozen=True, slots=True)
class MissionUploaded(Event):
    """The vehicle accepted a plan of ``count`` items, or (``is_partial``) so many new items in its mission."""

    count: int
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points
    is_partial: bool = False


@dataclass(frozen=True, slots=True)
class MissionDownloaded(Event):
    """The vehicle's complete plan has arrived."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionReceived(Event):
    """A complete, valid plan has replaced the old one of its type on the vehicle."""

    items: tuple[MissionItem, ...]
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points
    is_partial: bool = False  # only some items were written; the others and the length stayed


@dataclass(frozen=True, slots=True)
class MissionRefused(Event):
    """An upload ended without a new plan; the old one stays. ``result`` is a MAV_MISSION_RESULT."""

    result: int
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionCleared(Event):
    """The vehicle holds no plan of this type any more (on both sides)."""

    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class MissionFailed(Event):
    """A transfer failed; ``operation`` is upload, download, clear or set_current.

    ``result`` is the vehicle's MAV_MISSION_RESULT, None if it did not answer or answered out of turn.
    """

    operation: str
    result: int | None
    reason: str
    kind: int = 0  # MAV_MISSION_TYPE: mission, fence or rally points


@dataclass(frozen=True, slots=True)
class CurrentItemSet(Event):
    """The vehicle confirmed the requested mission item."""

    seq: int


@dataclass(frozen=True, slots=True)
class CurrentItemRequested(Event):
    """A ground station asks the mission to continue at item ``seq`` (which exists)."""

    seq: int
