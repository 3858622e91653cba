"""Disturbances that a person orders: tracking lost, markers swapped, frames dropped; at given times, or from now on."""

from __future__ import annotations

import math
import re
from enum import Enum
from typing import NamedTuple

from sitl.errors import SitlError

MAX_TIME = 1e6  # [s]
_WRITTEN = re.compile(r"(?P<kind>\w+)@(?P<start>[\d.]+)(?:\+(?P<duration>[\d.]+))?")


class Trouble(Enum):
    """Kind of a passing disturbance."""

    LOST = "lost"  # Motive streams, and says that it does not see the body
    SWAP = "swap"  # it takes markers for one another, which turns the body
    DROPPED = "dropped"  # its frames do not arrive


class Disturbance(NamedTuple):
    """One of them; times since the first frame [s]."""

    trouble: Trouble
    start: float
    end: float


def read_disturbance(text: str) -> Disturbance:
    """KIND@START or KIND@START+SECONDS; without a duration it lasts.

    Raises:
        SitlError: The text is none.
    """
    written = _WRITTEN.fullmatch(text)
    kinds = [kind.value for kind in Trouble]
    if not written or written["kind"] not in kinds:
        raise SitlError(f"{text!r} is not KIND@START+SECONDS, with KIND of {', '.join(kinds)}")
    start, duration = _seconds(text, written["start"]), written["duration"]
    end = math.inf if duration is None else start + _seconds(text, duration)
    return Disturbance(Trouble(written["kind"]), start, end)


def _seconds(text: str, number: str) -> float:
    try:
        value = float(number)
    except ValueError:
        raise SitlError(f"{text!r}: {number} is not a number of seconds") from None
    if value > MAX_TIME:
        raise SitlError(f"{text!r}: {number} s is above {MAX_TIME:g} s")
    return value


class Disturbances:
    """Schedule of disturbances; more can be ordered while it runs."""

    def __init__(self, planned: tuple[Disturbance, ...] = ()) -> None:
        self._planned = list(planned)

    def order(self, words: str, time: float) -> str:
        """Take a line that a person types: ``lost``, ``lost 2`` or ``ok``; gives what to answer.

        Args:
            words: The line.
            time: Now, since the first frame [s].
        """
        kind, _, duration = words.strip().partition(" ")
        if kind == "ok":
            self._planned = [each._replace(end=min(each.end, time)) for each in self._planned if each.start <= time]
            return "all disturbances ended"
        try:
            ordered = read_disturbance(f"{kind}@{time:.6f}" + (f"+{duration.strip()}" if duration else ""))
        except SitlError:
            return f"{words.strip()!r}: type lost, swap or dropped, with seconds or without, or ok"
        self._planned.append(ordered)
        return f"{kind} for {ordered.end - ordered.start:g} s" if duration else f"{kind} until ok"

    def now(self, time: float) -> frozenset[Trouble]:
        """The disturbances at a time since the first frame [s]."""
        return frozenset(each.trouble for each in self._planned if each.start <= time < each.end)
