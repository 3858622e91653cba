"""The compiled loop of a plant that somebody else flies: air, actuators, plant and instruments; no law and no filter.

It is the closed loop's own plant (:mod:`sitl.simulation.loop`), part by part, under one command for a whole call. All
instruments read, those of the arena and those outdoors; the newest reading of each that has arrived is handed out.
"""

from __future__ import annotations

from typing import NamedTuple

from sitl.compiled import entry, part
from sitl.model.airframe import Airframe, Array
from sitl.model.plant import is_finite
from sitl.sensors.aiding import read_outdoors, read_pose, read_tube
from sitl.sensors.draws import PERIOD, SLOW_PERIODS
from sitl.sensors.hidden_errors import drift, turn_propellers
from sitl.sensors.inertial import read_inertial
from sitl.sensors.instruments import N_DELAYED, READING_SIZE, Instruments, drop, put_inertial
from sitl.sensors.misreadings import misread
from sitl.simulation.flight import touch_solids, update_field, update_gust
from sitl.simulation.loop import (
    DIVERGED,
    FLOWN,
    AboardRecords,
    FlightRecords,
    WorldArrays,
    motion_of,
    move,
    move_in_field,
)
from sitl.simulation.sensed import Motion, delayed
from sitl.storage import value_of


class Heard(NamedTuple):
    """Readings of a call."""

    inertial: Array  # mean body rates [rad/s] and specific force [m/s2], body FLU, (6,)
    readings: Array  # the newest of each instrument from FIRST_DELAYED on, (N_DELAYED, READING_SIZE)
    sampled: Array  # control period of each; 0: none has arrived yet, (N_DELAYED,)


@part
def read_all(i: Instruments, a: Airframe, motion: Motion, fast: Array, slow: Array) -> None:
    """All instruments at the end of a control period; arguments as for :func:`sitl.simulation.sensed.sensed`."""
    plant, wind, period = motion.plant, motion.wind, motion.period
    airframe, now = value_of(a), (period - 1) % fast.shape[0]
    draws, slow_draws = fast[now], slow[now // SLOW_PERIODS]
    put_inertial(i, misread(i, read_inertial(i, motion.before, plant, draws, airframe, PERIOD), period, PERIOD))
    turn_propellers(i, plant, wind, airframe, PERIOD)
    if now % SLOW_PERIODS == 0:
        drift(i, slow_draws, PERIOD)
    read_pose(i, period, plant, draws, PERIOD)
    read_tube(i, period, slow_draws, PERIOD)
    read_outdoors(i, period, plant, wind, slow_draws, PERIOD)


@part
def hear(i: Instruments, period: int, heard: Heard) -> None:
    """Add the inertial reading, and take the readings that have arrived out of their lines."""
    told, rates, force = heard.inertial, i.inertial.rates, i.inertial.force
    told[0], told[1], told[2] = told[0] + rates.x, told[1] + rates.y, told[2] + rates.z
    told[3], told[4], told[5] = told[3] + force.x, told[4] + force.y, told[5] + force.z
    for line in range(N_DELAYED):
        while i.waiting[line] > 0.0 and i.arrives[line, int(i.first[line])] <= period:
            first = int(i.first[line])
            if i.sampled[line, first] > heard.sampled[line]:
                heard.sampled[line] = i.sampled[line, first]
                for k in range(READING_SIZE):
                    heard.readings[line, k] = i.readings[line, first, k]
            drop(line, i)


@entry
def drive(
    records: FlightRecords, aboard: AboardRecords, around: WorldArrays, heard: Heard, periods: int
) -> tuple[int, int]:
    """Fly under the command that the flight's controller holds, until the time is up.

    Args:
        records: The flight, which is changed in place; reference and design are not looked at.
        aboard: Instruments; the filter is not looked at.
        around: Wind wall, obstacles and random draws.
        heard: Receives what the instruments tell.
        periods: Control periods.

    Returns:
        Periods flown, and how it ended: FLOWN or DIVERGED.
    """
    flight, a, air, field = records.flights[0], records.airframes[0], records.airs[0], records.fields[0]
    i, fast, slow = aboard.aboard[0].instruments, aboard.fast, aboard.slow
    gusty, swirls, solids = len(around.gusts) > 0, len(around.swirls) > 0, len(around.solids) > 0
    heard.inertial[:] = 0.0
    for done in range(periods):
        if gusty:
            update_gust(flight, air, around.gusts, done)
        if swirls:
            update_field(flight, air, field, around.wall, around.swirls, done)
        before = value_of(flight.plant)
        in_force = delayed(i, value_of(flight.controller.command), flight.periods)
        if swirls:
            move_in_field(flight, air, a, field, in_force)
        else:
            move(flight, air, a, in_force)
        if solids:
            touch_solids(flight, a, field, around.solids)
        read_all(i, a, motion_of(flight, air, before, in_force), fast, slow)
        hear(i, flight.periods, heard)
    heard.inertial[:] /= max(periods, 1)
    return periods, FLOWN if is_finite(value_of(flight.plant)) else DIVERGED
