"""Selection from a log: quantities at common times, within a span of flight."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.flight_log.field_expressions import between, quantity
from protocol.flight_log.flight_clock import times_since_boot
from protocol.flight_log.flight_summary import chosen_vehicle
from protocol.tlog import TlogReader
from protocol.wire.message import Source

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Span:
    """Times since the vehicle was switched on [s]."""

    begin: float = -np.inf
    end: float = np.inf

    def of(self, times: Floats) -> NDArray[np.bool_]:
        """Whether each time lies within the span."""
        within: NDArray[np.bool_] = (times >= self.begin) & (times <= self.end)
        return within


@dataclass(frozen=True, slots=True)
class Selection:
    """Quantities of a log."""

    times: tuple[Floats, ...]  # of each quantity [s], shape (n,)
    values: tuple[Floats, ...]  # shape (n,)
    names: tuple[str, ...]
    units: tuple[str, ...]  # of the values; empty where they are not known
    source: Source  # the vehicle's (system, component)

    def table(self) -> tuple[Floats, list[Floats]]:
        """All quantities at the times of the first one, in between in proportion; NaN where their messages lacked."""
        first = self.times[0]
        rest = [
            values if times is first else between(first, times, values)
            for times, values in zip(self.times, self.values, strict=True)
        ]
        return first, rest

    def figures(self) -> list[dict[str, Any]]:
        """Of each quantity its span, its least and its greatest value, for a program."""
        return [
            {
                "field": name,
                "unit": unit,
                "count": len(times),
                "from": float(times[0]),
                "to": float(times[-1]),
                "min": _least(np.min, values),
                "max": _least(np.max, values),
            }
            for times, values, name, unit in zip(self.times, self.values, self.names, self.units, strict=True)
        ]


def _least(function: Callable[[Floats], float], values: Floats) -> float:
    known = values[np.isfinite(values)]
    return float(function(known)) if len(known) else math.nan


def selected(
    reader: TlogReader, name: str, expressions: Sequence[str], span: Span, vehicle: int | None = None
) -> Selection:
    """Quantities of one of the log's vehicles within a span, each in the order of its times.

    Args:
        reader: The log.
        name: What errors call it.
        expressions: Of fields.
        span: Of the vehicle's time.
        vehicle: System id; None: the first vehicle.

    Raises:
        FileError: The log has no such vehicle, an expression cannot be used, or nothing lies within the span.
    """
    source = chosen_vehicle(reader, name, vehicle)
    clock = times_since_boot(reader, source)
    times, values, names, units = [], [], [], []
    for text in expressions:
        found = quantity(reader, text, source, clock)
        within = span.of(clock[found.rows])
        if not within.any():
            raise FileError(f"{name}: {text} has no value from {span.begin:g} to {span.end:g} s")
        order = np.argsort(clock[found.rows][within], kind="stable")  # a late message stands where it was made
        times.append(clock[found.rows][within][order])
        values.append(found.values[within][order])
        names.append(found.name)
        units.append(found.unit)
    return Selection(tuple(times), tuple(values), tuple(names), tuple(units), source)
