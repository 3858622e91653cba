"""Numbers of plan items that are out of their ranges: refused at upload, each by its name."""

from __future__ import annotations

from protocol.dialect import mavlink
from protocol.plans.item_values import numbers_of
from protocol.plans.mission_item import MissionItem
from protocol.plans.validation import Refusal
from protocol.ranges.item_ranges import KNOWN_FRAMES, item_flaw

_RESULTS = (
    mavlink.MAV_MISSION_INVALID_PARAM1,
    mavlink.MAV_MISSION_INVALID_PARAM2,
    mavlink.MAV_MISSION_INVALID_PARAM3,
    mavlink.MAV_MISSION_INVALID_PARAM4,
    mavlink.MAV_MISSION_INVALID_PARAM5_X,
    mavlink.MAV_MISSION_INVALID_PARAM6_Y,
    mavlink.MAV_MISSION_INVALID_PARAM7,
)


def refuse_numbers(item: MissionItem, name: str) -> Refusal | None:
    """The reason why an item's numbers are invalid, whatever is around it; None if they are valid.

    Args:
        item: The item.
        name: What the pilot knows it by.
    """
    if item.frame not in KNOWN_FRAMES:
        return Refusal(f"{name}: frame {item.frame} is not supported", mavlink.MAV_MISSION_UNSUPPORTED_FRAME)
    flaw = item_flaw(item.command, item.frame, numbers_of(item))
    return None if flaw is None else Refusal(f"{name}: {flaw.text}", _RESULTS[flaw.number - 1])
