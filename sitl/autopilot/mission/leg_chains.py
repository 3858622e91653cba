"""Chains of mission points that follow one another without a stop, so that the legs to them are planned together."""

from __future__ import annotations

from collections.abc import Sequence

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.plan import MissionItem
from protocol.ranges import LEGS_AHEAD
from sitl.autopilot.mission.items import (
    LAND_COMMANDS,
    PASSED_COMMANDS,
    POSITION_COMMANDS,
    TAKEOFF_COMMANDS,
    WAY_OF_VTOL_STATE,
)
from sitl.autopilot.mission.places import position_of
from sitl.autopilot.safety.world import World
from sitl.control.reference import Point
from sitl.prediction.chooser import LegEnd


def chain_from(
    items: Sequence[MissionItem], current: int, point: Point, requested: LegMode, world: World
) -> list[LegEnd]:
    """The current item's point, and those that follow it without a stop between.

    Args:
        items: All of the mission's.
        current: Number of the current one.
        point: Where it ends, world NWU [m].
        requested: How it is to be flown.
        world: Where it is flown.
    """
    ends = [LegEnd(point, requested, current)]
    for seq in range(current, len(items)):
        item = items[seq]
        if item.command == mavlink.MAV_CMD_DO_VTOL_TRANSITION:
            requested = WAY_OF_VTOL_STATE[int(item.params[0])]
        elif item.command not in PASSED_COMMANDS | TAKEOFF_COMMANDS:  # passed over in the air
            has_end = item.command in POSITION_COMMANDS | LAND_COMMANDS
            following = position_of(item, world) if has_end else None
            if following is None or len(ends) == LEGS_AHEAD:
                break
            if seq > current:
                height = max(following[2], ends[-1].p[2]) if item.command in LAND_COMMANDS else following[2]
                ends.append(LegEnd((following[0], following[1], height), requested, seq))
            if item.command != mavlink.MAV_CMD_NAV_WAYPOINT or item.params[0] > 0.0:
                break
        if not item.autocontinue:
            break
    return ends
