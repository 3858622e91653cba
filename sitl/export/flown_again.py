"""Recorded flights flown once more by the exported code, period by period, and compared to the bit."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from sitl.control.estimate import Readings
from sitl.errors import SitlError
from sitl.estimation.sensing import Normals, read
from sitl.export.build import FlatController
from sitl.export.flat import flattened
from sitl.model.airframe import Array
from sitl.model.state import Plant
from sitl.model.vectors import Vector, add
from sitl.simulation.flight import Flight, quantised
from sitl.simulation.simulation import Simulation

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
        asks: What is asked of it, and in which period.

    A flight that ends by itself, because its state is no longer finite, is kept as far as it was flown.
    """
    begin = flattened(made.flight.controller)
    rows, controllers = [], []
    due = sorted(asks, key=lambda ask: ask[0])
    for period in range(periods + 1):
        before = made.flight
        controllers.append(flattened(before.controller))
        while due and due[0][0] == period:
            due.pop(0)[1](made)
        flown = made.flight.controller
        flags = [flown.is_armed, flown.is_flying, flown.is_landing]
        kept = before.controller
        asked = flags != [kept.is_armed, kept.is_flying, kept.is_landing]
        now, reference = made.flight, made.reference
        has_readings = not made.avionics.is_sensed
        try:
            if period < periods:
                made.advance(1)
        except SitlError:
            break
        readings = _readings(made, now) if has_readings and period < periods else NO_READINGS
        rows.append(
            np.concatenate(
                [
                    [float(flag) for flag in (asked, *flags, has_readings, kept.has_crashed)],
                    flattened(now.estimate),
                    flattened(reference),
                    flattened(readings),
                ]
            )
        )
    return RecordedFlight(
        name=name,
        design=flattened(made.design),
        begin=begin,
        rows=np.array(rows),
        controllers=np.array(controllers[: len(rows)]),
        jumps=len(made.jumps),
    )


def _readings(made: Simulation, before: Flight) -> Readings:
    """Readings of the sensors of the truth in the period that was just flown."""
    _, draws = made.draws.rows(before.periods, gusts=made.environment.gust_rms > 0.0)
    noise = Normals(*(quantised(float(draw)) for draw in draws[0]))
    wind = add(made.environment.wind, made.flight.gust)
    plant: Plant = before.plant
    return read(plant, wind, noise, made.environment.sensors, made.airframe)


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
