"""What an alarm is: what it asks for, why, and how that is said."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

__all__ = ["DOING", "LINK_ACTIONS", "Action", "Alarm"]


class Action(IntEnum):
    """What an alarm asks for, the graver the greater."""

    NONE = 0
    HOLD = 1
    RETURN = 2
    LAND = 3


DOING = {Action.NONE: "going on", Action.HOLD: "holding", Action.RETURN: "returning", Action.LAND: "landing"}
GOING_ON = {Action.RETURN: "the return goes on", Action.LAND: "the landing goes on"}
LINK_ACTIONS = {0: Action.NONE, 1: Action.HOLD, 2: Action.RETURN, 3: Action.LAND}  # of NAV_DLL_ACT and DRK_OBC_ACT


class Alarm(NamedTuple):
    """Something is wrong, or right again: what is to be done, and why in words."""

    action: Action | None  # None: a word, that asks for nothing
    severity: int  # MAV_SEVERITY
    why: str
    stop: bool = False  # whether a vehicle in forward flight stops before it turns elsewhere

    def text(self, gravest: Action, under_way: Action) -> str:
        """The alarm as the pilot reads it: never that something is done which is not.

        Args:
            gravest: What the gravest alarm of this moment asks for.
            under_way: What the vehicle was doing already.
        """
        if self.action is None:
            return self.why
        if self.action is Action.NONE:
            return f"{self.why}: {DOING[self.action]}"
        return f"{self.why}: {DOING[gravest] if gravest > under_way else GOING_ON[under_way]}"
