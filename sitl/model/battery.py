"""The battery as the vehicle reads it: charge, voltage under load, current.

The open voltage falls linearly from full to empty, and sags with the current over the cells' resistance. Where the
airframe counts the energy of shafts, as the report does, the store is one of shaft energy and does not sag.
"""

from __future__ import annotations

from typing import NamedTuple

FULL_VOLTAGE, EMPTY_VOLTAGE = 12.6, 9.9  # of three lithium cells [V]


class Battery(NamedTuple):
    """A battery after some energy was drawn."""

    capacity: float  # energy when full [J]
    used: float  # energy drawn since then [J]
    resistance: float = 0.0  # of the cells [ohm]
    lost: float = 0.0  # voltage of cells that have failed [V]

    @property
    def remaining(self) -> float:
        """Share of the energy that remains, 0..1."""
        return max(0.0, 1.0 - self.used / self.capacity)

    @property
    def open_voltage(self) -> float:
        """Voltage without load [V]."""
        return EMPTY_VOLTAGE + (FULL_VOLTAGE - EMPTY_VOLTAGE) * self.remaining - self.lost

    def current(self, power: float) -> float:
        """Current [A] when its cells give up a power, losses in them included [W]."""
        return power / self.open_voltage

    def voltage(self, power: float = 0.0) -> float:
        """Voltage at the terminals at such a power [V]."""
        return self.open_voltage - self.resistance * self.current(power)
