"""Recorded flights flown once more by the exported code, period by period, and compared to the bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sitl.control.estimate import Readings
from sitl.errors import SitlError
from sitl.estimation.sensing import Normals, read
from sitl.export.build import FlatController
from sitl.export.flat import flattened, flattened_records
from sitl.model.airframe import Array
from sitl.model.state import Plant
from sitl.model.vectors import Vector
from sitl.simulation.flight import quantised
from sitl.simulation.simulation import Simulation
from sitl.storage import Records

Ask = Callable[[Simulation], None]
NO_READINGS = Readings(Vector(0.0, 0.0, 0.0), 0.0, 0.0, False)


class RecordedFlight(NamedTuple):
    """Everything that the controller was given in a flight, and what it made of it."""

    name: str
    design: Array  # flat, (d,)
    begin: Array  # the controller at the beginning, flat, (c,)
    rows: Array  # of each period its flags, estimate, reference and readings, (n + 1, r)
    controllers: Array  # after each observation, before anything was asked, flat, (n + 1, c)
    jumps: int  # taken


class Difference(NamedTuple):
    """Difference of a flight of the exported code from ours."""

    name: str
    periods: int  # compared
    jumps: int
    first: int  # period of the first difference; -1 without one
    largest: float  # of any number that the controller keeps
    steps: int  # periods in which whole steps did anything else than halves of them

    @property
    def is_none(self) -> bool:
        """Whether every bit is the same."""
        return self.first < 0 and self.steps == 0

    @property
    def words(self) -> str:
        """The difference in words."""
        return f"differs from period {self.first} of {self.periods}, by {self.largest:.3g}; {self.steps} steps"


def record(name: str, made: Simulation, periods: int, asks: Sequence[tuple[int, Ask]] = ()) -> RecordedFlight:
    """Fly and keep what the controller saw and did.

    Args:
        name: Of the flight.
        made: The simulation, flown on.
        periods: How many control periods.
        asks: What is asked of it, and in which period: flags, references and wind.

    A flight that ends by itself, because its state is no longer finite, is kept as far as it was flown.
    """
    seen = np.zeros(periods + 1, made.flight_record.dtype)
    asked, references = seen.copy(), np.zeros((periods + 1, len(flattened(made.reference))))
    readings, has_readings = np.zeros((periods + 1, len(flattened(NO_READINGS)))), not made.avionics.is_sensed
    due, told, n = sorted(asks, key=lambda ask: ask[0]), None, periods
    for period in range(periods + 1):
        seen[period] = made.flight_record[0]
        while due and due[0][0] == period:
            due.pop(0)[1](made)
        asked[period] = made.flight_record[0]
        if made.reference is not told:
            told = made.reference
            references[period:] = flattened(told)
        if period == periods:
            break
        before, now = made.truth, made.periods
        try:
            made.advance(1)
        except SitlError:
            n = max(period - 1, 0)
            break
        if has_readings:
            readings[period] = _readings(made, before, now)
    controllers = flattened_records(seen[: n + 1]["controller"])
    rows = (
        _flags(seen[: n + 1], asked[: n + 1], has_readings),
        flattened_records(asked[: n + 1]["estimate"]),
        references[: n + 1],
        readings[: n + 1],
    )
    return RecordedFlight(
        name=name,
        design=flattened(made.design),
        begin=controllers[0],
        rows=np.concatenate(rows, axis=1),
        controllers=controllers,
        jumps=len(made.jumps),
    )


def _flags(seen: Records, asked: Records, has_readings: bool) -> Array:
    """Whether flags were asked for, the flags, whether there are readings, and whether it has crashed, (n + 1, 6)."""
    before, flags = (
        np.stack([one["controller"][name] for name in ("is_armed", "is_flying", "is_landing")], axis=1)
        for one in (seen, asked)
    )
    changed, has_crashed = (flags != before).any(axis=1), seen["controller"]["has_crashed"]
    return np.column_stack([changed, flags, np.full(len(seen), has_readings), has_crashed]).astype(float)


def _readings(made: Simulation, before: Plant, period: int) -> Array:
    """Readings of the sensors of the truth in the period that was just flown."""
    _, draws = made.draws.rows(period, gusts=made.environment.gust_rms > 0.0)
    noise = Normals(*(quantised(draw) for draw in draws[0].tolist()))
    return flattened(read(before, made.wind, noise, made.noise, made.airframe))


def compared(flight: RecordedFlight, code: FlatController) -> Difference:
    """Fly a recorded flight by the exported code."""
    seen, steps = code.replay(flight.design, flight.begin, flight.rows)
    same = (seen.view(np.int64) == flight.controllers.view(np.int64)).all(axis=1)
    apart = np.abs(seen - flight.controllers)
    return Difference(
        name=flight.name,
        periods=len(seen) - 1,
        jumps=flight.jumps,
        first=-1 if same.all() else int(np.argmin(same)),
        largest=float(np.nanmax(apart)) if apart.size else 0.0,
        steps=steps,
    )
