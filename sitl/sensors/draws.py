"""The control period, and the random draws that the instruments use up in one, or in a slow step of several.

Each quantity has columns of its own, so that no instrument changes what another one draws. All are unit normals but the
dropouts, which are uniform from 0 to 1.
"""

from __future__ import annotations

import numpy as np

from sitl.compiled import kernel
from sitl.model.airframe import Array
from sitl.model.vectors import Vector

PERIOD = 0.002  # the control period: one tick of sensors, estimator and laws [s]
SLOW_PERIODS = 5  # control periods in a slow step, 10 ms

# Columns of the row of a control period.
GYRO_NOISE, ACCEL_NOISE, POSE_POSITION_NOISE, POSE_ATTITUDE_NOISE, POSE_JITTER, POSE_DROPOUT = 0, 3, 6, 9, 12, 13
FAST_COLUMNS = 14
# Columns of the row of a slow step.
GYRO_DRIFT_NOISE, ACCEL_DRIFT_NOISE, MAGNETIC_NOISE, GNSS_POSITION_NOISE, GNSS_VELOCITY_NOISE, GNSS_DRIFT_NOISE = (
    0,
    3,
    6,
    9,
    12,
    15,
)
BAROMETER_NOISE, BAROMETER_DRIFT_NOISE, PITOT_NOISE = 18, 19, 20
JITTER, DROPOUT = 21, 25  # of magnetometer, barometer, satellite receiver, pitot
SLOW_COLUMNS = 29
_FINE = 67108864.0  # 2**26


def in_fine_steps(draws: Array) -> Array:
    """Draws in steps of 2**-26: the library that makes them may differ in their last bits by machine."""
    return np.rint(draws * _FINE) / _FINE


@kernel
def vector_at(row: Array, first: int) -> Vector:
    """Three draws of a row."""
    return Vector(row[first], row[first + 1], row[first + 2])
