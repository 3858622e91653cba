"""The battery monitor: voltage and current at the battery, as often as it reads and as well as it can."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from sitl.sensors.draws import PERIOD, in_fine_steps
from sitl.sensors.instruments import BatteryMonitor


class BatteryReading(NamedTuple):
    """Reading of the battery monitor."""

    voltage: float  # [V]
    current: float  # [A]


def monitored(voltage: float, current: float, spec: BatteryMonitor, period: int, seed: int) -> BatteryReading:
    """The reading of a control period, whose noise lasts until the next one.

    Args:
        voltage: At the terminals [V].
        current: Through them [A].
        spec: Of the monitor.
        period: Control periods flown.
        seed: Of the flight.
    """
    number = int(period * PERIOD * spec.timing.rate + 1e-9)
    of_voltage, of_current = _noise(seed, number)
    return BatteryReading(
        _in_steps(voltage + spec.voltage_noise * of_voltage, spec.voltage_step),
        _in_steps(max(current + spec.current_noise * of_current, 0.0), spec.current_step),
    )


@lru_cache(maxsize=16)  # it is read more often than it changes, and a generator is slow to make
def _noise(seed: int, number: int) -> tuple[float, float]:
    noise = in_fine_steps(np.random.default_rng((seed, 4, number)).standard_normal(2))
    return float(noise[0]), float(noise[1])


def _in_steps(value: float, step: float) -> float:
    return step * round(value / step)
