"""What of a log is asked for: quantities at common times, within a span of flight."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.flight_log.field_expressions import quantity
from protocol.flight_log.flight_clock import times_since_boot
from protocol.flight_log.flight_summary import vehicles
from protocol.tlog import TlogReader
from protocol.wire.message import Source

__all__ = ["Selection", "Span", "selected", "vehicle_of"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Span:
    """Times since the vehicle was switched on [s]."""

    begin: float = -np.inf
    end: float = np.inf

    def of(self, times: Floats) -> NDArray[np.bool_]:
        """Which times lie within it."""
        within: NDArray[np.bool_] = (times >= self.begin) & (times <= self.end)
        return within


@dataclass(frozen=True, slots=True)
class Selection:
    """Quantities of a log."""

    times: tuple[Floats, ...]  # of each quantity [s], shape (n,)
    values: tuple[Floats, ...]  # shape (n,)
    names: tuple[str, ...]

    def table(self) -> tuple[Floats, list[Floats]]:
        """All quantities at the times of the first one, in between in proportion."""
        first = self.times[0]
        rest = [
            values if times is first else np.interp(first, times, values)
            for times, values in zip(self.times, self.values, strict=True)
        ]
        return first, rest


def vehicle_of(reader: TlogReader, name: str) -> Source:
    """The first vehicle of a log.

    Raises:
        FileError: It has none.
    """
    found = vehicles(reader)
    if not found:
        raise FileError(f"{name}: no vehicle sent a HEARTBEAT in this log")
    return found[0]


def selected(reader: TlogReader, name: str, expressions: Sequence[str], span: Span) -> Selection:
    """Quantities of the log's vehicle within a span.

    Raises:
        FileError: The log has no vehicle, an expression cannot be used, or nothing lies within the span.
    """
    source = vehicle_of(reader, name)
    clock = times_since_boot(reader, source)
    times, values, names = [], [], []
    for text in expressions:
        found = quantity(reader, text, source)
        within = span.of(clock[found.rows])
        if not within.any():
            raise FileError(f"{name}: {text} has no value from {span.begin:g} to {span.end:g} s")
        times.append(clock[found.rows][within])
        values.append(found.values[within])
        names.append(found.name)
    return Selection(tuple(times), tuple(values), tuple(names))
