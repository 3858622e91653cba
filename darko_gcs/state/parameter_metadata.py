"""What one parameter of the vehicle means: text, unit, range and default, as the vehicle describes it."""

from __future__ import annotations

import math
from typing import NamedTuple

__all__ = ["MAX_PARAMETERS", "NO_METADATA", "ParameterMetadata"]

MAX_PARAMETERS = 5000  # of one vehicle; more are ignored


class ParameterMetadata(NamedTuple):
    """Description of one parameter; NaN or an empty text where the vehicle gives none."""

    text: str = ""
    unit: str = ""
    minimum: float = math.nan
    maximum: float = math.nan
    default: float = math.nan
    is_integer: bool = False
    needs_reboot: bool = False

    @property
    def bounds(self) -> str:
        """The range as text, "0.1..3"; empty without one."""
        if math.isnan(self.minimum) and math.isnan(self.maximum):
            return ""
        low, high = ("" if math.isnan(end) else f"{end:g}" for end in (self.minimum, self.maximum))
        return f"{low}..{high}"

    def problem_with(self, value: float) -> str | None:
        """Why the parameter cannot have this value, or None."""
        if self.is_integer and value != int(value):
            return f"{value:g} is not a whole number"
        if value < self.minimum or value > self.maximum:  # false for NaN: no bound is known
            return f"{value:g} is not within {self.bounds} {self.unit}".rstrip()
        return None


NO_METADATA = ParameterMetadata()
