"""Items that let the DO items after them wait (CONDITION_*), as ArduPilot means them.

While the next item is flown they wait: for a time, for a distance to its end, for a heading. What still waits when that
is reached is passed over. With nothing to fly after them, the vehicle waits where it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

from protocol.dialect import mavlink
from protocol.plans.plan import MissionItem
from sitl.control.reference import Point, Reference
from sitl.guidance.view import VehicleView
from sitl.guidance.yaw_turns import YawTurn

CONDITION_COMMANDS = frozenset(
    {mavlink.MAV_CMD_CONDITION_DELAY, mavlink.MAV_CMD_CONDITION_DISTANCE, mavlink.MAV_CMD_CONDITION_YAW}
)


@dataclass(slots=True)
class Condition:
    """A condition that is waited for."""

    command: int  # MAV_CMD
    value: float  # [s] or [m]
    since: float  # [s]
    turn: YawTurn | None = None

    @classmethod
    def of(cls, item: MissionItem, view: VehicleView) -> Condition:
        """The condition of an item, which begins now."""
        is_yaw = item.command == mavlink.MAV_CMD_CONDITION_YAW
        return cls(item.command, item.params[0], view.time, YawTurn.of(item.params, view) if is_yaw else None)

    def is_met(self, view: VehicleView, left: float) -> bool:
        """Whether it is waited for no more.

        Args:
            view: The vehicle as it is now.
            left: Level distance to the end of the item that is flown meanwhile [m]; 0 without one.
        """
        if self.turn is not None:
            return view.forward or self.turn.done(view)  # in forward flight there is no heading to turn to
        if self.command == mavlink.MAV_CMD_CONDITION_DISTANCE:
            return left <= self.value
        return view.time - self.since >= self.value


@dataclass(slots=True)
class AwaitCondition:
    """Stay at a reference until a condition is met; a heading is turned to meanwhile, and kept."""

    reference: Reference
    condition: Condition
    landing: bool = False

    def update(self, view: VehicleView) -> Reference:
        """The reference of this tick."""
        if self.condition.turn is not None:
            self.reference = self.reference._replace(heading=self.condition.turn.update(view))
        return self.reference

    def done(self, view: VehicleView) -> bool:
        """Whether the condition is met."""
        return self.condition.is_met(view, 0.0)


@dataclass(slots=True)
class WaitingItems:
    """Items that wait while another is flown."""

    seqs: list[int] = field(default_factory=list)
    condition: Condition | None = None  # that is waited for

    def next_free(self, items: Sequence[MissionItem], view: VehicleView, end: Point | None) -> int | None:
        """The first of them if it waits no more, which is taken from them; a condition begins when it is the first.

        Args:
            items: All of the mission's.
            view: The vehicle as it is now.
            end: Where the item that is flown meanwhile ends, world NWU [m]; None if it has no place.
        """
        if not self.seqs:
            return None
        first = items[self.seqs[0]]
        if first.command in CONDITION_COMMANDS:
            self.condition = self.condition or Condition.of(first, view)
            if not self.condition.is_met(view, math.inf if end is None else math.dist(end[:2], view.p[:2])):
                return None
            self.condition = None
        return self.seqs.pop(0)

    @property
    def turn(self) -> YawTurn | None:
        """Of the heading, if that is waited for."""
        return None if self.condition is None else self.condition.turn

    @property
    def words(self) -> str:
        """The numbers of the items that wait, in words."""
        return f"item{'s' * (len(self.seqs) > 1)} {', '.join(map(str, self.seqs))}"
