"""The battery as a store of shaft energy, the only energy that the report measures.

Voltage falls linearly from full to empty; capacity and voltages are assumptions, as the report gives none.
"""

from __future__ import annotations

from typing import NamedTuple

FULL_VOLTAGE, EMPTY_VOLTAGE = 12.6, 9.9  # of three lithium cells [V]


class Battery(NamedTuple):
    """A battery after some energy was drawn."""

    capacity: float  # shaft energy when full [J]
    used: float  # shaft energy drawn since then [J]

    @property
    def left(self) -> float:
        """Share of the energy that is left, 0..1."""
        return max(0.0, 1.0 - self.used / self.capacity)

    @property
    def voltage(self) -> float:
        """Terminal voltage [V]."""
        return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * self.left

    def current(self, power: float) -> float:
        """Current [A] at a given power [W]."""
        return power / self.voltage
