"""Means of what an inertial unit read since the autopilot's last tick, as telemetry tells it.

A propeller's vibration, of 95 Hz, folds into slow motion where it is sampled at 50 Hz; and as the laws answer it, the
elevons seem to make it. Autopilots filter before they log, too.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import ACCELEROMETER, GYROSCOPE, HEALTHY, PENDING, Inertial
from sitl.simulation.avionics import Avionics
from sitl.storage import copy_of


class InertialMean(NamedTuple):
    """Mean reading of a gyroscope and an accelerometer."""

    reading: Inertial
    age: float  # of its middle [s]


def inertial_mean(avionics: Avionics, period: int, count: int) -> InertialMean | None:
    """Mean reading; None of a vehicle that sees the truth, the last reading of an instrument that fails.

    Args:
        avionics: Of the vehicle.
        period: Control periods flown.
        count: Of how many of them.
    """
    if not avionics.is_sensed:
        return None
    i, count = avionics.instruments, min(count, period)
    failures = np.asarray(i.failures).ravel()
    # What is kept has not yet failed by scale, drift or delay.
    if count == 0 or failures[GYROSCOPE] != HEALTHY or failures[ACCELEROMETER] != HEALTHY:
        return InertialMean(copy_of(i.inertial), 0.0)
    lately = (period - np.arange(count)) % PENDING
    read = np.asarray(i.kept).reshape(PENDING, 6)[lately].mean(axis=0).tolist()
    return InertialMean(Inertial(Vector(*read[:3]), Vector(*read[3:])), 0.5 * count * PERIOD)
