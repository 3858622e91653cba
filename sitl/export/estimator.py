"""The navigation filter as files of C: what it keeps aboard, and one control period around it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from sitl.control.estimate import Estimate
from sitl.estimation.filter import MAX_HORIZON, Filter, FilterSettings, Step, new_filter
from sitl.estimation.navigator import navigate
from sitl.export.c_program import Instance, Program
from sitl.export.c_types import ArrayKind, Kind, Types
from sitl.model.airframe import Airframe, Array
from sitl.sensors import instruments as simulated
from sitl.sensors.instruments import (
    N_DELAYED,
    QUEUE_LENGTH,
    READING_SIZE,
    Accelerometer,
    Barometer,
    Gnss,
    Gyroscope,
    Inertial,
    Magnetometer,
    Mounting,
    Pitot,
    send,
)

# Aboard there are no errors to be simulated: of the instruments only what the filter looks at.


class SensorSet(NamedTuple):
    """What the filter takes the instruments to be."""

    gyroscope: Gyroscope
    accelerometer: Accelerometer
    magnetometer: Magnetometer
    barometer: Barometer
    gnss: Gnss
    pitot: Pitot
    mounting: Mounting


class Instruments(NamedTuple):
    """Readings on their way to the filter; lines are queues, by instrument less FIRST_DELAYED."""

    specification: SensorSet
    inertial: Inertial  # the last reading
    sampled: Array  # control period of a reading, (LINES, LINE)
    arrives: Array  # control period of its arrival, (LINES, LINE)
    readings: Array  # (LINES, LINE, READING)
    first: Array  # the oldest reading, (LINES,)
    waiting: Array  # readings in the line, (LINES,)
    last: Array  # the newest reading, (LINES, READING)


class Navigation(NamedTuple):
    """What the estimator is told of the vehicle's instruments."""

    settings: FilterSettings
    specification: SensorSet
