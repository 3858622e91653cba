"""Failures by which an instrument reads something else than it should: by an offset, a share, ever more, or late."""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import kernel, subroutine
from sitl.model.vectors import Vector, add, scaled
from sitl.sensors.draws import vector_at
from sitl.sensors.instruments import (
    ACCELEROMETER,
    DELAYED,
    DRIFTING,
    GYROSCOPE,
    PENDING,
    SCALED,
    WRONG,
    Inertial,
    Instruments,
)

SCALE_ERROR, RATE_SCALE_ERROR = 0.3, 0.1  # share that a scaled reading is too large; of a gyroscope
WRONG_RATE, DRIFT_RATE = 0.2, 0.02  # of a gyroscope [rad/s], [rad/s2]
WRONG_FORCE, DRIFT_FORCE = 2.0, 0.2  # of an accelerometer [m/s2], [m/s3]
INERTIAL_DELAY = 0.1  # of a delayed inertial instrument [s]


class Misreading(NamedTuple):
    """Present error of an instrument: factor, offset and drift."""

    factor: float  # of what it should read [-]
    offset: float  # in multiples of its usual offset [-]
    drifted: float  # time that it has drifted, in multiples of its usual drift [s]


@kernel
def misreading(i: Instruments, instrument: int, period: int, dt: float) -> Misreading:
    """Factor, offset and drift of an instrument's error in a control period.

    Args:
        i: The instruments, a record.
        instrument: Which of them.
        period: The control period.
        dt: Control period [s].
    """
    failure, size = i.failures[instrument], i.sizes[instrument]
    share = RATE_SCALE_ERROR if instrument == GYROSCOPE else SCALE_ERROR
    return Misreading(
        1.0 + share * size if failure == SCALED else 1.0,
        size if failure == WRONG else 0.0,
        size * (period - i.failed_at[instrument]) * dt if failure == DRIFTING else 0.0,
    )


@kernel
def error_of(m: Misreading, offset: float, drift: float) -> float:
    """Error added to a reading, by its usual offset and drift a second."""
    return m.offset * offset + m.drifted * drift


@kernel
def _misread(value: Vector, m: Misreading, offset: float, drift: float) -> Vector:
    error = error_of(m, offset, drift)
    return add(scaled(value, m.factor), Vector(error, error, -error))


@subroutine
def misread(i: Instruments, read: Inertial, period: int, dt: float) -> Inertial:
    """The inertial reading of a control period as failures of gyroscope and accelerometer change it.

    Args:
        i: The instruments, a record.
        read: What was read.
        period: The control period.
        dt: Control period [s].
    """
    kept, failures = i.kept, i.failures
    now, late = kept[period % PENDING], kept[(period - int(INERTIAL_DELAY / dt + 0.5)) % PENDING]
    now[0], now[1], now[2] = read.rates.x, read.rates.y, read.rates.z
    now[3], now[4], now[5] = read.force.x, read.force.y, read.force.z
    if failures[GYROSCOPE] == 0.0 and failures[ACCELEROMETER] == 0.0:
        return read
    rates = vector_at(late, 0) if failures[GYROSCOPE] == DELAYED else read.rates
    force = vector_at(late, 3) if failures[ACCELEROMETER] == DELAYED else read.force
    return Inertial(
        _misread(rates, misreading(i, GYROSCOPE, period, dt), WRONG_RATE, DRIFT_RATE),
        _misread(force, misreading(i, ACCELEROMETER, period, dt), WRONG_FORCE, DRIFT_FORCE),
    )
