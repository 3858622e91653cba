"""Recorded flights on sensors navigated once more by the exported estimator, period by period."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from sitl.estimation.filter import Filter, Step
from sitl.estimation.nominal_state import ARENA_ERRORS
from sitl.export.c_types import ExportError
from sitl.export.estimator import InstrumentsAboard, record_layouts, record_places
from sitl.export.flat import flattened, flattened_records
from sitl.export.flown_again import Ask
from sitl.model.actuators import limited
from sitl.model.airframe import Array
from sitl.model.state import Actuators
from sitl.sensors.instruments import FIRST_DELAYED, N_DELAYED, READING_SIZE
from sitl.simulation.sensed import delayed
from sitl.simulation.simulation import Simulation
from sitl.storage import copy_of, fields, is_compound

HEAD, READING = 12, 3 + READING_SIZE  # numbers of a row before its readings, and of each of those
ROW = HEAD + N_DELAYED * READING


class Lines(NamedTuple):
    """Readings on their way to the filter, as the instruments keep them."""

    sampled: Array  # control period of each, (LINES, LINE)
    arrives: Array  # control period of its arrival, (LINES, LINE)
    readings: Array  # (LINES, LINE, READING)


class RecordedNavigation(NamedTuple):
    """Everything that the filter was given in a flight, and what it made of it."""

    name: str
    filter: Array  # at the beginning, flat, (f,)
    instruments: Array  # likewise, (i,)
    steps: Array  # likewise, (MAX_HORIZON, s)
    period: int  # at the beginning
    has_tube: bool
    rows: Array  # of each period whether it lands, inertial reading, command, and readings as they were made, (n, ROW)
    estimates: Array  # after each, flat, (n, e)
    end: Array  # the filter at the end, flat, (f,)


class NavigationDifference(NamedTuple):
    """Difference of the exported estimator's flight from ours."""

    name: str
    periods: int  # compared
    readings: int  # that it was given
    first: int  # period of the first estimate that differs; -1 without one
    numbers: int  # that differ in the filter at the end

    @property
    def is_none(self) -> bool:
        """Whether every bit is the same."""
        return self.first < 0 and self.numbers == 0

    @property
    def words(self) -> str:
        """The difference in words."""
        return f"differs from period {self.first} of {self.periods}; {self.numbers} numbers at the end"


def record_navigation(
    name: str, made: Simulation, periods: int, asks: Sequence[tuple[int, Ask]] = ()
) -> RecordedNavigation:
    """Fly on and keep what the filter was given and made of it.

    Args:
        name: Of the flight.
        made: The simulation, which has sensors, flown on.
        periods: How many control periods.
        asks: What is asked of it, and in which period.
    """
    i: Any = made.avionics.instruments
    begin = RecordedNavigation(
        name=name,
        filter=_numbers(made.avionics.filter, Filter),
        instruments=_numbers(i, InstrumentsAboard),
        steps=np.array([_numbers(step, Step) for step in made.avionics.steps]),
        period=made.periods,
        has_tube=made.environment.sensors.has_pitot,
        rows=np.zeros((periods, ROW)),
        estimates=np.zeros((periods, len(flattened(made.estimate)))),
        end=np.zeros(0),
    )
    due = sorted(asks, key=lambda ask: ask[0])
    model = copy_of(made.avionics.filter.model)
    lines = Lines(i.sampled, i.arrives, i.readings)
    for period, row in enumerate(begin.rows):
        kept = Lines(*(part.copy() for part in lines))
        while due and due[0][0] == period:
            due.pop(0)[1](made)
        made.advance(0)  # the jumps that are due come before the period
        command, armed = _in_force(made), made.armed
        made.advance(1)
        has_crashed = made.flight_record["controller"]["has_crashed"][0]  # in the period: that stops the motors
        wanted = limited(command, armed and not has_crashed, model)
        row[0] = made.landing
        row[1:HEAD] = (*flattened_records(made.avionics.records["instruments"]["inertial"])[0], *wanted, 0.0)
        _note_readings(row, lines, kept, made.periods)
        begin.estimates[period] = flattened_records(made.estimate_record)[0]
    return begin._replace(end=_numbers(made.avionics.filter, Filter))


def _in_force(made: Simulation) -> Actuators:
    """The command that will be in force in the coming period, as late as the pipeline makes it."""
    i: Any = made.avionics.instruments
    kept: Any = SimpleNamespace(pending=i.pending.copy(), held=i.held.copy(), specification=i.specification)
    return delayed(kept, made.command, made.periods)


def _note_readings(row: Array, lines: Lines, kept: Lines, period: int) -> None:
    """Note the readings that lines have got in a period."""
    new = (lines.sampled != kept.sampled) | (lines.arrives != kept.arrives)
    new |= (lines.readings != kept.readings).any(axis=2)
    for line, at in np.argwhere(new):
        place = HEAD + int(row[HEAD - 1]) * READING
        age, late = period - lines.sampled[line, at], max(lines.arrives[line, at] - period, 0.0)
        row[place : place + READING] = (line + FIRST_DELAYED, age, late, *lines.readings[line, at])
        row[HEAD - 1] += 1.0


def _numbers(record: Any, kind: Any) -> Array:  # noqa: ANN401 - a record, or a part of one
    """The numbers of a record, in the order of a NamedTuple's fields, which may be fewer."""
    parts = []
    for name, part in fields(kind).items():
        one = record[name]
        parts.append(_numbers(one, part) if is_compound(part) else np.ravel(one).astype(float))
    return np.concatenate(parts)


class FlatEstimator:
    """The exported estimator in a shared library, by flat arrays."""

    def __init__(self, library: Path) -> None:
        """Load it.

        Raises:
            ExportError: If it was not exported, or by another version.
        """
        self.functions = ctypes.CDLL(str(library.resolve()))
        address, number = ctypes.c_void_p, ctypes.c_int32
        if not hasattr(self.functions, "flat_estimator_fly"):
            raise ExportError(f"{library.parent} holds no exported estimator: darko-sitl export c --estimator")
        arguments = {
            "sizes": [address],
            "init": [address, address, number, address],
            "begin": [address, address, address, address, number, number],
            "fly": [address, address, number, address],
            "filter": [address, address],
            "navigate": [address, address, address, number, address, number, address],
        }
        for name, kinds in arguments.items():
            function = getattr(self.functions, f"flat_estimator_{name}")
            function.argtypes, function.restype = kinds, None
        if self._sizes()[5:] != list(record_places(record_layouts()).values()):
            raise ExportError(
                f"{library.parent} was exported by another version of darko: its filter keeps other numbers"
            )
        self._memory = ctypes.create_string_buffer(self.functions.flat_estimator_size() + 64)

    @property
    def is_single(self) -> bool:
        """Whether it computes in floats."""
        return bool(self.functions.flat_estimator_is_single())

    @property
    def is_in_arena(self) -> bool:
        """Whether motion capture aids the exported filter."""
        return self._sizes()[4] == ARENA_ERRORS

    @property
    def estimate_size(self) -> int:
        """Numbers in an estimate."""
        return self._sizes()[3]

    def _sizes(self) -> list[int]:
        made = (ctypes.c_int32 * 10)()
        self.functions.flat_estimator_sizes(made)
        return list(made)

    def initial(self, filter_: Array, *, has_tube: bool) -> Array:
        """A new filter about the model of another one, flat."""
        made, given = np.zeros(len(filter_)), np.ascontiguousarray(filter_)
        self.functions.flat_estimator_init(self._memory, given.ctypes.data, int(has_tube), made.ctypes.data)
        return made

    def navigate(self, flight: RecordedNavigation) -> tuple[Array, Array]:
        """Estimates of a recorded flight, (n, e), and the filter at its end, (f,)."""
        parts = (flight.filter, flight.instruments, flight.steps, flight.rows)
        *begin, rows = (np.ascontiguousarray(part) for part in parts)
        addresses = [part.ctypes.data for part in begin]
        self.functions.flat_estimator_begin(self._memory, *addresses, flight.period, int(flight.has_tube))
        estimates, end = np.zeros_like(flight.estimates), np.zeros_like(flight.filter)
        self.functions.flat_estimator_fly(self._memory, rows.ctypes.data, len(rows), estimates.ctypes.data)
        self.functions.flat_estimator_filter(self._memory, end.ctypes.data)
        return estimates, end


def compared_navigation(flight: RecordedNavigation, code: FlatEstimator) -> NavigationDifference:
    """Navigate a recorded flight by the exported code."""
    estimates, end = code.navigate(flight)
    same = (estimates.view(np.int64) == flight.estimates.view(np.int64)).all(axis=1)
    return NavigationDifference(
        name=flight.name,
        periods=len(same),
        readings=int(flight.rows[:, HEAD - 1].sum()),
        first=-1 if same.all() else int(np.argmin(same)),
        numbers=int((end.view(np.int64) != flight.end.view(np.int64)).sum()),
    )
