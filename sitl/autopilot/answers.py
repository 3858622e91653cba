"""Answers to requests, texts for the pilot, and alarms with what they ask for."""

from __future__ import annotations

from enum import IntEnum
from typing import NamedTuple

from protocol.dialect import mavlink
from sitl.control.reference import Point

# Answers of the autopilot to requests, and its texts for the pilot.

ACCEPTED = mavlink.MAV_RESULT_ACCEPTED
REJECTED = mavlink.MAV_RESULT_TEMPORARILY_REJECTED
FAILED = mavlink.MAV_RESULT_FAILED
DENIED = mavlink.MAV_RESULT_DENIED
UNSUPPORTED = mavlink.MAV_RESULT_UNSUPPORTED
IN_PROGRESS = mavlink.MAV_RESULT_IN_PROGRESS
CANCELLED = mavlink.MAV_RESULT_CANCELLED


class Answer(NamedTuple):
    """The answer to a request."""

    result: int  # MAV_RESULT
    text: str = ""  # why, for the pilot; empty when there is nothing to say

    @property
    def accepted(self) -> bool:
        """Whether the request was carried out, or is being carried out."""
        return self.result in {ACCEPTED, IN_PROGRESS}


class Notice(NamedTuple):
    """A line for the pilot."""

    severity: int  # MAV_SEVERITY
    text: str


# Alarms: why one is raised, what it asks for, and how the pilot reads it.


class SafetyAction(IntEnum):
    """The action that an alarm asks for; a graver action has a greater number."""

    NONE = 0
    HOLD = 1
    RETURN = 2
    LAND = 3
    TERMINATE = 4


DOING = {
    SafetyAction.NONE: "going on",
    SafetyAction.HOLD: "holding",
    SafetyAction.RETURN: "returning",
    SafetyAction.LAND: "landing",
    SafetyAction.TERMINATE: "motors cut",
}
CONTINUING = {SafetyAction.RETURN: "return continues", SafetyAction.LAND: "landing continues"}


class Alarm(NamedTuple):
    """Something is wrong, or right again: what is to be done, and why in words."""

    action: SafetyAction | None  # None: a message that asks for nothing
    severity: int  # MAV_SEVERITY
    reason: str
    stop: bool = False  # whether a vehicle in forward flight stops before it turns elsewhere
    always: bool = False  # whether it stops even a return
    retreat: float = 0.0  # how much farther inside the arena's net than elsewhere a hold is flown [m]
    to: Point | None = None  # where a return ends and holds, world NWU [m]; None: it lands at home

    def text(self, gravest: SafetyAction, under_way: SafetyAction) -> str:
        """The alarm as the pilot reads it: it names what is really being done.

        Args:
            gravest: What the gravest alarm of this moment asks for.
            under_way: What the vehicle was doing already.
        """
        if self.action is None:
            return self.reason
        if self.action is SafetyAction.NONE:
            return f"{self.reason}: {DOING[self.action]}"
        return f"{self.reason}: {DOING[gravest] if gravest > under_way else CONTINUING[under_way]}"
