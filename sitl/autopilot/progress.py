"""A transition that was asked for by command: how far it is, and how it ended.

MAV_CMD_DO_VTOL_TRANSITION takes seconds, so it is answered as a long running command
(https://mavlink.io/en/services/command.html#long_running_commands). Take-offs, landings, returns and go-tos are
accepted at once, because stock clients take any later answer for a lost one.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.dialect.vocabulary import Law, Way
from sitl.autopilot.guidance import View
from sitl.control.reference import Reference

__all__ = ["End", "Transition", "is_reached"]

ON_THE_WING = frozenset({Law.FORWARD_LINE_OF_SIGHT, Law.FORWARD_LINEAR})
NAMES = {Way.HOVER: "hover", Way.FORWARD: "wing"}
TIPPED = math.radians(70.0)  # tilt of a vehicle in forward flight, or a little more
WING_SPEED = 9.0  # about the airspeed that carries it [m/s]
TIME_LIMIT = 60.0  # a strong wind can keep a vehicle from its transition: it does not wait for ever [s]


class End(NamedTuple):
    """How a transition ended."""

    result: int  # MAV_RESULT
    text: str = ""  # for the pilot; empty when there is nothing to say


def is_reached(way: Way, view: View, reference: Reference) -> bool:
    """Whether a flying vehicle flies this way, and is not about to fly another one."""
    if way is Way.FORWARD:
        return view.law in ON_THE_WING
    return not view.forward and not reference.forward and view.law is not Law.FAILSAFE


@dataclass(slots=True)
class Transition:
    """One transition from the asking to its ``end``. Ended once, it stays as it is."""

    way: Way  # HOVER or FORWARD
    begun: View  # the vehicle when it was asked
    before: Way = Way.NONE  # what the mission was asked to fly until then
    percent: int = 0  # never falls, and is 100 only at the end
    end: End | None = None

    def look(self, view: View, reference: Reference) -> None:
        """Take the vehicle as it is now under the reference that was just given."""
        if self.end is not None:
            return
        self.percent = max(self.percent, min(99, round(100.0 * self._share(view))))
        if view.law is Law.FAILSAFE:
            self.fail("a fall was caught")
        elif is_reached(self.way, view, reference):
            self.finish(mavlink.MAV_RESULT_ACCEPTED)
        elif self.way is Way.FORWARD and not reference.forward:  # a mission decides leg by leg
            text = "This item is hovered: those to come are flown on the wing where they can be"
            self.finish(mavlink.MAV_RESULT_ACCEPTED, text)
        elif view.time - self.begun.time > TIME_LIMIT:
            self.fail(f"not done in {TIME_LIMIT:g} s")

    def fail(self, why: str) -> None:
        """It came to nothing."""
        self.finish(mavlink.MAV_RESULT_FAILED, f"Transition to the {NAMES[self.way]} failed: {why}")

    def cancel(self) -> None:
        """Who asked for it no longer wants it."""
        self.finish(mavlink.MAV_RESULT_CANCELLED, f"Transition to the {NAMES[self.way]} cancelled")

    def finish(self, result: int, text: str = "") -> None:
        """End it with a MAV_RESULT, unless it has ended."""
        if self.end is None:
            self.end = End(result, text)

    def _share(self, view: View) -> float:
        """How much of the way from upright and slow to tipped over and fast, or back, is behind it, 0..1."""
        tipped, borne = min(view.tilt / TIPPED, 1.0), min(_airspeed(view) / WING_SPEED, 1.0)
        if self.way is Way.FORWARD:
            return 0.5 * (tipped + borne)
        most = max(_airspeed(self.begun), WING_SPEED)
        return 1.0 - 0.5 * (tipped + min(_airspeed(view) / most, 1.0))


def _airspeed(view: View) -> float:
    return math.dist(view.v, view.wind)
