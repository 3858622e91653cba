"""A short flight of an airframe that is off, its log, and what was identified from it: one of each per process."""

import tempfile
from functools import cache
from pathlib import Path

import numpy as np

from sitl.lab.identification.flight_log import LogConventions, SensorRecord, Series, read_flight
from sitl.lab.identification.flown_log import (
    HOVER_STEPS,
    LEG_STEPS,
    Excitation,
    fly_excitation,
    off_airframe,
    write_log,
)
from sitl.lab.identification.identify_flight import identify_record
from sitl.model.airframe_files import load

SHORT_HOVER, SHORT_LEGS = HOVER_STEPS[1:3], (LEG_STEPS[0], LEG_STEPS[3], LEG_STEPS[6])
HOVER_ALONE = Excitation(HOVER_STEPS[1:5], ())


def flown(name, seed, hovering=False):
    """The truth, and the flight of an airframe 20 % off in 2 m/s of wind."""
    return _flown(name, seed, hovering)


def read(name, seed, hovering=False):
    """Content of the flight's log."""
    return _read(name, seed, hovering)


def identified(name, seed, hovering=False):
    """Result of an identification from the IMU at 125 Hz and the commands."""
    return _identified(name, seed, hovering)


@cache
def _flown(name, seed, hovering):
    base = load(name).parameters
    true = off_airframe(base, 0.2, seed)
    excitation = HOVER_ALONE if hovering else Excitation(SHORT_HOVER, SHORT_LEGS)
    flight = fly_excitation(true, base, seed=seed, wind=(1.2, -1.6), excitation=excitation)
    assert not flight.crashed
    return true, flight


@cache
def _read(name, seed, hovering):
    base = load(name).parameters
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "flight.tlog"
        write_log(flown(name, seed, hovering)[1], path, base, seed=seed)
        return read_flight(path, LogConventions(None, base))


@cache
def _identified(name, seed, hovering):
    record = read(name, seed, hovering)
    imu = Series(record.imu.time[::2], record.imu.values[::2])
    thinned = SensorRecord(imu, record.commands, record.attitude, record.motion, record.sources)
    return identify_record(thinned, load(name).parameters)


def still_record(seconds, *, rate=100.0, height=20.0):
    """A record of a vehicle that hovers, nose-up and still, for a time [s], with perfect sensors."""
    time = np.arange(0.0, seconds, 1.0 / rate)
    n = len(time)
    up = np.array([np.sqrt(0.5), 0.0, -np.sqrt(0.5), 0.0])
    return SensorRecord(
        imu=Series(time, np.tile([0.0, 0.0, 0.0, 9.81, 0.0, 0.0], (n, 1))),
        commands=Series(time, np.tile([600.0, 600.0, 0.0, 0.0], (n, 1))),
        attitude=Series(time, np.tile(up, (n, 1))),
        motion=Series(time, np.tile([1.0, 2.0, height, 0.0, 0.0, 0.0], (n, 1))),
        sources=("", "", "", ""),
    )
