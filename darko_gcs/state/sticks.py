"""Stick positions for MANUAL_CONTROL, and those that keys of a terminal make: it tells presses, never releases.

https://mavlink.io/en/services/manual_control.html
"""

from __future__ import annotations

import math
from typing import NamedTuple

from protocol.dialect import mavlink
from protocol.ranges import STICK_SCALE
from protocol.wire.message import Message, Source

STICK_PERIOD = 0.05  # between two messages [s]
NUDGE_TIME = 0.3  # that one press of a key deflects a stick [s]
HELD_TIME = 0.15  # that a repeated key does: a terminal repeats a held one about 30 times a second [s]
DEAD_MAN_TIME = 10.0  # without any key, after which the keyboard flies no longer [s]
DEFLECTIONS = (0.25, 0.5, 1.0)  # of a stick by a key


class Sticks(NamedTuple):
    """Stick positions, each -1..1."""

    forward: float = 0.0
    right: float = 0.0
    up: float = 0.0
    clockwise: float = 0.0

    def message(self, target: Source) -> Message:
        """MANUAL_CONTROL for a vehicle: x forward, y right, r clockwise, z the throttle with the centre at 500."""
        x, y, r = (round(STICK_SCALE * part) for part in (self.forward, self.right, self.clockwise))
        z = round(STICK_SCALE * (1.0 + self.up) / 2.0)
        return mavlink.MAVLink_manual_control_message(target[0], x, y, z, r, 0)


STICK_KEYS = {
    "up": Sticks(forward=1.0), "down": Sticks(forward=-1.0), "right": Sticks(right=1.0), "left": Sticks(right=-1.0),
    "w": Sticks(up=1.0), "s": Sticks(up=-1.0), "d": Sticks(clockwise=1.0), "a": Sticks(clockwise=-1.0),
}  # fmt: skip


class KeySticks:
    """Sticks by keys: a press nudges, a held key flies on, none centres.

    Args:
        now: [s].
    """

    def __init__(self, now: float) -> None:
        self.deflection = DEFLECTIONS[1]
        self._until: dict[str, float] = {}  # when each key's deflection ends [s]
        self._pressed: dict[str, float] = {}  # last press of each [s]
        self._touched = now

    def press(self, key: str, now: float) -> None:
        """Take a press or a repetition of a key of ``STICK_KEYS``."""
        is_held = now - self._pressed.get(key, -math.inf) < HELD_TIME
        self._pressed[key] = now
        self._until[key] = now + (HELD_TIME if is_held else NUDGE_TIME)

    def touch(self, now: float) -> None:
        """Any key shows that the pilot is there."""
        self._touched = now

    def change_deflection(self, step: int) -> None:
        """Deflect the sticks less (-1) or more (1)."""
        place = DEFLECTIONS.index(self.deflection) + step
        self.deflection = DEFLECTIONS[max(0, min(place, len(DEFLECTIONS) - 1))]

    def centre(self) -> None:
        """Let all sticks go."""
        self._until.clear()

    def sticks(self, now: float) -> Sticks:
        """The sticks now; opposite keys cancel each other."""
        parts = [STICK_KEYS[key] for key, until in self._until.items() if now < until]
        return Sticks(*(self.deflection * max(-1.0, min(1.0, sum(part))) for part in zip(*parts, strict=True)))

    def time_left(self, now: float) -> float:
        """Time until the pilot counts as gone [s]."""
        return max(0.0, self._touched + DEAD_MAN_TIME - now)
