"""Tables of a log as its own definitions tell them, in SI units, before they become messages."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from protocol.errors import FileError
from protocol.foreign_logs.vehicle_messages import VehicleMessages, within_flight
from protocol.tlog.scan import Damage

Floats = NDArray[np.float64]

MAX_FOREIGN_SIZE = 1 << 30  # that is read [bytes]
MAX_PIECES = 1000  # of damage that are listed; a file with more is refused

EARLIEST, LATEST = 946_684_800e6, 4_102_444_800e6  # dates that are believed: 2000 to 2100 [us since 1970]
_DEGREE = math.radians(1.0)
SI_FACTORS = {  # of units as the formats spell them; angles become radians
    **dict.fromkeys(("deg", "degheading", "deglatitude", "deglongitude", "deg/s", "degree"), _DEGREE),
    **dict.fromkeys(("centideg", "centideg/s", "cdeg"), 0.01 * _DEGREE),
    **dict.fromkeys(("rad", "rad/s", "m", "s", "V", "A", "Pa"), 1.0),
    **dict.fromkeys(("m/s", "m/s/s", "m/s2", "m/s^2", "m/s-2", "m.s-1", "m.s-2"), 1.0),
    "decideg": 0.1 * _DEGREE, "1e7deg": 1e-7 * _DEGREE,
    "cm": 0.01, "mm": 0.001, "km": 1000.0, "cm/s": 0.01, "mm/s": 0.001, "ms": 1e-3, "us": 1e-6,
    "mV": 1e-3, "decivolt": 0.1, "dV": 0.1, "mA": 1e-3, "cA": 0.01, "%": 0.01,
}  # fmt: skip


@dataclass(frozen=True)
class LogTable:
    """Samples of one message of a log.

    Attributes:
        times: Since the vehicle was switched on [s], shape (n,).
        columns: Numbers in SI units by field, each of n rows; texts as they are.
    """

    times: Floats
    columns: Mapping[str, NDArray[Any]]

    def has(self, *names: str) -> bool:
        """Whether it has fields, and samples."""
        return len(self.times) > 0 and all(name in self.columns for name in names)

    def stack(self, *names: str) -> Floats:
        """Fields side by side, (n, k)."""
        return np.stack([np.asarray(self.columns[name], np.float64) for name in names], axis=1)

    def where(self, chosen: NDArray[np.bool_]) -> LogTable:
        """Some of its samples."""
        return LogTable(self.times[chosen], {name: column[chosen] for name, column in self.columns.items()})


EMPTY_TABLE = LogTable(np.zeros(0), {})


class DamageList:
    """Damage found in a file, in its order.

    Args:
        name: The file's.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.pieces: list[Damage] = []

    def add(self, offset: int, length: int, what: str) -> None:
        """Note a piece; one that follows the piece before is one with it.

        Raises:
            FileError: There are too many.
        """
        last = self.pieces[-1] if self.pieces else None
        if last is not None and last.offset + last.length == offset and last.what == what:
            self.pieces[-1] = replace(last, length=last.length + length)
            return
        if len(self.pieces) >= MAX_PIECES:
            raise FileError(f"{self.name}: damaged in more than {MAX_PIECES} places, the last at byte {offset}: {what}")
        self.pieces.append(Damage(offset, length, what))


@dataclass(frozen=True)
class ForeignFlight:
    """Content of a log of another kind.

    Attributes:
        kind: What it is, such as "PX4 ULog".
        vehicles: What it tells of each vehicle.
        size: Of the file with the samples [bytes].
        damage: In the file.
        start_usec: When the clock of its times was zero, since 1970 [us]; 0 if it does not say.
    """

    kind: str
    vehicles: list[VehicleMessages]
    size: int
    damage: Sequence[Damage]
    start_usec: int


def cleaned(tables: Mapping[Any, LogTable], damage: DamageList, size: int) -> dict[Any, LogTable]:
    """The tables without times that are none, each by time; what is left out is noted at the end of the file."""
    begin, end = within_flight([table.times for table in tables.values()])
    kept, lost = {}, 0
    for key, table in tables.items():
        inside = (table.times >= begin) & (table.times <= end)
        lost += int((~inside).sum())
        ordered = table.where(inside)
        order = np.argsort(ordered.times, kind="stable")
        kept[key] = LogTable(ordered.times[order], {name: column[order] for name, column in ordered.columns.items()})
    if lost:
        damage.add(size, 0, f"{lost} samples with times that are none of the flight")
    return kept


def plausible_start(utc_usec: NDArray[Any], times: Floats) -> int:
    """Median of what the dates of some times [s] make of their clock's zero [us since 1970]; 0 if that is no date."""
    start = float(np.median(utc_usec - times * 1e6))
    return round(start) if EARLIEST < start < LATEST else 0
