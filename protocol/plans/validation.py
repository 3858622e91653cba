"""The vehicle's check of a new plan, and the reason of a refusal."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

from protocol.plans.mission_item import MissionItem

__all__ = ["Refusal", "Validate"]


class Refusal(NamedTuple):
    """Refusal of a plan: a MAV_MISSION_RESULT and a sentence with the reason."""

    result: int
    text: str


Validate = Callable[[Sequence[MissionItem]], Refusal | None]
"""Checks a complete new plan; None accepts it."""
