"""Measurements of a flight: sensors and commands, each on its own clock ticks, world NWU and body FLU."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from sitl import Array

Indices: TypeAlias = npt.NDArray[np.int64]

FLIP_SIGNS = np.array([1.0, -1.0, -1.0])  # FRD to FLU, NED to NWU, and back
GRID_STEP = 0.001  # between commands as they are replayed [s]
LEAD_TIME = 0.4  # in which the actuators come to where they are when a stretch begins [s]


class Series(NamedTuple):
    """Samples of one sensor."""

    time: Array  # (n,) ascending [s]
    values: Array  # (n, k)

    @property
    def rate(self) -> float:
        """Samples a second, by the median interval; 0 for fewer than two."""
        return float(1.0 / np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    def between(self, begin: float, end: float) -> Series:
        """The samples of a span of time [s], both ends included."""
        kept = slice(int(np.searchsorted(self.time, begin)), int(np.searchsorted(self.time, end, side="right")))
        return Series(self.time[kept], self.values[kept])


@dataclass(frozen=True)
class SensorRecord:
    """A whole log."""

    imu: Series  # p, q, r [rad/s] and specific force [m/s2], body FLU: (n, 6)
    commands: Series  # w1, w2 [rad/s], d1, d2 [rad]: (n, 4)
    attitude: Series  # quaternions body FLU to world NWU: (n, 4)
    motion: Series  # position [m] and velocity [m/s], world NWU: (n, 6)
    sources: tuple[str, ...]  # which message each of the four came from


@dataclass(frozen=True)
class FlightStretch:
    """A part of the flight without gaps, off the ground. Attitudes and motion are moved to the nearest IMU sample."""

    time: Array  # of the IMU, (n,) [s]
    gyro: Array  # (n, 3)
    accelerometer: Array  # (n, 3)
    commands: Array  # (m, 4), constant over steps of GRID_STEP, from LEAD_TIME before time[0] on
    attitude_at: Indices  # IMU samples of the attitudes, (a,)
    attitude: Array  # (a, 4)
    motion_at: Indices  # (b,)
    position: Array  # (b, 3)
    velocity: Array  # (b, 3)

    @property
    def seconds(self) -> float:
        """Duration of the record [s]."""
        return float(self.time[-1] - self.time[0])
