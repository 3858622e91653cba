"""The vehicle's check of a new plan, and the reason of a refusal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from protocol.dialect.mavlink import MAV_MISSION_ERROR
from protocol.plans.mission_item import MissionItem

__all__ = ["Refusal", "Validate"]


class Refusal(NamedTuple):
    """What cannot be done, in a sentence with the reason."""

    text: str
    result: int = MAV_MISSION_ERROR  # MAV_MISSION_RESULT, of a plan


Validate = Callable[[Sequence[MissionItem]], Refusal | None]
"""Checks a complete new plan; None accepts it."""
