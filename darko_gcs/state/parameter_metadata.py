"""Metadata of one parameter: text, unit, range, default and names, as the vehicle describes it."""

from __future__ import annotations

import math
from typing import NamedTuple

MAX_PARAMETERS = 5000  # of one vehicle; more are ignored
RELATIVE_TOLERANCE = 1e-6  # values are float32 on the wire, defaults are decimals in a file
ABSOLUTE_TOLERANCE = 1e-12
WORD_MASK = 0xFFFFFFFF  # of an integer on the wire, whatever its sign
NO_BIT = "none"  # a mask without a bit


class ParameterMetadata(NamedTuple):
    """Description of one parameter; NaN or an empty text where the vehicle gives none."""

    text: str = ""
    unit: str = ""
    minimum: float = math.nan
    maximum: float = math.nan
    default: float = math.nan
    is_integer: bool = False
    needs_reboot: bool = False
    long_text: str = ""
    values: tuple[tuple[float, str], ...] = ()  # of an enumeration, or special ones: each with its name
    bits: tuple[tuple[int, str], ...] = ()  # of a mask: each bit's number, 0 the lowest, and its name

    @property
    def bounds(self) -> str:
        """The range as text, "0.1..3"; empty without one."""
        if math.isnan(self.minimum) and math.isnan(self.maximum):
            return ""
        low, high = ("" if math.isnan(end) else f"{end:g}" for end in (self.minimum, self.maximum))
        return f"{low}..{high}"

    @property
    def is_listed(self) -> bool:
        """True if no value beside those with a name is possible, as far as the vehicle tells."""
        numbers = [number for number, _ in self.values]
        return self.is_integer and bool(numbers) and (self.minimum, self.maximum) == (min(numbers), max(numbers))

    def problem_with(self, value: float) -> str | None:
        """Reason why the parameter cannot have this value, or None."""
        if self.is_integer and value != int(value):
            return f"{value:g} is not a whole number"
        if value < self.minimum or value > self.maximum:  # false for NaN: no bound is known
            return f"{value:g} is outside {self.bounds} {self.unit}".rstrip()
        return None

    def name_of(self, value: float) -> str:
        """A value in words: the name of an enumeration's value, those of a mask's bits; empty if there are none."""
        if self.bits:
            word = int(value) & WORD_MASK
            known = dict(self.bits)
            return " + ".join(known.get(bit, f"bit {bit}") for bit in range(32) if word >> bit & 1) or NO_BIT
        return next((name for number, name in self.values if same_value(number, value)), "")

    def shown(self, value: float) -> str:
        """A value for people: "return (2)", "gps + vision (5)", "1.5"."""
        name = self.name_of(value)
        return f"{name} ({number_text(value)})" if name else number_text(value)

    def value_of(self, text: str) -> float:
        """The value that a text means: a number, the name of a value, or names of bits with commas between.

        Raises:
            ValueError: It means none; the message says which names there are.
        """
        try:
            number = float(text)
        except ValueError:
            return self._named(text)
        if not math.isfinite(number):
            raise ValueError(f"{text} is not a number")
        return number

    def _named(self, text: str) -> float:
        numbers = {_plain(name): float(number) for number, name in self.values}
        if _plain(text) in numbers:
            return numbers[_plain(text)]
        masks = {_plain(name): 1 << bit for bit, name in self.bits} | ({NO_BIT: 0} if self.bits else {})
        words = [_plain(word) for word in text.replace("+", ",").split(",")]
        if masks and all(word in masks for word in words):
            return float(sum({masks[word] for word in words}))
        names = ", ".join(name for _, name in (*self.values, *self.bits))
        raise ValueError(f"{text!r} is not a number" + (f", nor one of: {names}" if names else ""))


NO_METADATA = ParameterMetadata()


def same_value(a: float, b: float) -> bool:
    """Whether two values are one on the wire."""
    return math.isclose(a, b, rel_tol=RELATIVE_TOLERANCE, abs_tol=ABSOLUTE_TOLERANCE)


def number_text(value: float) -> str:
    """A value as it is edited, in the digits of a float32."""
    return str(value) if isinstance(value, int) else f"{value:.7g}"


def _plain(name: str) -> str:
    return " ".join(name.lower().replace("_", " ").replace("-", " ").split())
