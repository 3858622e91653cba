"""Readings that no gyroscope or accelerometer makes that works: repeated to the last bit, or leaping.

A number with noise in it never comes again, and no vehicle starts to turn, or is pushed, within one control period as
random numbers say. What is odd is counted, and forgotten again by readings that are not.
"""

from __future__ import annotations

from sitl.compiled import kernel
from sitl.model.vectors import Vector, norm, subtract

RATES_LEAP = 3.0  # in a control period [rad/s]
FORCE_LEAP = 30.0  # likewise [m/s2]
FAILED_COUNT = 15.0  # odd readings of late, from which on the instrument has failed
MAX_FAULT_COUNT = 50.0
FORGOTTEN = 0.2  # of an odd reading, by one that is not


@kernel
def fault_count_after(count: float, reading: Vector, before: Vector, leap: float) -> float:
    """Odd readings of late, after one more."""
    change = norm(subtract(reading, before))
    if change == 0.0 or change > leap:
        return min(count + 1.0, MAX_FAULT_COUNT)
    return max(count - FORGOTTEN, 0.0)


@kernel
def has_failed(count: float, failed: float) -> float:
    """1 while an instrument has failed; it is believed again when nothing odd is left."""
    return 1.0 if count >= FAILED_COUNT or (failed > 0.0 and count > 0.0) else 0.0
