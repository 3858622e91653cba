"""Values that the report prints, each as the interval of numbers that would be printed so."""

from __future__ import annotations

import math
from typing import NamedTuple

EDGE = 1e-9  # relative: a number on the edge of the interval lies in it


class Expectation(NamedTuple):
    """A printed number or statement, and which numbers agree with it."""

    text: str  # as the report has it
    low: float
    high: float
    reading: str  # how the interval follows from the text

    def holds(self, value: float) -> bool:
        """Whether a number would be printed so; NaN never is."""
        slack = EDGE * max(1.0, abs(value)) if math.isfinite(self.high - self.low + value) else 0.0
        return self.low - slack <= value <= self.high + slack


def printed(text: str) -> Expectation:
    """A printed number: half a unit of its last digit either way.

    Raises:
        ValueError: If the text is not a decimal number.
    """
    value, half = float(text), 0.5 * 10.0 ** -len(text.partition(".")[2])
    return Expectation(text, value - half, value + half, f"± {half:g}")


def printed_to_ten(text: str) -> Expectation:
    """A printed whole number whose last zero is no digit."""
    return Expectation(text, float(text) - 5.0, float(text) + 5.0, "± 5: read to the ten")


def all_of(count: int) -> Expectation:
    """So many of so many."""
    return Expectation(f"all {count}", float(count), float(count), "each to its last printed digit")


def below(bound: float, text: str) -> Expectation:
    """A statement that says less than a number."""
    return Expectation(text, -math.inf, math.nextafter(bound, -math.inf), f"< {bound:g}")


def above(bound: float, text: str) -> Expectation:
    """A statement that says more than a number."""
    return Expectation(text, math.nextafter(bound, math.inf), math.inf, f"> {bound:g}")
