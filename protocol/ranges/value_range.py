"""The range of one number of the wire, and what is said of a number out of it."""

from __future__ import annotations

import math
import struct
from typing import NamedTuple

__all__ = ["ANY_NUMBER", "MAX_FLOAT32", "Flaw", "ValueRange", "finite", "first_flaw", "one_of", "whole"]

MAX_FLOAT32 = 3.4028235e38
"""The greatest finite number of the wire, as the shortest decimal that stands for it."""


class ValueRange(NamedTuple):
    """Values that a number may have; a limit that is no float32 holds for the nearest one as well."""

    name: str  # of the number, for people
    minimum: float = -MAX_FLOAT32
    maximum: float = MAX_FLOAT32
    unit: str = ""
    also: tuple[float, ...] = ()  # further values, each with a meaning of its own
    default: bool = True  # NaN is allowed: it leaves the value to the vehicle
    is_whole: bool = False

    def allows(self, value: float) -> bool:
        """Whether the number may have a value."""
        if math.isnan(value):
            return self.default
        if value in self.also:
            return True
        if not abs(value) <= MAX_FLOAT32 or (self.is_whole and not _is_whole(value)):
            return False
        least, most = _float32(self.minimum), _float32(self.maximum)
        return min(self.minimum, least) <= value <= max(self.maximum, most)

    @property
    def words(self) -> str:
        """The allowed values in words, after "not"."""
        parts = [f"{value:g}" for value in self.also]
        if self.maximum == -self.minimum == MAX_FLOAT32:
            parts.append("a number that is finite")
        elif self.minimum <= self.maximum:
            kind = "a whole number" if self.is_whole else "a number"
            parts.append(f"{kind} from {self.minimum:g} to {self.maximum:g}{' ' * bool(self.unit)}{self.unit}")
        return " or ".join(filter(None, [", ".join(parts[:-1]), parts[-1]]))

    @property
    def span(self) -> str:
        """The allowed values, as a table has them."""
        parts = [f"{value:g}" for value in self.also]
        if self.maximum == -self.minimum == MAX_FLOAT32:
            parts.append("finite")
        elif self.minimum <= self.maximum:
            parts.append(f"{self.minimum:g}..{self.maximum:g}{' ' * bool(self.unit)}{self.unit}")
        return ", ".join(parts) + ", whole" * self.is_whole


class Flaw(NamedTuple):
    """A number that is out of its range."""

    number: int  # of the parameter, from 1
    text: str


ANY_NUMBER = ValueRange("not used")
"""Of a number without a meaning here: finite, so that it can be stored, or NaN."""


def finite(
    name: str, minimum: float, maximum: float, unit: str = "", *, also: tuple[float, ...] = (), default: bool = True
) -> ValueRange:
    """A real number within limits."""
    return ValueRange(name, minimum, maximum, unit, also, default)


def whole(
    name: str, minimum: float, maximum: float, *, also: tuple[float, ...] = (), default: bool = False
) -> ValueRange:
    """A whole number within limits."""
    return ValueRange(name, minimum, maximum, "", also, default, is_whole=True)


def one_of(name: str, *values: float, default: bool = False) -> ValueRange:
    """One of a few values."""
    return ValueRange(name, math.inf, -math.inf, "", values, default)


def first_flaw(ranges: tuple[ValueRange, ...], values: tuple[float, ...]) -> Flaw | None:
    """The first parameter that is out of its range, or None."""
    for number, (allowed, value) in enumerate(zip(ranges, values, strict=True), start=1):
        if not allowed.allows(value):
            return Flaw(number, f"param{number} is {value:g}, not {allowed.words} ({allowed.name})")
    return None


def _is_whole(value: float) -> bool:
    """Whether a whole number says all of a value: -0 would be stored as 0."""
    return value == int(value) and (value != 0.0 or math.copysign(1.0, value) > 0.0)


def _float32(value: float) -> float:
    """The nearest number of the wire; a limit that is infinite stays so."""
    if math.isinf(value):
        return value
    (carried,) = struct.unpack("<f", struct.pack("<f", value))
    return float(carried)
