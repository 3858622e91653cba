"""The battery: a store of shaft energy, since the report meters no other.

Voltage falls linearly from full to empty; capacity and voltages are assumptions (the report gives none).
"""

from __future__ import annotations

from typing import NamedTuple

FULL, EMPTY = 12.6, 9.9  # three lithium cells [V]


class Battery(NamedTuple):
    """A battery after some energy was drawn."""

    capacity: float  # shaft energy when full [J]
    used: float  # [J]

    @property
    def left(self) -> float:
        """Share left, 0..1."""
        return max(0.0, 1.0 - self.used / self.capacity)

    @property
    def voltage(self) -> float:
        """Terminal voltage [V]."""
        return EMPTY + (FULL - EMPTY) * self.left

    def current(self, power: float) -> float:
        """Current at a given power [A]."""
        return power / self.voltage
