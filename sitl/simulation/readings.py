"""The newest readings of a vehicle's instruments that have arrived, as its telemetry tells them."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from sitl.estimation.filter import ALIGNING
from sitl.model.vectors import Vector
from sitl.sensors.draws import PERIOD
from sitl.sensors.instruments import BAROMETER, FIRST_DELAYED, GNSS, MAGNETOMETER, PITOT, Gnss
from sitl.simulation.avionics import Avionics, Navigation
from sitl.simulation.navigation_status import SILENT_TIME


class Fix(NamedTuple):
    """A reading of the satellite receiver."""

    position: Vector  # world NWU [m]
    velocity: Vector  # world NWU [m/s]
    accuracy: Gnss  # as specified


class LatestReadings(NamedTuple):
    """The newest readings; None of an instrument that is not there or has been silent for a while."""

    has_receiver: bool = False
    fix: Fix | None = None
    field: Vector | None = None  # body FLU [T]
    height: float | None = None  # of the barometer [m]
    airspeed: float | None = None  # of the pitot tube [m/s]


def readings_of(avionics: Avionics, period: int) -> LatestReadings:
    """The newest readings; none of a vehicle that sees the truth.

    Args:
        avionics: Of the vehicle.
        period: Control periods flown.
    """
    if not avionics.is_sensed:
        return LatestReadings()
    tube = _newest(avionics, PITOT, period)
    airspeed = None if tube is None else float(tube[0])
    if avionics.navigation is Navigation.MOCAP:
        return LatestReadings(airspeed=airspeed)
    fix, field, height = (_newest(avionics, instrument, period) for instrument in (GNSS, MAGNETOMETER, BAROMETER))
    return LatestReadings(
        has_receiver=True,
        fix=None if fix is None else Fix(Vector(*fix[:3]), Vector(*fix[3:6]), avionics.sensors.gnss),
        field=None if field is None else Vector(*field[:3]),
        height=None if height is None else float(height[0]),
        airspeed=airspeed,
    )


def _newest(avionics: Avionics, instrument: int, period: int) -> Any | None:  # noqa: ANN401 - a row of numbers
    """The newest reading that has arrived, unless it is old."""
    i, line = avionics.instruments, instrument - FIRST_DELAYED
    has_arrived = i.arrives[line] <= period
    if avionics.filter.phase == ALIGNING:  # which keeps no more than the newest, whether it has arrived or not
        has_arrived[:] = True
    sampled = np.where(has_arrived, i.sampled[line], 0.0)
    at = int(sampled.argmax())
    is_old = sampled[at] <= 0.0 or (period - sampled[at]) * PERIOD >= SILENT_TIME
    return None if is_old else i.readings[line, at].tolist()
