"""The control period: its length, the instruments that read in it, and the random draws that they use up.

Columns of the draws: :mod:`sitl.sensors.instruments`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.compiled import kernel
from sitl.model.airframe import Array
from sitl.model.vectors import Vector

PERIOD = 0.002  # the control period: one tick of sensors, estimator and laws [s]
SLOW_PERIODS = 5  # control periods in a slow step, 10 ms

_FINE = 67108864.0  # 2**26


class Timing(NamedTuple):
    """Timing of an instrument's readings, and of their arrival."""

    rate: float  # readings a second [Hz]
    delay: float  # from reading to arrival [s]
    jitter: float  # standard deviation of what delays it further [s]
    dropout: float  # share of readings that never arrive [-]


def in_fine_steps(draws: Array) -> Array:
    """Draws in steps of 2**-26: the library that makes them may differ in their last bits by machine."""
    return np.rint(draws * _FINE) / _FINE


@kernel
def vector_at(row: Array, first: int) -> Vector:
    """Three draws of a row."""
    return Vector(row[first], row[first + 1], row[first + 2])


@kernel
def is_time(period: int, rate: float, dt: float) -> bool:
    """Whether an instrument of this rate reads at the end of a control period."""
    return int(period * rate * dt + 1e-9) != int((period - 1) * rate * dt + 1e-9)
