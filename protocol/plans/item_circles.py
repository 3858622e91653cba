"""Circles that mission items ask for by their radius, and the points of one that are looked at by both ends."""

from __future__ import annotations

import math

from protocol.dialect import mavlink
from protocol.plans.plan import MissionItem

LOITER_COMMANDS = frozenset(
    {mavlink.MAV_CMD_NAV_LOITER_TIME, mavlink.MAV_CMD_NAV_LOITER_TURNS, mavlink.MAV_CMD_NAV_LOITER_UNLIM}
)
CLIMB_COMMANDS = frozenset({mavlink.MAV_CMD_NAV_LOITER_TO_ALT})
RADIUS_NUMBERS = dict.fromkeys(LOITER_COMMANDS, 3) | dict.fromkeys(CLIMB_COMMANDS, 2)  # their parameter with a radius
CIRCLING_COMMANDS = CLIMB_COMMANDS | {
    mavlink.MAV_CMD_NAV_LOITER_TURNS
}  # that circle without a radius of their own, too
RIM_POINTS = 24  # the circle lies outside the polygon of these points by less than 1 % of its radius
COMPASS = tuple(
    (math.cos(k * math.tau / RIM_POINTS), math.sin(k * math.tau / RIM_POINTS)) for k in range(RIM_POINTS)
)  # unit vectors, level


def item_radius(item: MissionItem, default: float = 0.0) -> float:
    """Radius of the circle that an item asks for [m]; 0 for none.

    Args:
        item: Of a mission.
        default: Of an item that circles but leaves its radius open [m].
    """
    number = RADIUS_NUMBERS.get(item.command)
    radius = 0.0 if number is None else item.params[number - 1]
    if math.isfinite(radius) and radius != 0.0:
        return abs(radius)
    return default if item.command in CIRCLING_COMMANDS else 0.0
