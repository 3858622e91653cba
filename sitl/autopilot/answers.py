"""Answers of the autopilot to requests, and its texts for the pilot."""

from __future__ import annotations

from typing import NamedTuple

from protocol.dialect import mavlink

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
