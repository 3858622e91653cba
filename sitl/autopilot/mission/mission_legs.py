"""Chains of mission points that are planned together, and items that circle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import LegMode
from protocol.plans.item_circles import CLIMB_COMMANDS, LOITER_COMMANDS
from protocol.plans.plan import MissionItem
from protocol.ranges import LEGS_AHEAD, MIN_AIRSPEED
from sitl.autopilot.leg_planner import FORWARD_DRIFT
from sitl.autopilot.mission.items import (
    LAND_COMMANDS,
    PASSED_COMMANDS,
    POSITION_COMMANDS,
    TAKEOFF_COMMANDS,
    WAY_OF_VTOL_STATE,
    next_flown,
    position_of,
)
from sitl.autopilot.settings import Settings
from sitl.autopilot.world import World
from sitl.control.reference import Point, Reference
from sitl.enclosure.arena_detours import crosses_circle
from sitl.guidance.circles import CircleToHeight, FlyCircle, circle_about
from sitl.guidance.view import VehicleView
from sitl.prediction.chooser import Chooser, LegEnd

# Chains of mission points that follow one another without a stop, so that the legs to them are planned together.


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


# Items that circle: to wait, or to climb and descend; where the vehicle hovers, or must, they have no circle.


class Circling(NamedTuple):
    """Inputs of a mission's circles. The reason why none can be flown is added to ``notices``."""

    view: VehicleView
    world: World
    settings: Settings
    chooser: Chooser | None  # None: everything is hovered
    requested: LegMode
    airspeed: float  # [m/s]
    notices: list[str]

    def circle_of(
        self, items: Sequence[MissionItem], current: int, reference: Reference
    ) -> FlyCircle | CircleToHeight | None:
        """The circle of the current item about a reference; None if it is no such item, too."""
        item = items[current]
        if item.command in CLIMB_COMMANDS:
            following = next_flown(items, current)
            return self._climb(
                item, reference, None if following is None else position_of(items[following], self.world)
            )
        return self._loiter(item, reference) if item.command in LOITER_COMMANDS else None

    def _loiter(self, item: MissionItem, reference: Reference) -> FlyCircle | None:
        """A circle that waits: for a time, for a number of turns, or for ever."""
        amount = hold_time(item)
        if item.command == mavlink.MAV_CMD_NAV_LOITER_TURNS:
            return self._circle(reference, self._radius(item.params[2]), turns=item_amount(item))
        radius = 0.0 if math.isnan(item.params[2]) else item.params[2]
        return self._circle(reference, radius, seconds=amount)

    def _climb(self, item: MissionItem, reference: Reference, following: Point | None) -> CircleToHeight | None:
        """A circle that climbs or descends; it is left towards what follows if the item asks for it."""
        circle = self._circle(reference, self._radius(item.params[1]))
        is_left_there = 1.0 in {item.params[0], item.params[3]}
        return None if circle is None else CircleToHeight(circle, following if is_left_there else None)

    def _radius(self, radius: float) -> float:
        return self.settings.loiter_radius if math.isnan(radius) or radius == 0.0 else radius

    def _circle(
        self, reference: Reference, radius: float, *, seconds: float = math.inf, turns: float = math.inf
    ) -> FlyCircle | None:
        height = reference.position[2]
        if radius == 0.0 or self.chooser is None or not self.chooser.orbits(height, self.requested, self.settings):
            return None
        circle = circle_about(reference.position, radius, reference, self.airspeed, seconds, turns)
        wide = self.settings.clearance + FORWARD_DRIFT
        if crosses_circle(self.world.arena, self.view.p, reference.position, abs(radius), wide):
            self.notices.append(f"Circle of {abs(radius):g} m meets an obstacle: hovering at its centre")
            return None
        if circle.reference.path.airspeed < MIN_AIRSPEED:
            self.notices.append(f"Circle of {abs(radius):g} m too tight: hovering at its centre")
            return None
        return circle


def hovered(item: MissionItem) -> MissionItem:
    """An item whose first four parameters are those of a waypoint, as it is where it is hovered."""
    return replace(item, params=(0.0, 0.0, 0.0, math.nan)) if item.command in CLIMB_COMMANDS else item


def item_amount(item: MissionItem) -> float:
    """Duration [s] or number of turns of an item."""
    return item.params[0] if math.isfinite(item.params[0]) else 0.0


def hold_time(item: MissionItem) -> float:
    """Time that an item stays at its point [s]."""
    if item.command == mavlink.MAV_CMD_NAV_LOITER_UNLIM:
        return math.inf
    return 0.0 if item.command == mavlink.MAV_CMD_NAV_LOITER_TURNS else item_amount(item)
